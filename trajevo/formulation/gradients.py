"""How a problem is differentiated: by complex steps where that is right, else by finite differences, which is told.

trajevo's own functions take complex steps; tests compare all of them with finite differences. A function of the user's
may drop imaginary parts, so that its derivative would be 0 or wrong without a word. So its complex steps are compared
with finite differences once, before its first derivative is used.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property, partial
from types import MethodType
from typing import Any, Literal, final

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.complex_step import stepped, unstepped
from trajevo.base.shown.brief import brief
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import GradientWarning, TrajevoError
from trajevo.formulation.evaluation import FailedFunctionError, Part
from trajevo.trajectory.batch import DERIVATIVES, Motion, TrajectoryBatch

#: Step of complex-step differentiation: the derivative is the imaginary part of a result divided by it. The real part
#: is not affected, since the step is far below its rounding.
_COMPLEX_STEP = 1e-20

#: Steps of finite differences, as shares of a positive variable or of the range of any other: the one that is used, and
#: a second one, which shows whether the first is accurate.
_STEPS = (1e-6, 2.5e-7)

#: Share of the greatest slope, and of the value itself, by which slopes may differ and still agree.
_OF_SLOPE, _OF_VALUE = 1e-3, 1e-6

#: Numbers of points at which slopes are compared: near the first given ones, and random ones.
_NEAR, _RANDOM = 2, 4

#: How a function is differentiated: its complex step as it is, with numpy's functions as those of the real parts
#: (:mod:`trajevo.base.complex_step`), or finite differences.
Way = Literal["complex step", "complex step of real parts", "finite differences"]
_EXACT: tuple[Way, ...] = ("complex step", "complex step of real parts")
_ROUGH: Way = "finite differences"


@final
@dataclass(frozen=True, eq=False)
class Ways:
    """How functions are differentiated, as far as this is known; copies of a problem share it."""

    known: list[tuple[Any, Way]] = field(default_factory=list)

    __repr__ = brief

    def of(self, thing: Any) -> Way | None:
        """How a function is differentiated; None if that is not known yet."""
        return next((way for one, way in self.known if one is thing), None)

    def add(self, thing: Any, way: Way) -> Way:
        """Remember how a function is differentiated."""
        self.known.append((thing, way))
        return way


@final
@dataclass(frozen=True, eq=False)
class Differentiation:
    """The derivatives of a problem's objectives and constraints.

    Attributes:
        title: the problem, for warnings.
        rollout: decision vectors (B, n_var) -> rollout.
        parts: objectives and constraints.
        bounds: least and greatest decision variables, shapes (n_var,).
        makers: what makes motions of decision vectors: the interpolant, and the class of the problem.
        ways: what is known of the functions.
    """

    title: str
    rollout: Callable[[Array], Rollout]
    parts: Sequence[Part]
    bounds: tuple[Array, Array]
    makers: tuple[Any, ...]
    ways: Ways

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Values and derivatives of all parts, one after another.

        Args:
            x: decision vectors, shape (B, n_var).

        Returns:
            Shapes (B, columns) and (B, columns, n_var).
        """
        points = _Points(self, x, _STEPS[:1])
        found = [points.slopes(points.values(part, way), way) for part, way in zip(self.parts, self.of(x), strict=True)]
        values, slopes = zip(*found, strict=True)
        return np.concatenate(values, axis=1), np.concatenate([each[0] for each in slopes], axis=1)

    def of(self, x: Array) -> list[Way]:
        """How every part is differentiated; functions that are not known yet are looked at near vectors (B, n_var).

        Raises:
            InvalidInputError: a function fails at every point.
        """
        motion = Part("the interpolant", _motion_of, _MOTION_COLUMNS)
        things = [self.makers[0], *(part.function for part in self.parts)]
        ways = [self.ways.of(thing) for thing in things]
        if None in ways:
            points = _Points(self, self._probes(x), _STEPS)
            for k, part in enumerate((motion, *self.parts)):
                if ways[k] is None:
                    known = own(part.function) if k else all(map(own, self.makers))
                    ways[k] = self.ways.add(things[k], "complex step" if known else self._compared(part, points))
        exact = ways[0] != _ROUGH
        return [way if exact and way is not None else _ROUGH for way in ways[1:]]

    def _probes(self, x: Array) -> Array:
        """Points near the given ones and random ones, shape (P, n_var).

        At a given point itself a peak could have a kink, if it is equally high in two places, as in symmetric motions.
        """
        drawn = np.random.default_rng(0).uniform(*self.bounds, (_NEAR + _RANDOM, x.shape[1]))
        near = np.clip(x[:_NEAR], *self.bounds)
        drawn[: len(near)] = 0.9 * near + 0.1 * drawn[: len(near)]
        return drawn

    def _compared(self, part: Part, points: _Points) -> Way:
        """How a function is differentiated, by comparison with finite differences; a warning tells of these.

        Raises:
            InvalidInputError: the function fails at every point.
            TrajevoError: the function refuses complex numbers with such an error.
        """
        rough, failed = points.possible_values(part, _ROUGH)
        if failed is not None and np.isnan(rough).all():
            raise failed.always from failed
        values, slopes = points.slopes(rough, _ROUGH)
        blame = "its complex step is wrong, since it drops imaginary parts, as .real, float() and real arrays do"
        for way in _EXACT if part.function is not _motion_of else _EXACT[:1]:
            found, failed = points.possible_values(part, way)
            cause = None if failed is None else failed.__cause__
            if isinstance(cause, TrajevoError):
                raise cause
            if _agree(values, slopes * points.width[:, None], points.slopes(found, way)[1][0] * points.width[:, None]):
                return way
            if failed is not None and way == _EXACT[0]:
                blame = f"complex numbers raise {failed} ({failed.where})"
        told = f"{self.title}: gradients by finite differences for {part.what}: {blame}"
        warnings.warn(told, GradientWarning, stacklevel=_level_of_caller())
        return _ROUGH


