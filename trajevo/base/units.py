"""Units: SI throughout the library, converted only where users read or write values."""

from __future__ import annotations

import math
import re

from trajevo.errors import InvalidInputError, UnknownNameError

#: Factor that turns a value in the unit into SI, and the SI unit it becomes.
_TO_SI: dict[str, tuple[float, str]] = {
    "rad": (1.0, "rad"),
    "deg": (math.pi / 180.0, "rad"),
    "m": (1.0, "m"),
    "mm": (1e-3, "m"),
    "s": (1.0, "s"),
    "kg": (1.0, "kg"),
    "N": (1.0, "N"),
    "N*m": (1.0, "N*m"),
    "1": (1.0, "1"),
    "N*s/m": (1.0, "N*s/m"),
    "N*m*s/rad": (1.0, "N*m*s/rad"),
    "kg*m^2": (1.0, "kg*m^2"),
} | {
    f"{unit}/s{power}": (factor, f"{si}/s{power}")
    for unit, factor, si in (("rad", 1.0, "rad"), ("deg", math.pi / 180.0, "rad"), ("m", 1.0, "m"), ("mm", 1e-3, "m"))
    for power in ("", "^2", "^3")
}

ANGLE_UNITS = ("rad", "deg")
LENGTH_UNITS = ("m", "mm")


def si_unit(unit: str) -> str:
    """SI unit of a unit: ``"deg/s"`` -> ``"rad/s"``."""
    return _lookup(unit)[1]


def to_si(unit: str) -> float:
    """Factor by which a value in ``unit`` is multiplied to become SI: ``to_si("deg")`` is π/180."""
    return _lookup(unit)[0]


def known_digits(value: float, known_to: float, *, most: int = 5) -> str:
    """A number with as many digits as are known of it, 1 to ``most``.

    Args:
        value: the number.
        known_to: how far the true number may be from it, from 0 on, in the same unit.
        most: greatest number of digits.
    """
    digits = most
    if known_to > 0.0 and value != 0.0:
        digits = min(most, max(1, math.floor(math.log10(abs(value))) - math.ceil(math.log10(2.0 * known_to)) + 1))
    return f"{value:.{digits}g}"


def quantity(text: str, unit: str, *, name: str) -> float:
    """SI value of a number with its unit, such as ``"150 mm/s"``.

    Args:
        text: what was written.
        unit: the SI unit it must convert to.
        name: name of the argument, for the message.

    Raises:
        InvalidInputError: no number, no unit, or a unit that does not convert to ``unit``.
    """
    value, _, written = text.strip().partition(" ")
    try:
        number, (factor, found) = float(value), _TO_SI[written.strip()]
    except (ValueError, KeyError):
        number, factor, found = math.nan, 1.0, ""
    if math.isnan(number) or found != unit:
        raise InvalidInputError(f"{name}: expected a number and a unit that converts to {unit}, got {text!r}")
    return number * factor


def display(unit: str, *, angle: str, length: str = "m") -> tuple[str, float]:
    """Unit that is shown to users, and the factor from SI to it.

    Args:
        unit: an SI unit.
        angle: ``"rad"`` or ``"deg"``; units without an angle stay as they are.
        length: ``"m"`` or ``"mm"``; units without a length stay as they are.

    Returns:
        The unit to print and the factor to multiply SI values by.

    Raises:
        UnknownNameError: another unit of angles or lengths.
    """
    if angle not in ANGLE_UNITS:
        raise UnknownNameError("angle unit", angle, ANGLE_UNITS)
    if length not in LENGTH_UNITS:
        raise UnknownNameError("length unit", length, LENGTH_UNITS)
    if angle == "deg" and unit.startswith("rad"):
        shown = "deg" + unit.removeprefix("rad")
        return shown, 1.0 / to_si(shown)
    if length == "mm" and re.match(r"m(\^2)?($|/)", unit):
        return "m" + unit, 1e6 if unit.startswith("m^2") else 1e3
    return unit, 1.0


def per_time(unit: str, power: int) -> str:
    """Unit of the ``power``-th time derivative: ``per_time("rad", 2)`` is ``"rad/s^2"``."""
    return unit if power == 0 else f"{unit}/s" if power == 1 else f"{unit}/s^{power}"


def pretty(unit: str) -> str:
    """Unit as it is printed for users: ``"deg/s^2"`` -> ``"deg/s²"``."""
    return re.sub(r"\^(\d)", lambda power: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(power[1])], unit).replace("*", "·")


def split_header(header: str, *, where: str) -> tuple[str, str]:
    """Split a column header ``"azimuth [deg]"`` into name and unit.

    Raises:
        InvalidInputError: there is no unit in brackets, or the unit is unknown.
    """
    name, bracket, rest = header.strip().partition("[")
    unit = rest.rstrip().removesuffix("]").strip()
    if not bracket or not rest.rstrip().endswith("]") or unit not in _TO_SI:
        raise InvalidInputError(
            f"{where}: expected a column header with a unit such as 'azimuth [deg]' or 'azimuth [rad]', "
            f"got {header.strip()!r}"
        )
    return name.strip(), unit


def _lookup(unit: str) -> tuple[float, str]:
    try:
        return _TO_SI[unit]
    except KeyError:
        raise UnknownNameError("unit", unit, _TO_SI) from None
