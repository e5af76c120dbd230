"""What is carried from which point to which: loads that are picked up and put down, and their payloads together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from trajevo.base.shown.brief import brief
from trajevo.errors import InvalidInputError, known_names
from trajevo.robot.payload import Payload

#: Share of an inertia that is added to every principal moment.
_ROUNDING = 1e-15

#: Keys of a load that say where it is carried, and its attributes; ``from`` is no name in Python.
_PLACES = {"from": "from_point", "to": "to_point"}

#: Other keys of a load.
_OTHERS = ("vary", "shape", "touches")

#: Keys of a load that are those of a payload.
_OF_PAYLOAD = ("mass", "com", "inertia", "model")


@final
@dataclass(frozen=True)
class Load:
    """A payload that is carried from one point to another, or a gripper that always is.

    It is there from the moment at which the motion leaves ``from_point`` until it reaches ``to_point``: a dwell at the
    former is over before, and one at the latter begins without it. Where neither is given it is carried all the time.

    Attributes:
        payload: what is carried, a :class:`~trajevo.robot.payload.Payload`, its settings, or its mass [kg].
        from_point: number of the point at which it is picked up, counted from 0; None for the first.
        to_point: number of the point at which it is put down; None for the last.
        vary: whether capacities, and the mass as a variable, mean this load; None to leave that open. Without any
            ``vary`` they mean the only load with ``from_point`` or ``to_point``, or else the only load.
        shape: its solid in the tool frame, which keeps the clearance of a scene while it is carried: a solid of
            :mod:`trajevo.formulation.constraints.scene`, or its settings; None for none.
        touches: names of obstacles from which this solid need not stay away, such as a table on which it stands.

    Raises:
        InvalidInputError: something else.
    """

    payload: Payload
    from_point: int | None = None
    to_point: int | None = None
    vary: bool | None = None
    shape: Any = None
    touches: tuple[str, ...] = ()

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "payload", Payload.of(self.payload, model=None))
        for key, name in _PLACES.items():
            point = getattr(self, name)
            whole = isinstance(point, int | np.integer) and not isinstance(point, bool)
            if point is not None and not (whole and point >= 0):
                raise InvalidInputError(f"payload.{key}: expected the number of a point, from 0, got {point!r}")
            object.__setattr__(self, name, None if point is None else int(point))
        if not isinstance(self.vary, bool | None):
            raise InvalidInputError(f"payload.vary: expected true or false, got {self.vary!r}")
        listed = isinstance(self.touches, list | tuple) and all(isinstance(name, str) for name in self.touches)
        if not listed:
            raise InvalidInputError(f"payload.touches: expected a list of names of obstacles, got {self.touches!r}")
        object.__setattr__(self, "touches", tuple(self.touches))

    @property
    def switched(self) -> bool:
        """Whether it is picked up or put down on the way."""
        return self.from_point is not None or self.to_point is not None

    @property
    def settings(self) -> dict[str, Any]:
        """Plain data from which an equal load can be made."""
        told = {"from": self.from_point, "to": self.to_point, "vary": self.vary, "touches": list(self.touches) or None}
        told["shape"] = getattr(self.shape, "settings", self.shape)
        return self.payload.settings | {key: value for key, value in told.items() if value is not None}

    def __str__(self) -> str:
        if not self.switched:
            return f"{self.payload.mass:g} kg all the time"
        first = "the first point" if self.from_point is None else f"point {self.from_point}"
        last = "the last" if self.to_point is None else f"point {self.to_point}"
        return f"{self.payload.mass:g} kg from {first} to {last}"


@final
@dataclass(frozen=True)
class Schedule:
    """What is carried on every segment of a motion.

    Attributes:
        loads: all loads.
        carried: for every segment, the numbers of the loads that are carried on it, ascending.
        varied: number of the load that capacities mean, and whose mass may be a variable; None if it is open which.
    """

    loads: tuple[Load, ...]
    carried: tuple[tuple[int, ...], ...]
    varied: int | None

    __repr__ = brief

    @property
    def phases(self) -> tuple[tuple[int, ...], ...]:
        """Different loads that are carried together, each once, in the order of their first segments."""
        return tuple(dict.fromkeys(self.carried))

    @property
    def phase_of_segment(self) -> tuple[int, ...]:
        """For every segment, the number of its phase."""
        number = {phase: k for k, phase in enumerate(self.phases)}
        return tuple(number[carried] for carried in self.carried)

    def segments_of(self, load: int) -> tuple[int, ...] | None:
        """The segments on which a load is carried, one after another in the order of time; None for all.

        In a cyclic motion they may go on at its beginning.
        """
        on = [load in carried for carried in self.carried]
        if all(on):
            return None
        first = on.index(False) + 1 if on[0] and on[-1] else 0
        return tuple(k % len(on) for k in range(first, first + len(on)) if on[k % len(on)])

    def varies(self, phase: tuple[int, ...]) -> bool:
        """Whether the load that capacities mean is carried in a phase."""
        return self.varied is not None and self.varied in phase

    def fixed(self, phase: tuple[int, ...]) -> Payload | None:
        """What is carried in a phase besides the load that capacities mean, as one payload; None for nothing."""
        others = [self.loads[k].payload for k in phase if k != self.varied and self.loads[k].payload.mass > 0.0]
        return together(others) if others else None

    def everything(self, phase: tuple[int, ...], payload: Payload) -> Payload:
        """All that is carried in a phase as one payload, with a given one for the load that capacities mean."""
        return together([payload if k == self.varied else self.loads[k].payload for k in phase])

    def only(self, phase: tuple[int, ...]) -> Schedule:
        """The loads of one phase on a single segment."""
        return Schedule(self.loads, (phase,), self.varied)

    def settings_with(self, payload: Payload) -> list[dict[str, Any]]:
        """Settings of the loads with another payload for the load that capacities mean."""
        loads = (replace(one, payload=payload) if k == self.varied else one for k, one in enumerate(self.loads))
        return [one.settings for one in loads]

    def check_varied(self, wanted: str) -> None:
        """Refuse what asks about one load where it is open which.

        Raises:
            InvalidInputError: it is open.
        """
        if self.varied is None:
            raise InvalidInputError(
                f"payload: {wanted} asks about one load, and there are {len(self.loads)}: {self}; say which by "
                "vary = true"
            )

    def __str__(self) -> str:
        return ", ".join(map(str, self.loads))


def together(payloads: Sequence[Payload]) -> Payload:
    """One rigid payload that moves as several rigid ones do that are fixed to the same tool."""
    if len(payloads) == 1:
        return payloads[0]
    if not payloads:
        return Payload(0.0)
    masses = np.array([one.mass for one in payloads])
    total = float(masses.sum())
    centres = np.array([one.com for one in payloads])
    com = masses @ centres / total if total > 0.0 else np.zeros(3)
    inertia = np.zeros((3, 3))
    for one, arm in zip(payloads, centres - com, strict=True):
        own = np.zeros((3, 3)) if one.inertia is None else np.array(one.inertia)
        inertia += own + one.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    if not inertia.any():
        return Payload(total, tuple(com.tolist()))
    # Point masses in a row have no inertia about it, which rounding must not make negative.
    inertia = 0.5 * (inertia + inertia.T) + _ROUNDING * np.trace(inertia) * np.eye(3)
    return Payload(total, tuple(com.tolist()), tuple(map(tuple, inertia.tolist())))


def loads_of(given: Any, count: int, *, cyclic: bool = False) -> tuple[Load, ...]:
    """Loads, from a list of any forms in which a user may give them.

    Args:
        given: a list of :class:`Load`, or of mappings with the keys of a payload and ``from``, ``to`` and ``vary``.
        count: number of points.
        cyclic: whether the motion is a cycle, on which a load may be carried across the seam.

    Raises:
        InvalidInputError: something else, a point that does not exist, a load that is put down where it is picked up
            or before, a cycle that does not say where it is put down, several loads of which one is not rigid, or
            ``vary`` for more than one.
    """
    if not given:
        raise InvalidInputError("payload: expected at least one load in the list, got none; give 0.0 for no payload")
    loads = tuple(_load(place, one) for place, one in enumerate(given))
    for place, one in enumerate(loads):
        _check_points(place, one, count, cyclic)
        if len(loads) > 1 and one.payload.model != "rigid":
            raise InvalidInputError(
                f"payload.{place}.model: expected 'rigid', as there are several loads, got {one.payload.model!r}"
            )
    varying = [place for place, one in enumerate(loads) if one.vary]
    if len(varying) > 1:
        raise InvalidInputError(
            f"payload.{varying[1]}.vary: expected one load whose mass is asked for, got payload.{varying[0]} too"
        )
    return loads


def is_loads(given: Any) -> bool:
    """Whether what a user gives as payload is loads: a list, one load, or a table with keys that only loads have."""
    if isinstance(given, Mapping):
        return not {*_PLACES, *_OTHERS}.isdisjoint(given)
    return isinstance(given, list | tuple | Load)


def varied_of(loads: Sequence[Load]) -> int | None:
    """Number of the load that capacities mean; None if it is open which."""
    asked = [k for k, one in enumerate(loads) if one.vary]
    possible = [k for k, one in enumerate(loads) if one.vary is not False]
    switched = [k for k in possible if loads[k].switched]
    for found in (asked, switched, possible):
        if len(found) == 1:
            return found[0]
        if found:
            break
    return None


def told_loads(settings: Sequence[Any], masses: tuple[float, float] | None = None) -> str:
    """Text for loads that are given by their settings.

    Args:
        settings: settings of the loads.
        masses: least and greatest mass of the load that capacities mean, if it is a variable [kg].

    Raises:
        InvalidInputError: they are settings of no loads.
    """
    loads = [_load(place, one) for place, one in enumerate(settings)]
    varied = varied_of(loads)
    told = list(map(str, loads))
    if masses is not None and varied is not None:
        told[varied] = told[varied].replace(f"{loads[varied].payload.mass:g}", f"{masses[0]:g} to {masses[1]:g}", 1)
    return ", ".join(told)


def _load(place: int, given: Any) -> Load:
    where = f"payload.{place}"
    try:
        if isinstance(given, Load):
            return given
        if not isinstance(given, Mapping):
            return Load(given)
        known = [*_OF_PAYLOAD, *_PLACES, *_OTHERS]
        for key in given:
            if key not in known:
                raise InvalidInputError(f"payload: unknown key {key!r}; {known_names(str(key), known)}")
        if "mass" not in given:
            raise InvalidInputError("payload.mass: expected a mass [kg], got none")
        payload = Payload.of({key: given[key] for key in _OF_PAYLOAD if key in given}, model=None)
        others = {key: given[key] for key in _OTHERS if key in given}
        return Load(payload, given.get("from"), given.get("to"), **others)
    except InvalidInputError as error:
        raise InvalidInputError(str(error).replace("payload", where, 1)) from error


def _check_points(place: int, one: Load, count: int, cyclic: bool) -> None:
    where, last = f"payload.{place}", count - 1
    for key, name in _PLACES.items():
        point = getattr(one, name)
        if point is not None and point > last:
            raise InvalidInputError(f"{where}.{key}: expected the number of a point, 0 to {last}, got {point}")
    first, end = one.from_point or 0, last if one.to_point is None else one.to_point
    if cyclic and one.switched and (one.from_point is None or one.to_point is None):
        key = "from" if one.from_point is None else "to"
        raise InvalidInputError(
            f"{where}.{key}: expected the number of a point, as a cyclic motion goes on at its end, where a load does "
            "not vanish"
        )
    if cyclic and one.switched and first % last == end % last:
        raise InvalidInputError(
            f"{where}.to: expected another point of the cycle than {first}, where the load is picked up, got {end}; "
            "what is always carried needs neither from nor to"
        )
    if first >= end and not cyclic:
        raise InvalidInputError(
            f"{where}.to: expected a later point than {first}, where the load is picked up, got {end}: it would never "
            "be carried"
        )
