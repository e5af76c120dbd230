"""Units: SI throughout the library, converted only where users read or write values."""

from __future__ import annotations

import math
import re

from trajevo.errors import InvalidInputError, UnknownNameError, known_names

#: Factor that turns a value in the unit into SI, and the SI unit it becomes.
_TO_SI: dict[str, tuple[float, str]] = {
    "rad": (1.0, "rad"),
    "deg": (math.pi / 180.0, "rad"),
    "m": (1.0, "m"),
    "mm": (1e-3, "m"),
    "cm": (1e-2, "m"),
    "s": (1.0, "s"),
    "ms": (1e-3, "s"),
    "kg": (1.0, "kg"),
    "g": (1e-3, "kg"),
    "rpm": (math.pi / 30.0, "rad/s"),
    "N": (1.0, "N"),
    "N*m": (1.0, "N*m"),
    "1": (1.0, "1"),
    "N*s/m": (1.0, "N*s/m"),
    "N*m*s/rad": (1.0, "N*m*s/rad"),
    "N/m": (1.0, "N/m"),
    "N/mm": (1e3, "N/m"),
    "N*m/rad": (1.0, "N*m/rad"),
    "kg*m^2": (1.0, "kg*m^2"),
    "kg*cm^2": (1e-4, "kg*m^2"),
    "g*cm^2": (1e-7, "kg*m^2"),
    "A": (1.0, "A"),
    "V": (1.0, "V"),
    "W": (1.0, "W"),
    "kW": (1e3, "W"),
    "F": (1.0, "F"),
    "uF": (1e-6, "F"),
    "N*m/A": (1.0, "N*m/A"),
    "ohm": (1.0, "ohm"),
    "K": (1.0, "K"),
    "K/W": (1.0, "K/W"),
} | {
    f"{unit}/s{power}": (factor, f"{si}/s{power}")
    for unit, factor, si in (
        ("rad", 1.0, "rad"),
        ("deg", math.pi / 180.0, "rad"),
        ("m", 1.0, "m"),
        ("mm", 1e-3, "m"),
        ("cm", 1e-2, "m"),
    )
    for power in ("", "^2", "^3")
}

#: Other ways to write units, among them those in which units are printed.
_WRITTEN = {"°": "deg", "²": "^2", "³": "^3", "·": "*", "**": "^", "degrees": "deg", "degree": "deg", "radians": "rad"}
_WHOLE = {"µF": "uF", "Nm": "N*m", "N m": "N*m", "min^-1": "rpm", "rev/min": "rpm"}

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


_QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf)\s*(.*)")


def quantity(text: str, unit: str, *, name: str) -> float:
    """SI value of a number with its unit, such as ``"150 mm/s"``.

    Args:
        text: what was written.
        unit: the SI unit it must convert to.
        name: name of the argument, for the message.

    Raises:
        InvalidInputError: no number, no unit, or a unit that does not convert to ``unit``.
    """
    match = _QUANTITY.fullmatch(text.strip())
    factor, found = _TO_SI.get(_canonical(match[2]) if match else "", (1.0, ""))
    if unit == "1" and (not match or found != unit):
        raise InvalidInputError(f"{name}: expected a number without a unit, got {text!r}")
    if not match or found != unit:
        raise InvalidInputError(
            f"{name}: expected a number and a unit that converts to {unit}, such as "
            f"{' or '.join(repr(f'1.5 {one}') for one in units_of(unit))}, got {text!r}"
        )
    return float(match[1]) * factor


def units_of(si: str) -> list[str]:
    """The units that convert to an SI unit, that one first."""
    return sorted((unit for unit, (_, found) in _TO_SI.items() if found == si), key=lambda unit: (unit != si, unit))