@final
@dataclass(frozen=True, eq=False)
class _Points:
    """Rollouts at points and near them, computed once for all functions.

    Attributes:
        problem: what is differentiated.
        x: points, shape (P, n_var).
        steps: steps of the finite differences.
    """

    problem: Differentiation
    x: Array
    steps: tuple[float, ...]

    def values(self, part: Part, way: Way) -> Array:
        """Values of a function at all rows, (P, rows, columns): with a complex step each, or point and neighbours."""
        found = part.real(self._real) if way == _ROUGH else part(self._complex if way == _EXACT[0] else self._seen)
        return found.reshape(len(self.x), self._rows(way), found.shape[1])

    def possible_values(self, part: Part, way: Way) -> tuple[Array, FailedFunctionError | None]:
        """The same, NaN at points where the function fails, and its first error."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
            try:
                return self.values(part, way), None
            except FailedFunctionError as error:
                first = error
            shape = len(self.x), self._rows(way), 1 if part.columns is None else part.columns
            found = np.full(shape, np.nan, np.float64 if way == _ROUGH else np.complex128)
            for k in range(len(self.x)):
                try:
                    found[k] = _Points(self.problem, self.x[k : k + 1], self.steps).values(part, way)[0]
                except FailedFunctionError:
                    continue
        return found, first

    def slopes(self, found: Array, way: Way) -> tuple[Array, Array]:
        """Values (P, columns) and derivatives, (1, P, columns, n_var) or one for each step of finite differences."""
        if way != _ROUGH:
            return found[:, 0].real, np.swapaxes(found.imag, 1, 2)[None] / _COMPLEX_STEP
        sides = np.split(found[:, 1:], 2 * len(self.steps), axis=1)
        pairs = zip(sides[::2], sides[1::2], self._neighbours[1], strict=True)
        slopes = [(above - below) / span[..., None] for above, below, span in pairs]
        return found[:, 0], np.swapaxes(np.stack(slopes), 2, 3)

    def _rows(self, way: Way) -> int:
        """Number of rows for each point."""
        n = int(self.x.shape[1])
        return 1 + 2 * len(self.steps) * n if way == _ROUGH else n

    @cached_property
    def width(self) -> Array:
        """What a step is a share of, shape (P, n_var)."""
        lower, upper = self.problem.bounds
        return np.where(lower > 0.0, np.clip(self.x, lower, upper), upper - lower)

    @cached_property
    def _complex(self) -> Rollout:
        steps = self.x[:, None] + 1j * _COMPLEX_STEP * np.eye(self.x.shape[1])
        return self.problem.rollout(steps.reshape(-1, self.x.shape[1]))

    @property
    def _seen(self) -> Any:
        return _seen(self._complex)

    @cached_property
    def _real(self) -> Rollout:
        return self.problem.rollout(self._neighbours[0])

    @cached_property
    def _neighbours(self) -> tuple[Array, list[Array]]:
        """Points, each followed by its neighbours, and distances of the neighbours, (P, n_var) for each step.

        Differences are central; next to a bound they are one-sided.
        """
        lower, upper = self.problem.bounds
        rows, spans = [self.x[:, None]], []
        for step in self.steps:
            moves = step * self.width[:, None] * np.eye(self.x.shape[1])
            above, below = np.minimum(rows[0] + moves, upper), np.maximum(rows[0] - moves, lower)
            spans.append(np.einsum("pii->pi", above - below))
            rows += [above, below]
        return np.concatenate(rows, axis=1).reshape(-1, self.x.shape[1]), spans


def _agree(values: Array, rough: Array, exact: Array) -> bool:
    """Whether slopes agree with finite differences wherever these are accurate.

    Args:
        values: shape (P, columns).
        rough: finite differences with two steps, per share of a variable, shape (2, P, columns, n_var).
        exact: slopes, shape (P, columns, n_var).
    """
    allowed = _OF_SLOPE * np.abs(rough[0]).max(axis=2) + _OF_VALUE * np.abs(values)
    accurate = np.abs(rough[0] - rough[1]).max(axis=2) <= allowed
    agreed = np.abs(exact - rough[0]).max(axis=2) <= allowed
    return bool((agreed | ~accurate).all() and (agreed.any() or np.isfinite(exact).any()))


#: Shares of segments at which the motion of an interpolant is compared, and columns of the comparison.
_SHARES, _MOTION_COLUMNS = np.array([0.0, 0.3, 0.7, 1.0]), len(DERIVATIVES) + 2


def _motion_of(rollout: Rollout) -> Array:
    """Sums with different weights of a motion's derivatives and breaks, and its duration, (B, 6): all must be right."""
    batch = rollout.trajectory
    parts = [batch.at_shares(_SHARES, order).reshape(len(batch), -1) for order in range(len(DERIVATIVES))]
    sums = [part @ np.cos(np.arange(part.shape[1])) for part in (*parts, batch.breaks)]
    return np.stack([*sums, batch.duration], axis=1)


