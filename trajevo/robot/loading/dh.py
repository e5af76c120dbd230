"""Denavit-Hartenberg tables, checked, and the chains that they describe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trajevo.base.arrays import Array, numbers, real_number
from trajevo.base.shown.brief import brief
from trajevo.base.units import believed, quantity, with_unit
from trajevo.errors import InvalidInputError, UnknownNameError, checked_name
from trajevo.robot.loading.chain import DhStep, Pose6, Segment, chain_urdf

CONVENTIONS = ("standard", "modified")
KINDS = ("revolute", "prismatic")

#: Keys of a row with their units; that of the joint's own coordinate may be left out, where it is 0.
_KEYS = {"a": "m", "alpha": "rad", "d": "m", "theta": "rad"}
_OWN = {"revolute": "theta", "prismatic": "d"}

#: Greatest number that is believed without its unit, where it is another than usual: angles of rows turn once.
_MOST = {"rad": 2.0 * np.pi}


@dataclass(frozen=True, eq=False)
class DhTable:
    """A checked table of n rows.

    Attributes:
        convention: ``"standard"``, row i is Rz(θ) Tz(d) Tx(a) Rx(α), or ``"modified"``, Rx(α) Tx(a) Rz(θ) Tz(d).
        kinds: ``"revolute"`` or ``"prismatic"`` per row.
        rows: θ, d, a and α of every row at position 0 of its joint [rad, m].
        masses: shape (n,) [kg].
        coms: centres of mass, each in the frame of its row, shape (n, 3) [m].
        inertias: about the centres of mass, along the axes of these frames, shape (n, 3, 3) [kg·m²].
        names: names of the joints.
        tool: pose of the tool in the last frame.
    """

    convention: str
    kinds: tuple[str, ...]
    rows: tuple[DhStep, ...]
    masses: Array
    coms: Array
    inertias: Array
    names: tuple[str, ...]
    tool: Pose6

    __repr__ = brief

    @classmethod
    def of(
        cls,
        rows: Any,
        *,
        convention: Any,
        masses: Any = None,
        coms: Any = None,
        inertias: Any = None,
        names: Any = None,
        tool: Any = None,
    ) -> DhTable:
        """The table of :meth:`trajevo.robot.robot.Robot.from_dh`, which says what the arguments are.

        Raises:
            InvalidInputError: an argument, or an entry of a row, that is missing or cannot be used.
            UnknownNameError: no such convention, key of a row or kind of joint.
        """
        checked_name("convention", convention, CONVENTIONS)
        if not isinstance(rows, list | tuple) or not rows:
            raise InvalidInputError(f"dh.rows: expected a list of at least one row, got {rows!r}")
        kinds, steps = zip(*(_row(row, f"dh.rows[{number}]") for number, row in enumerate(rows)), strict=True)
        count = len(rows)
        return cls(
            convention=convention,
            kinds=kinds,
            rows=steps,
            **_masses(masses, coms, inertias, count),
            names=joint_names(names, count),
            tool=_pose(tool),
        )

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments of :meth:`of` that make an equal table, plain data."""
        rows = [
            {"joint": kind, **{key: _told(value, _KEYS[key]) for key, value in row._asdict().items()}}
            for kind, row in zip(self.kinds, self.rows, strict=True)
        ]
        return {
            "rows": rows,
            "convention": self.convention,
            "masses": [_told(mass, "kg") for mass in self.masses.tolist()],
            "coms": self.coms.tolist(),
            "inertias": self.inertias.tolist(),
            "names": list(self.names),
            "tool": {"position": self.tool.position.tolist(), "rpy": self.tool.rpy.tolist()},
        }

    def urdf(self, name: str) -> str:
        """The table as URDF text, with links ``base``, ``link_1`` and so on, ``flange`` (the last frame) and ``tool``.

        Raises:
            InvalidInputError: names that are not unique, or a mass or an inertia that no body has.
        """
        standard, first = self.convention == "standard", self.rows[0]
        ends = [row if standard else row._replace(a=0.0, alpha=0.0) for row in self.rows]
        befores = (
            [DhStep(), *self.rows[:-1]]
            if standard
            else [
                DhStep(a=first.a, alpha=first.alpha),
                *(
                    one._replace(a=next_.a, alpha=next_.alpha)
                    for one, next_ in zip(self.rows, self.rows[1:], strict=False)
                ),
            ]
        )
        segments = [
            Segment(*facts)
            for facts in zip(
                self.names, self.kinds, befores, ends, self.masses.tolist(), self.coms, self.inertias, strict=True
            )
        ]
        return chain_urdf(name, segments, ends[-1], self.tool)


def joint_names(given: Any, count: int) -> tuple[str, ...]:
    """Names of joints, ``joint_1`` and so on if there are none.

    Raises:
        InvalidInputError: not a list of that many texts.
    """
    if given is None:
        return tuple(f"joint_{number}" for number in range(1, count + 1))
    listed = isinstance(given, list | tuple) and all(isinstance(name, str) for name in given)
    if not listed or len(given) != count:
        raise InvalidInputError(f"names: expected {count} names of joints, one for each, got {given!r}")
    return tuple(given)


