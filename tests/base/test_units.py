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
    with pytest.raises(TrajevoError, match="unknown unit 'furlong'; known: 1, N, N\\*m, N\\*m\\*s/rad, N\\*s/m, deg"):
        units.to_si("furlong")
    with pytest.raises(TrajevoError, match="unknown angle unit 'gon'; known: deg, rad"):
        units.display("rad", angle="gon")


@pytest.mark.parametrize("header", ["azimuth", "azimuth deg", "azimuth [furlong]", ""])
def test_headers_need_a_unit(header):
    with pytest.raises(TrajevoError, match=r"file\.csv: expected a column header with a unit"):
        units.split_header(header, where="file.csv")