def own(thing: Any) -> bool:
    """Whether a function, or an object that is called, is trajevo's own, with all functions in it."""
    if isinstance(thing, partial):
        return all(map(own, (thing.func, *thing.args, *thing.keywords.values())))
    if isinstance(thing, MethodType):
        return own(thing.__self__)
    if isinstance(thing, tuple | list):
        return all(map(own, thing))
    made = is_dataclass(thing) and not isinstance(thing, type)
    if not made and not callable(thing):
        return True
    room = str(getattr(thing, "__module__", None)).partition(".")[0]
    return room == "trajevo" and (not made or all(own(getattr(thing, each.name)) for each in fields(thing)))


class _Seen:
    """A rollout, trajectory or motion whose complex arrays are handed out as those of real parts."""

    def __init__(self, seen: Any) -> None:
        self._seen = seen

    @property  # type: ignore[misc]
    def __class__(self) -> type:
        return type(self._seen)

    def __getattr__(self, name: str) -> Any:
        return _seen(getattr(self._seen, name))

    def __len__(self) -> int:
        return len(self._seen)

    def __getitem__(self, index: Any) -> Any:
        return _seen(self._seen[index])


def _seen(thing: Any) -> Any:
    """What a function of the user's sees in place of a thing that it gets from a rollout."""
    if isinstance(thing, Rollout | TrajectoryBatch | Motion):
        return _Seen(thing)
    if isinstance(thing, MethodType):
        return lambda *args, **options: _seen(
            thing(*map(_unseen, args), **{name: _unseen(value) for name, value in options.items()})
        )
    if type(thing) is tuple:
        return tuple(map(_seen, thing))
    return stepped(thing)


def _unseen(thing: Any) -> Any:
    return thing.__dict__["_seen"] if type(thing) is _Seen else unstepped(thing)


def _level_of_caller() -> int:
    """Level of the first caller outside trajevo, for warnings."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == "trajevo":
        frame, level = frame.f_back, level + 1
    return level
