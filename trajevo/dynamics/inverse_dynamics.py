"""Inverse dynamics of a robot with a payload and friction, for whole populations at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar, final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rnea import HeldLoad, inverse_dynamics, stepped_dynamics
from trajevo.errors import InvalidInputError
from trajevo.path.loads import Schedule
from trajevo.robot.joints import Friction
from trajevo.robot.payload import (
    Payload,
    carrying,
    kilogram,
    on_slides,
    probe,
    tool_regressor,
    under_gravity,
)
from trajevo.robot.robot import Robot

NO_PAYLOAD = Payload(0.0)

#: Positions, velocities and accelerations, and what is computed of them.
_States = tuple[Array, Array, Array]
_Quantity = Callable[..., Array]
_Made = TypeVar("_Made")

#: Greatest number of threads.
_MOST_THREADS = 1_000

#: Most instants per segment; more take more memory than there is.
_MOST_SAMPLES = 1_000_000

#: End of the names of models whose base slides, so that each row of states has its own gravity.
_ON_SLIDES = ", on slides"

#: A joint is at rest below this share of its greatest speed plus its greatest position over the duration.
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class Dynamics:
    """Effort of a robot that carries a payload, for any number of motions in one call.

    Attributes:
        robot: the robot; it is not changed.
        payload: what it carries; with a mass of 0, nothing.
        samples: instants per segment at which effort is computed, both ends included (Gauss-Lobatto nodes).
        threads: number of threads for large populations; results do not depend on it. A forked process uses one.
        schedule: what is carried on every segment of the motions, where that changes or is more than one load; then
            ``payload`` is the load that capacities mean, and efforts need the segments of the states. None if the
            payload is always carried.
        gravity: gravity of each of B motions in the frame of its base, shape (B, 3) [m/s²], where bases tilt; states
            then have a row for each of them. None for that of the robot.

    Raises:
        InvalidInputError: fewer than 2 samples or fewer than 1 thread, or a payload of a robot without a body.
    """

    robot: Robot
    payload: Payload = NO_PAYLOAD
    samples: int = field(default=6, kw_only=True)
    threads: int = field(default=1, kw_only=True)
    schedule: Schedule | None = field(default=None, kw_only=True)
    gravity: Array | None = field(default=None, kw_only=True)
    _pools: dict[tuple[str, bool, bool], Any] = field(default_factory=dict, init=False, repr=False)
    _models: dict[str, Any] = field(default_factory=dict, init=False, repr=False)
    _level: Dynamics | None = field(default=None, init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        for name, least, most in (("samples", 2, _MOST_SAMPLES), ("threads", 1, _MOST_THREADS)):
            value = getattr(self, name)
            if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
                raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
            if value > most:
                raise InvalidInputError(f"{name}: expected a whole number of at most {most}, got {value!r}")
            object.__setattr__(self, name, int(value))
        if self.loaded:
            self.robot.check_body("a payload")

    def __getstate__(self) -> dict[str, Any]:
        # A ModelPool cannot be pickled; made again when needed.
        again: dict[str, Any] = {"_pools": {}, "_models": {}, "_level": None}
        return {key: value for key, value in self.__dict__.items() if key != "without_dry_friction"} | again

    def sampled(self, samples: int) -> Dynamics:
        """The same with another number of samples per segment, sharing the models already made."""
        return self._sharing(replace(self, samples=samples), self._level)

    def under(self, gravity: Array | None) -> Dynamics:
        """The same under a gravity for each row of states, sharing the models already made.

        Args:
            gravity: in the frame of the base, shape (B, 3) [m/s²]; None for that of the robot.
        """
        if gravity is None:
            return self
        return self._sharing(replace(self, gravity=gravity), self if self._level is None else self._level)

    def of_rows(self, rows: Any) -> Dynamics:
        """The same for states of some motions, by a slice or numbers of motions for each row of states."""
        return self if self.gravity is None else self.under(self.gravity[rows])

    @property
    def of_real_parts(self) -> Dynamics:
        """The same for the real parts of states, where complex ones carry the steps of derivatives."""
        return self.under(None if self.gravity is None else self.gravity.real)

    @property
    def of_one_base(self) -> Dynamics:
        """The same for a robot that has the gravity of the one motion, if :attr:`gravity` is that of one."""
        if self.gravity is None or len(self.gravity) != 1 or np.iscomplexobj(self.gravity):
            return self
        return replace(self, robot=under_gravity(self.robot, self.gravity[0]), gravity=None)

    def _sharing(self, other: Dynamics, level: Dynamics | None) -> Dynamics:
        """Other dynamics of the same models, which are made once for both."""
        for name, value in (("_models", self._models), ("_pools", self._pools), ("_level", level)):
            object.__setattr__(other, name, value)
        return other

    @cached_property
    def without_dry_friction(self) -> Dynamics:
        """The same for a robot without dry friction, made once: its efforts are smooth in time."""
        if self._level is not None:
            return self._level.without_dry_friction.under(self.gravity)
        none = np.zeros(self.robot.dof)
        friction = replace(self.robot.friction, coulomb=none, coulomb_backward=none)
        return replace(self, robot=replace(self.robot, friction=friction))

    def once(self, name: str, make: Callable[[], _Made]) -> _Made:
        """What is made of these dynamics and kept with them under a name, which no other thing has."""
        if name not in self._models:
            self._models[name] = make()
        found: _Made = self._models[name]
        return found

    @property
    def loaded(self) -> bool:
        """Whether something with mass is carried somewhere."""
        others = () if self.schedule is None else self.schedule.loads
        return self.payload.mass > 0.0 or any(one.payload.mass > 0.0 for one in others)

    @property
    def carried(self) -> Any:
        """What is carried as plain data: settings of the payload, or of all loads."""
        return self.payload.settings if self.schedule is None else self.schedule.settings_with(self.payload)

    def of_phase(self, phase: tuple[int, ...]) -> Dynamics:
        """The dynamics while the loads of a phase of :attr:`schedule` are carried, with a payload that is always there.

        What is carried besides the load that capacities mean is a part of the robot.
        """
        name = f"phase {phase}"
        if self.schedule is not None and name not in self._models:
            fixed, robot = self.schedule.fixed(phase), self.robot
            if fixed is not None:
                robot.check_masses("effort")  # a load would hide a link that has none
            heavier = robot if fixed is None else replace(robot, model=carrying(robot, fixed))
            payload = self.payload if self.schedule.varies(phase) else NO_PAYLOAD
            self._models[name] = replace(self, robot=heavier, payload=payload, schedule=None, gravity=None)
        found: Dynamics = self if self.schedule is None else self._models[name]
        return found.under(self.gravity)

    def effort(self, q: Array, v: Array, a: Array, segments: Array | None = None, *, axis: int = 0) -> Array:
        """Actuator effort with the payload, shapes (..., n_joints) [N·m or N].

        Args:
            q: positions, shape (..., n_joints) [rad or m].
            v: velocities, the same shape [rad/s or m/s].
            a: accelerations, the same shape [rad/s² or m/s²].
            segments: numbers of the segments in which the states lie, one for each place along an axis; needed with a
                :attr:`schedule` alone.
            axis: the axis.
        """
        if self.schedule is not None:
            return self._by_phase(lambda part, *states: part.effort(*states), (q, v, a), segments, axis)
        if self.payload.mass == 0.0:
            return self.unloaded_effort(q, v, a)
        if self.payload.model == "rigid":
            return self._actuated("carrying", q, v, a, self.robot.friction)
        if self.payload.model == "weight_only" and self.gravity is None:
            return self._actuated("loaded", q, v, a, self.robot.friction)
        return self.unloaded_effort(q, v, a) + self.payload.mass * self.effort_per_kilogram(q, v, a)

    def unloaded_effort(self, q: Array, v: Array, a: Array, segments: Array | None = None, *, axis: int = 0) -> Array:
        """Actuator effort without payload, friction and armature included, shapes (..., n_joints) [N·m or N].

        With a :attr:`schedule`, all other loads are included; arguments are those of :meth:`effort`.
        """
        if self.schedule is not None:
            return self._by_phase(lambda part, *states: part.unloaded_effort(*states), (q, v, a), segments, axis)
        return self._actuated("unloaded", q, v, a, self.robot.friction)

    def effort_per_kilogram(
        self, q: Array, v: Array, a: Array, segments: Array | None = None, *, axis: int = 0
    ) -> Array:
        """Effort that each kilogram of the payload adds, shapes (..., n_joints) [N·m/kg or N/kg].

        With a :attr:`schedule`, 0 where the payload is not carried; arguments are those of :meth:`effort`.
        """
        if self.schedule is not None:
            return self._of_varied(lambda part, *states: part.effort_per_kilogram(*states), (q, v, a), segments, axis)
        if self.payload.model == "rigid":
            return self._actuated("kilogram", q, v, a, None)
        if self.payload.model == "weight_only":
            return self._actuated("kilogram", q, np.zeros_like(v), np.zeros_like(a), None)
        psi, _, _ = self.robot.transmission.motion(q, np.zeros_like(v), np.zeros_like(a))
        wide = np.concatenate([psi, np.zeros_like(psi[..., :1])], axis=-1)
        held = [self._rnea(f"probe {axis}", wide, np.zeros_like(wide), np.zeros_like(wide)) for axis in range(3)]
        along_axis = np.sum([torque[..., :-1] * torque[..., -1:] for torque in held], axis=0)
        gravity = float(np.linalg.norm(self.robot.model.gravity.linear))
        return self.robot.transmission.effort(q, -gravity * along_axis)

    def effort_per_parameter(self, q: Array, v: Array, a: Array, segments: Array | None = None) -> Array:
        """Effort that each of a payload's ten parameters adds, per unit of it, shape (T, n_joints, 10) [N·m or N].

        States are as for :meth:`effort`, shape (T, n_joints) each. The order is that of
        :data:`trajevo.robot.payload.PARAMETERS`; the payload's mass, centre of mass and inertia do not matter. With a
        :attr:`schedule`, 0 where the payload is not carried, and ``segments`` are needed.

        Raises:
            InvalidInputError: the payload's model is ``"tool_axis"``, which has no centre of mass, or several motions
                have each a gravity of its own.
        """
        self._check_one_base()
        if self.schedule is not None:
            return self._of_varied(lambda part, *states: part.effort_per_parameter(*states), (q, v, a), segments, 0, 10)
        if self.payload.model == "tool_axis":
            raise InvalidInputError("payload.model: 'tool_axis' acts at the tool's origin and has no centre of mass")
        if self.payload.model == "weight_only":
            v, a = np.zeros_like(v), np.zeros_like(a)
        transmission = self.robot.transmission
        torque = tool_regressor(self.robot, *transmission.motion(q, v, a))
        return np.moveaxis(transmission.effort(q, np.moveaxis(torque, -1, 0)), 0, -1)

    def torque_of(self, name: str, make: Callable[[], Any], q: Array, v: Array, a: Array) -> Array:
        """Torque of another model that is made once and kept under a name, shape (..., n) [N·m or N].

        Args:
            name: which no other model has.
            make: makes the Pinocchio model, of n joints.
            q: positions in its coordinates, shape (..., n) [rad or m].
            v: velocities, the same shape [rad/s or m/s].
            a: accelerations, the same shape [rad/s² or m/s²].
        """
        self._check_one_base()
        self.once(name, make)
        return self._rnea(name, q, v, a)

    def _of_varied(
        self, quantity: _Quantity, states: _States, segments: Array | None, axis: int, *columns: int
    ) -> Array:
        """What the load that capacities mean adds, 0 where it is not carried."""
        return self._by_phase(quantity, states, segments, axis, *columns, only_varied=True)

    def _by_phase(
        self,
        quantity: _Quantity,
        states: _States,
        segments: Array | None,
        axis: int,
        *columns: int,
        only_varied: bool = False,
    ) -> Array:
        """A quantity of states, of their shape and further columns, phase by phase with what is carried then."""
        if self.schedule is None or segments is None:
            raise InvalidInputError(f"segments: expected those of the states, as loads change: {self.schedule}")
        found = np.zeros((*states[0].shape, *columns), dtype=np.result_type(*states))
        of_states = np.array(self.schedule.phase_of_segment)[segments]
        for k, phase in enumerate(self.schedule.phases):
            places = np.flatnonzero(of_states == k)
            if len(places) and (self.schedule.varies(phase) or not only_varied):
                chosen = (np.take(x, places, axis=axis) for x in states)
                part = self.of_phase(phase) if axis else self.of_rows(places).of_phase(phase)
                found[(slice(None),) * axis + (places,)] = quantity(part, *chosen)
        return found

    def _actuated(self, model: str, q: Array, v: Array, a: Array, friction: Friction | None) -> Array:
        transmission = self.robot.transmission
        effort = transmission.effort(q, self._torque(model, *transmission.motion(q, v, a)))
        if friction is None or friction.none:
            return effort
        effort += friction.effort(v, a)
        return effort

    def _torque(self, name: str, q: Array, v: Array, a: Array) -> Array:
        """Torque of a model for arrays of shape (..., n) in its coordinates, under the gravity of each row."""
        if self.gravity is None:
            return self._rnea(name, q, v, a)
        if len(self.gravity) != len(q):
            raise InvalidInputError(
                f"states: expected those of {len(self.gravity)} motions, which have each a gravity of its own, in as "
                f"many rows, got {len(q)}"
            )
        up = np.broadcast_to(-self.gravity.reshape(-1, *(1,) * (q.ndim - 2), 3), (*q.shape[:-1], 3))
        wide = (np.concatenate([x, own], axis=-1) for x, own in ((0.0 * up, q), (0.0 * up, v), (up, a)))
        torque = self._rnea(f"{name}{_ON_SLIDES}", *wide)
        return np.ascontiguousarray(torque[..., 3:])

    def _check_one_base(self) -> None:
        """Refuse what is computed for one motion alone where each of several has a gravity of its own."""
        if self.gravity is not None:
            raise InvalidInputError(
                f"motion: expected one alone, as bases that tilt turn gravity, got {len(self.gravity)} motions"
            )

    def _rnea(self, name: str, q: Array, v: Array, a: Array) -> Array:
        """Torque of a model for arrays of shape (..., n) in model coordinates."""
        if any(map(np.iscomplexobj, (q, v, a))):
            stepped = self._computed(f"{name}, stepped", lambda: stepped_dynamics(*self._masses(name)))
            rows = [x.reshape(len(x), -1, x.shape[-1]) for x in np.broadcast_arrays(q, v, a)]
            slopes: Array = stepped(*rows)
            return slopes.reshape(q.shape)
        # Pinocchio aborts the process on anything but float64.
        flat = [np.ascontiguousarray(x, dtype=np.float64).reshape(-1, x.shape[-1]) for x in (q, v, a)]
        torque = np.empty_like(flat[0])
        self._computed(name, lambda: inverse_dynamics(*self._masses(name), threads=self.threads))(*flat, torque)
        return torque.reshape(q.shape)

    def _masses(self, name: str) -> tuple[Any, HeldLoad | None]:
        """A model, and the load that acts on it by its weight alone, if there is one."""
        if name != "loaded":
            return self._model(name), None
        return self._model("unloaded"), HeldLoad(self._model("kilogram"), self.payload.mass)

    def _computed(self, name: str, make: Callable[[], Any]) -> Any:
        # A run may use another kind of kernel than the one before it.
        key = name, jit.can_compile(), jit.avoided()
        if key not in self._pools:
            self._pools[key] = make()
        return self._pools[key]

    def _model(self, name: str) -> Any:
        if name not in self._models:
            self._models[name] = self._made(name)
        return self._models[name]

    def _made(self, name: str) -> Any:
        if name.endswith(_ON_SLIDES):
            return on_slides(self._model(name.removesuffix(_ON_SLIDES)))
        if name in ("unloaded", "carrying"):
            self.robot.check_masses("effort")
        if name == "unloaded":
            return self.robot.model
        if name == "carrying":
            return carrying(self.robot, self.payload)
        if name == "kilogram":
            return kilogram(self.robot, self.payload)
        model = probe(self.robot)
        model.gravity.linear = np.eye(3)[int(name.removeprefix("probe "))]
        return model
