"""The least of an objective from every base on a plane: where a robot should stand, and what another place costs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, numbers, one_blas_thread
from trajevo.base.shown.brief import brief
from trajevo.base.units import quantity
from trajevo.errors import InvalidInputError, checked_name
from trajevo.formulation.cell.base_box import BASE_VARIABLE, COORDINATES
from trajevo.formulation.cell.varied_points import VariedPoints
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.solution import Solution
from trajevo.solvers.gradient.batch_sqp import Lockstep
from trajevo.solvers.gradient.scaling import Columns, Scaled
from trajevo.solvers.gradient.sqp import with_objectives

#: Random times that are tried at every base, and the best of them from which gradients go on.
_TRIED, _STARTS = 24, 2

#: Greatest number of gradient steps, the decrease of a logarithm below which a start is done, and its restarts.
_STEPS, _TOLERANCE, _RESTARTS = 80, 1e-6, 2

#: Margin by which limits are tightened, as a share, and shares of the way back to the start that are tried in turn for
#: an end that breaks a limit.
_MARGIN, _BACK = 1e-7, (0.0, 1e-6, 1e-4, 1e-2, 0.1)

#: Greatest number of places along each axis: each is a search of its own, all of them in one batch.
_MOST_CELLS = 200


@final
@dataclass(frozen=True, eq=False)
class BaseMap:
    """The least of an objective from every base on a plane.

    Attributes:
        axes: coordinates of the base along columns and rows.
        columns: displacements along the first, shape (N,) [m or rad].
        rows: displacements along the second, shape (M,) [m or rad].
        objective: name of the objective.
        unit: its SI unit.
        least: its least value, shape (M, N) [its unit]; NaN where no motion was found that keeps all limits.
        missed: how far the worst point is missed, distance [m] and angle [rad] added as squares, shape (M, N).
        X: decision vectors of the least values, shape (M, N, n_var); NaN where there are none.
        problem: the problem.
    """

    axes: tuple[str, str]
    columns: Array
    rows: Array
    objective: str
    unit: str
    least: Array
    missed: Array
    X: Array
    problem: TrajectoryProblem

    __repr__ = brief

    @property
    def best(self) -> tuple[float, float]:
        """Displacements along both axes from which the least is least [m or rad].

        Raises:
            InvalidInputError: there is no base with a motion.
        """
        if np.isnan(self.least).all():
            raise InvalidInputError("base map: expected a base from which a motion keeps all limits, got none")
        row, column = np.unravel_index(int(np.nanargmin(self.least)), self.least.shape)
        return float(self.columns[column]), float(self.rows[row])

    def __str__(self) -> str:
        found = np.isfinite(self.least)
        told = f"{int(found.sum())} of {found.size} bases with a motion"
        if not found.any():
            return told
        names = (f"{axis} {place:.4g} {COORDINATES[axis]}" for axis, place in zip(self.axes, self.best, strict=True))
        return f"{told}; least {self.objective} {np.nanmin(self.least):.5g} {self.unit} at base {', '.join(names)}"


def base_map(
    problem: TrajectoryProblem,
    *,
    axes: tuple[str, str] = ("x", "y"),
    cells: int = 15,
    at: Solution | Mapping[str, float | str] | None = None,
    objective: str | None = None,
    seed: int = 0,
) -> BaseMap:
    """The least of an objective over the places of a robot's base, by gradients from each of them, in one batch.

    From every base several random timings are tried; from the best ones gradients go on, all bases together. A place is
    without a value where a point is not reached, or no motion was found that keeps all limits.

    Args:
        problem: a problem whose base moves.
        axes: the two coordinates of the base that make the plane, among those that move.
        cells: number of places along each of them.
        at: where the other coordinates of the base are: those of a solution, or displacements by name, in SI units or
            text with a unit; where they are nearest to the given place if None.
        objective: name of one of the problem's objectives; the first one if None.
        seed: seed of the random timings.

    Raises:
        UnknownNameError: no such objective, or a coordinate that does not move.
        InvalidInputError: the base of the problem does not move, fewer than two cells, or too many.
    """
    columns = base_columns(problem)
    if isinstance(axes, str) or len(axes) != 2 or axes[0] == axes[1]:
        raise InvalidInputError(f"axes: expected two coordinates of the base, got {axes!r}")
    first, second = (columns[checked_name("coordinate that moves", axis, columns)] for axis in axes)
    if not isinstance(cells, int | np.integer) or isinstance(cells, bool) or cells < 2:
        raise InvalidInputError(f"cells: expected a whole number from 2 on, got {cells!r}")
    if cells > _MOST_CELLS:
        raise InvalidInputError(f"cells: expected at most {_MOST_CELLS} along each axis, got {cells}")
    name = problem.objective_names[0] if objective is None else objective
    chosen = list(problem.objective_names).index(checked_name("objective", name, problem.objective_names))
    across, up = (_spaced(float(problem.xl[k]), float(problem.xu[k]), cells) for k in (first, second))
    places = np.empty((cells, cells, len(columns)))
    places[:] = _elsewhere(problem, columns, at)
    order = list(columns.values())
    places[..., order.index(first)], places[..., order.index(second)] = across, up[:, None]
    with one_blas_thread():
        X, least = least_from(problem, places.reshape(-1, len(columns)), objective=chosen, seed=seed)
        missed = _missed(problem, places.reshape(-1, len(columns)))
    shape = (cells, cells)
    return BaseMap(
        axes=(axes[0], axes[1]),
        columns=frozen(across),
        rows=frozen(up),
        objective=name,
        unit=problem.objectives[chosen].unit,
        least=frozen(least.reshape(shape)),
        missed=frozen(missed.reshape(shape)),
        X=frozen(X.reshape(*shape, -1)),
        problem=problem,
    )


def _spaced(low: float, high: float, count: int) -> Array:
    """Places evenly spaced over a range, shape (count,); the given place is 0, not what rounding leaves of it."""
    found = np.linspace(low, high, count)
    found[np.abs(found) < 1e-12 * (high - low)] = 0.0
    return found


def base_columns(problem: TrajectoryProblem) -> dict[str, int]:
    """Numbers of the decision variables that move the base, by coordinate.

    Raises:
        InvalidInputError: there are none.
    """
    if not isinstance(problem, TrajectoryProblem):
        raise InvalidInputError(f"problem: expected one whose base moves, got {type(problem).__name__}")
    names = [variable.name for variable in problem.variables]
    found = {key: names.index(BASE_VARIABLE + key) for key in COORDINATES if BASE_VARIABLE + key in names}
    if not found or not isinstance(problem.interpolant, VariedPoints):
        raise InvalidInputError(
            f"problem: expected one whose base moves, got {problem.title!r}, whose base stands still"
        )
    return found


def least_from(
    problem: TrajectoryProblem, bases: Array, *, objective: int = 0, seed: int = 0, starts: int = _STARTS
) -> tuple[Array, Array]:
    """The least of an objective with the base held at each of some places, by gradients, all places together.

    Args:
        problem: a problem whose base moves.
        bases: values of the variables that move the base, shape (N, n_base) [m or rad].
        objective: number of the objective.
        seed: seed of the random values of all other variables from which the search starts.
        starts: number of starts of gradients at each place.

    Returns:
        Decision vectors (N, n_var) and the least values (N,); NaN where none keeps all limits.
    """
    alone = with_objectives(problem, np.arange(problem.n_obj) == objective)
    held = np.zeros(problem.n_var, dtype=bool)
    held[list(base_columns(problem).values())] = True
    begun, F = _begun(alone, bases, held, seed, starts)
    columns = Columns.of(F, np.eye(1), np.array([F.max()]))
    scaled = Scaled(alone.in_terms(), columns, _MARGIN, held=held)
    y = scaled.inside(begun)
    run = Lockstep(scaled, y, reference=columns(F), augmentation=np.full((len(y), 1), 1e-5), restarts=_RESTARTS)
    run.run(np.full(len(y), _STEPS), np.full(len(y), _TOLERANCE), lambda: False)
    found, least = np.full_like(begun, np.nan), np.full(len(begun), np.nan)
    ends = [run.y + share * (y - run.y) for share in _BACK]
    for end in (*ends, run.safe, y):
        left = np.flatnonzero(np.isnan(least))
        if not len(left):
            break
        X = np.where(held, begun[left], scaled.outside(end[left]))
        F, G = alone.evaluate(X, return_values_of=["F", "G"])
        good = np.isfinite(F[:, 0]) & (G.max(axis=1, initial=-np.inf) <= 0.0)
        found[left[good]], least[left[good]] = X[good], F[good, 0]
    by_place = least.reshape(len(bases), starts)
    best = np.where(np.isnan(by_place), np.inf, by_place).argmin(axis=1)
    rows = np.arange(len(bases)) * starts + best
    return found[rows], least[rows]


def _begun(problem: TrajectoryProblem, bases: Array, held: Array, seed: int, starts: int) -> tuple[Array, Array]:
    """The best of random vectors at every base, (N x starts, n_var), and the objective there, finite, (N x starts, 1).

    Times are drawn on a logarithmic scale.
    """
    tried, times = max(_TRIED, starts), problem.xl > 0.0
    shares = np.random.default_rng(seed).uniform(size=(tried, problem.n_var))
    drawn = problem.xl + shares * (problem.xu - problem.xl)
    drawn[:, times] = problem.xl[times] * (problem.xu[times] / problem.xl[times]) ** shares[:, times]
    X = np.tile(drawn, (len(bases), 1))
    X[:, held] = bases.repeat(tried, axis=0)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    excess = np.maximum(G, 0.0).sum(axis=1).reshape(len(bases), tried)
    cost = np.where(np.isfinite(F[:, 0]), F[:, 0], np.inf).reshape(len(bases), tried)
    order = np.stack([np.lexsort(pair) for pair in zip(cost, excess, strict=True)])[:, :starts]
    rows = (np.arange(len(bases))[:, None] * tried + order).ravel()
    values = cost.ravel()[rows]
    usual = float(values[np.isfinite(values)].max(initial=1.0))
    return X[rows], np.where(np.isfinite(values), values, usual)[:, None]


def _missed(problem: TrajectoryProblem, bases: Array) -> Array:
    """How far the worst point is missed from bases (N, n_base), shape (N,) [m and rad]."""
    varied = problem.interpolant
    if not isinstance(varied, VariedPoints):
        raise InvalidInputError("problem: expected one whose base moves")
    x = np.tile(0.5 * (problem.xl + problem.xu), (len(bases), 1))
    x[:, list(base_columns(problem).values())] = bases
    timing = x if problem.payload_range is None else x[:, :-1]
    missed: Array = np.sqrt(np.square(varied.arranged(timing).missed).sum(axis=2)).max(axis=1)
    return missed


def _elsewhere(problem: TrajectoryProblem, columns: Mapping[str, int], at: Any) -> Array:
    """Values of the variables that move the base beside the plane, shape (n_base,) [m or rad]."""
    order = list(columns.values())
    low, high = problem.xl[order], problem.xu[order]
    if isinstance(at, Solution):
        return np.asarray(at.x[order])
    place = np.clip(np.zeros(len(order)), low, high)
    if at is None:
        return place
    if not isinstance(at, Mapping):
        raise InvalidInputError(f"at: expected a solution or displacements of the base by name, got {at!r}")
    for key, given in at.items():
        k = list(columns).index(checked_name("coordinate that moves", key, columns))
        value = quantity(given, COORDINATES[key], name=f"at: {key}") if isinstance(given, str) else given
        place[k] = float(numbers(value, name=f"at: {key}", shape=()))
        if not low[k] <= place[k] <= high[k]:
            raise InvalidInputError(
                f"at: {key}: expected {low[k]:g} to {high[k]:g} {COORDINATES[key]}, where the base may be, got "
                f"{place[k]:g}"
            )
    return place