#: SI unit -> the greatest number without a unit that is believed, and the unit that a greater one is likely to have.
#: Slow joints in deg/s and small payloads in grams stay below, but nothing that is built needs the greater numbers.
_BELIEVED = {
    "rad": (8.0 * math.pi, "deg"),
    "m": (100.0, "mm"),
    "rad/s": (30.0, "deg/s"),
    "m/s": (20.0, "mm/s"),
    "kg": (1000.0, "g"),
}


def believed(value: float, unit: str, *, name: str, most: float | None = None) -> float:
    """A number that was given without its unit, if it can be in SI.

    Args:
        value: the number; infinity is believed.
        unit: the SI unit that it is taken for.
        name: name of the argument, for the message.
        most: greatest number that is believed, if it is another than usual.

    Raises:
        InvalidInputError: it is so great that it must be in another unit; the message names that one, and how to give
            the number if it is meant: as text with its unit.
    """
    likely = likely_unit(value, unit, most=most)
    if not likely:
        return value
    meant = f'write "{value:g} {likely}", or "{value:g} {unit}" if it is meant'
    raise InvalidInputError(f"{name}: {value:g} {unit} looks like {likely}: {meant}")


def with_unit(value: float, unit: str, *, most: float | None = None) -> float | str:
    """A number as :func:`believed` takes it: with its unit where it would not be believed without."""
    return f"{value!r} {unit}" if likely_unit(value, unit, most=most) else value


def likely_unit(value: float, unit: str, *, most: float | None = None) -> str:
    """The unit that a number is likely to be in if it is too great to be in SI, else ``""``.

    Args:
        value: the number; infinity and NaN are taken for what they are.
        unit: the SI unit that it is taken for.
        most: greatest number that is believed, if it is another than usual.
    """
    usual, likely = _BELIEVED.get(unit, (math.inf, ""))
    return likely if (usual if most is None else most) < abs(value) < math.inf else ""


def if_degrees(angle: float) -> str:
    """What a message about an angle [rad] that cannot be right adds: that it looks like degrees, if it does.

    Args:
        angle: the angle as it was taken [rad].
    """
    if not 2.0 * math.pi < abs(angle) <= 720.0:
        return ""
    return (
        ', which looks like degrees: say so by angle = "deg" in a task, by [deg] in the header of a file, or convert '
        "them by np.radians in Python"
    )


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
    angular = re.match(r"rad(?:\^(\d))?(?:$|[/*])", unit)
    if angle == "deg" and angular:
        return "deg" + unit.removeprefix("rad"), (1.0 / to_si("deg")) ** int(angular[1] or 1)
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
    """Split a column header ``"azimuth [deg]"`` or ``"azimuth (deg)"`` into name and unit, ``""`` if it has none.

    Raises:
        InvalidInputError: a bracket is not closed, or the unit is unknown.
    """
    match = re.fullmatch(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))?", header.strip(), re.DOTALL)
    name, *written = match.groups() if match else (header, None, None)
    unit = next((one for one in written if one is not None), None)
    if (unit is None and re.search(r"[\[\]()]", name)) or (unit is not None and _canonical(unit) not in _TO_SI):
        meant = f"; unknown unit {unit.strip()!r}; {known_names(unit.strip(), _TO_SI)}" if unit else ""
        raise InvalidInputError(
            f"{where}: expected a column header with a unit such as '{_bare(name)} [deg]' or '{_bare(name)} [mm]', "
            f"got {header.strip()!r}{meant}"
        )
    return name, "" if unit is None else _canonical(unit)


def _bare(name: str) -> str:
    return re.split(r"[\[\]()]", name)[0].strip() or "azimuth"


def _canonical(unit: str) -> str:
    """A unit as it is written here: ``"°/s²"`` -> ``"deg/s^2"``."""
    for written, meant in _WRITTEN.items():
        unit = unit.replace(written, meant)
    return _WHOLE.get(unit.strip(), unit.strip())


def _lookup(unit: str) -> tuple[float, str]:
    try:
        return _TO_SI[_canonical(unit)]
    except KeyError:
        raise UnknownNameError("unit", unit, _TO_SI) from None
