import math

import pytest

from trajevo import TrajevoError
from trajevo.base import units


def test_factors_and_si_units():
    assert units.to_si("deg/s^3") == pytest.approx(math.pi / 180)
    assert units.si_unit("deg/s^3") == "rad/s^3"
    assert units.to_si("mm/s^2") == 1e-3
    assert units.per_time("rad", 0) == "rad"
    assert units.per_time("m", 1) == "m/s"
    assert units.per_time("rad", 3) == "rad/s^3"


def test_display_turns_angles_and_nothing_else():
    assert units.display("rad/s", angle="deg") == ("deg/s", pytest.approx(180 / math.pi))
    assert units.display("m/s", angle="deg") == ("m/s", 1.0)
    assert units.display("rad", angle="rad") == ("rad", 1.0)
    assert units.pretty("deg/s^2") == "deg/s²"


def test_unknown_names_list_the_known():
    with pytest.raises(
        TrajevoError,
        match="unknown unit 'furlong'; known: 1, A, F, K, K/W, N, N\\*m, N\\*m\\*s/rad, N\\*m/A, N\\*m/rad, N\\*s/m, "
        "N/m, N/mm, V, W, cm",
    ):
        units.to_si("furlong")
    with pytest.raises(TrajevoError, match="unknown angle unit 'gon'; known: deg, rad"):
        units.display("rad", angle="gon")


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("azimuth [deg]", "azimuth", "deg"),
        (" azimuth(deg) ", "azimuth", "deg"),
        ("joint(1) [rad]", "joint(1)", "rad"),
        ("azimuth [°]", "azimuth", "deg"),
        ("v [mm/s²]", "v", "mm/s^2"),
        ("τ [N·m]", "τ", "N*m"),
        ("qw", "qw", ""),
    ],
)
def test_headers_hold_a_name_and_a_unit(header, name, unit):
    assert units.split_header(header, where="file.csv") == (name, unit)


@pytest.mark.parametrize(
    ("header", "meant"),
    [
        ("azimuth [furlong]", "unknown unit 'furlong'; known: "),
        ("azimuth [dge]", "unknown unit 'dge'; did you mean 'deg'"),
        ("azimuth [deg", ""),
        ("azimuth deg]", ""),
    ],
)
def test_a_unit_that_cannot_be_read_is_refused(header, meant):
    with pytest.raises(TrajevoError, match=rf"file\.csv: expected a column header with a unit.*{meant}"):
        units.split_header(header, where="file.csv")


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("150 mm/s", "m/s", 0.15),
        ("150mm/s", "m/s", 0.15),
        ("30 rpm", "rad/s", math.pi),
        ("180 °/s", "rad/s", math.pi),
        ("500 g", "kg", 0.5),
        ("2 Nm", "N*m", 2.0),
        ("inf rad/s", "rad/s", math.inf),
        ("-1e1 cm", "m", -0.1),
    ],
)
def test_quantities_are_read_with_their_unit(text, unit, value):
    assert units.quantity(text, unit, name="limit") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["150", "mm/s", "1,5 m/s", "1_0 m/s", "150 deg/s", "nan m/s", "150 mm/s/s", ""])
def test_quantities_need_a_number_and_a_unit_of_their_kind(text):
    says = r"limit: expected a number and a unit that converts to m/s, such as '1.5 m/s' or '1.5 cm/s' or '1.5 mm/s', "
    with pytest.raises(TrajevoError, match=says + f"got {text!r}"):
        units.quantity(text, "m/s", name="limit")


def test_shares_have_no_unit():
    with pytest.raises(TrajevoError, match=r"^efficiency: expected a number without a unit, got '75 %'$"):
        units.quantity("75 %", "1", name="efficiency")


@pytest.mark.parametrize(
    ("unit", "angle", "length", "shown", "factor"),
    [
        ("rad^2/s^5", "deg", "m", "deg^2/s^5", (180 / math.pi) ** 2),
        ("rad^2/s^3", "deg", "mm", "deg^2/s^3", (180 / math.pi) ** 2),
        ("m^2/s^5", "deg", "mm", "mm^2/s^5", 1e6),
        ("(rad or m)^2/s^5", "deg", "mm", "(rad or m)^2/s^5", 1.0),
        ("rad or m", "deg", "mm", "rad or m", 1.0),
        ("W^2*s", "deg", "mm", "W^2*s", 1.0),
        ("(N*m)^2*s", "deg", "mm", "(N*m)^2*s", 1.0),
    ],
)
def test_squares_and_sums_of_different_joints_are_shown_too(unit, angle, length, shown, factor):
    assert units.display(unit, angle=angle, length=length) == (shown, pytest.approx(factor))
