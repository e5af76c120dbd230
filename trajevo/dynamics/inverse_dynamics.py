"""Inverse dynamics of a robot with a payload and friction, for whole populations at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.dynamics.rnea import Load, inverse_dynamics, stepped_dynamics
from trajevo.errors import InvalidInputError
from trajevo.robot.joints import Friction
from trajevo.robot.payload import Payload, carrying, kilogram, probe, tool_regressor
from trajevo.robot.robot import Robot

NO_PAYLOAD = Payload(0.0)

#: Greatest number of threads.
_MOST_THREADS = 1_000

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

    Raises:
        InvalidInputError: fewer than 2 samples or fewer than 1 thread, or a payload of a robot without a body.
    """

    robot: Robot
    payload: Payload = NO_PAYLOAD
    samples: int = field(default=6, kw_only=True)
    threads: int = field(default=1, kw_only=True)
    _pools: dict[tuple[str, bool, bool], Any] = field(default_factory=dict, init=False, repr=False)
    _models: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        for name, least, most in (("samples", 2, math.inf), ("threads", 1, _MOST_THREADS)):
            value = getattr(self, name)
            if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
                raise InvalidInputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
            if value > most:
                raise InvalidInputError(f"{name}: expected a whole number of at most {most}, got {value!r}")
            object.__setattr__(self, name, int(value))
        if self.payload.mass != 0.0:
            self.robot.check_body("a payload")

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_pools": {}, "_models": {}}  # a ModelPool cannot be pickled; made again when needed

    def sampled(self, samples: int) -> Dynamics:
        """The same with another number of samples per segment, sharing the models already made."""
        other = replace(self, samples=samples)
        object.__setattr__(other, "_models", self._models)
        object.__setattr__(other, "_pools", self._pools)
        return other

    def effort(self, q: Array, v: Array, a: Array) -> Array:
        """Actuator effort with the payload, shapes (..., n_joints) [N·m or N]."""
        if self.payload.mass == 0.0:
            return self.unloaded_effort(q, v, a)
        if self.payload.model == "rigid":
            return self._actuated("carrying", q, v, a, self.robot.friction)
        if self.payload.model == "weight_only":
            return self._actuated("loaded", q, v, a, self.robot.friction)
        return self.unloaded_effort(q, v, a) + self.payload.mass * self.effort_per_kilogram(q, v, a)

    def unloaded_effort(self, q: Array, v: Array, a: Array) -> Array:
        """Actuator effort without payload, friction and armature included, shapes (..., n_joints) [N·m or N]."""
        return self._actuated("unloaded", q, v, a, self.robot.friction)

    def effort_per_kilogram(self, q: Array, v: Array, a: Array) -> Array:
        """Effort that each kilogram of the payload adds, shapes (..., n_joints) [N·m/kg or N/kg]."""
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

    def effort_per_parameter(self, q: Array, v: Array, a: Array) -> Array:
        """Effort that each of a payload's ten parameters adds, per unit, shapes (T, n_joints) -> (T, n_joints, 10).

        The order is that of :data:`trajevo.robot.payload.PARAMETERS`; the payload's mass, centre of mass and inertia do
        not matter.

        Raises:
            InvalidInputError: the payload's model is ``"tool_axis"``, which has no centre of mass.
        """
        if self.payload.model == "tool_axis":
            raise InvalidInputError("payload.model: 'tool_axis' acts at the tool's origin and has no centre of mass")
        if self.payload.model == "weight_only":
            v, a = np.zeros_like(v), np.zeros_like(a)
        transmission = self.robot.transmission
        torque = tool_regressor(self.robot, *transmission.motion(q, v, a))
        return np.moveaxis(transmission.effort(q, np.moveaxis(torque, -1, 0)), 0, -1)

    def _actuated(self, model: str, q: Array, v: Array, a: Array, friction: Friction | None) -> Array:
        transmission = self.robot.transmission
        effort = transmission.effort(q, self._rnea(model, *transmission.motion(q, v, a)))
        if friction is None or friction.none:
            return effort
        effort += friction.effort(v, a)
        return effort

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

    def _masses(self, name: str) -> tuple[Any, Load | None]:
        """A model, and the load that acts on it by its weight alone, if there is one."""
        if name != "loaded":
            return self._model(name), None
        return self._model("unloaded"), Load(self._model("kilogram"), self.payload.mass)

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