def planar_rows(lengths: Any, coms: Any, inertias: Any) -> tuple[list[dict[str, Any]], Any, Any]:
    """Rows, centres of mass and inertias of links in a plane, for a standard table.

    Raises:
        InvalidInputError: not the same number of finite numbers each, or a length that is negative.
    """
    far = numbers(lengths, name="lengths", shape=("n",))
    if not len(far) or (far < 0.0).any():
        raise InvalidInputError(f"lengths: expected numbers from 0 on [m], one for each link, got {far.tolist()}")
    centre = numbers(coms, name="coms", shape=(len(far),))
    moment = numbers(inertias, name="inertias", shape=(len(far),))
    rows = [{"a": length, "alpha": 0.0, "d": 0.0} for length in far.tolist()]
    # The frame of a row is at the far end of its link.
    places = np.stack([centre - far, np.zeros_like(far), np.zeros_like(far)], axis=1)
    return rows, places, moment[:, None, None] * np.diag([0.5, 0.5, 1.0])


def _row(row: Any, where: str) -> tuple[str, DhStep]:
    """Kind of the joint of a row, and its four numbers."""
    if not isinstance(row, Mapping):
        raise InvalidInputError(
            f"{where}: expected a mapping with a, alpha, d and theta, as books differ in their order, got {row!r}"
        )
    for key in row:
        if key not in ("joint", *_KEYS):
            raise UnknownNameError(f"key of {where}", key, ("joint", *_KEYS))
    kind = row.get("joint", "revolute")
    checked_name(f"kind of joint in {where}", kind, KINDS)
    found = {}
    for key, unit in _KEYS.items():
        if row.get(key) is None and key != _OWN[kind]:
            raise InvalidInputError(f"{where}: expected {key} [{unit}] of a {kind} joint, got none")
        found[key] = real_quantity(row[key], unit, f"{where}.{key}") if row.get(key) is not None else 0.0
    return kind, DhStep(**found)


def real_quantity(value: Any, unit: str, name: str) -> float:
    """A finite number in an SI unit, given as a number or as text with a unit.

    Raises:
        InvalidInputError: anything else, or a number that nothing would be built for.
    """
    if isinstance(value, str):
        found = quantity(value, unit, name=name)
    else:
        number = real_number(value)
        if number is None:
            raise InvalidInputError(f"{name}: expected a number [{unit}], or text with a unit, got {value!r}")
        found = believed(number, unit, name=name, most=_MOST.get(unit))
    if not np.isfinite(found):
        raise InvalidInputError(f"{name}: expected a finite number [{unit}], got {found:g}")
    return found


def _told(value: float, unit: str) -> float | str:
    return with_unit(value, unit, most=_MOST.get(unit))


def _masses(masses: Any, coms: Any, inertias: Any, count: int) -> dict[str, Array]:
    """Masses, centres of mass and inertias of all rows; zeros without masses."""
    if masses is None:
        for name, given in (("coms", coms), ("inertias", inertias)):
            if given is not None:
                raise InvalidInputError(f"{name}: expected masses with them, got none")
        return {"masses": np.zeros(count), "coms": np.zeros((count, 3)), "inertias": np.zeros((count, 3, 3))}
    if coms is None:
        raise InvalidInputError("coms: expected the centres of the masses, one for each row, got none")
    weights = masses.tolist() if isinstance(masses, np.ndarray) else masses
    if not isinstance(weights, list | tuple) or len(weights) != count:
        raise InvalidInputError(f"masses: expected {count} numbers [kg], one for each row, got {masses!r}")
    found = {
        "masses": np.array([real_quantity(mass, "kg", f"masses[{k}]") for k, mass in enumerate(weights)]),
        "coms": numbers(coms, name="coms", shape=(count, 3)),
        "inertias": np.zeros((count, 3, 3)),
    }
    if inertias is not None:
        found["inertias"] = np.array(
            [tensor_of(one, f"inertias[{k}]") for k, one in enumerate(_listed(inertias, count))]
        )
    return found


def _listed(inertias: Any, count: int) -> Sequence[Any]:
    if not isinstance(inertias, list | tuple | np.ndarray) or len(inertias) != count:
        raise InvalidInputError(f"inertias: expected {count} tensors, one for each row, got {inertias!r}")
    return list(inertias)


def tensor_of(given: Any, name: str) -> Array:
    """A tensor (3, 3) from itself or from its diagonal (3,)."""
    flat = np.ndim(given) == 1
    tensor = numbers(given, name=name, shape=(3,) if flat else (3, 3))
    if flat:
        return np.diag(tensor)
    if not np.allclose(tensor, tensor.T, rtol=1e-9, atol=0.0):
        raise InvalidInputError(f"{name}: expected a symmetric tensor, got {tensor.tolist()}")
    return tensor


def _pose(given: Any) -> Pose6:
    """Pose of the tool from a mapping with ``position`` and ``rpy``; that of the last frame if there is none."""
    if not isinstance(given, Mapping | None):
        raise InvalidInputError(f"tool: expected a mapping with position and rpy, got {given!r}")
    pose = given or {}
    for key in pose:
        if key not in ("position", "rpy"):
            raise UnknownNameError("key of tool", key, ("position", "rpy"))
    position, rpy = (
        numbers(pose[key] if pose.get(key) is not None else np.zeros(3), name=f"tool.{key}", shape=(3,))
        for key in ("position", "rpy")
    )
    return Pose6(position, rpy)
