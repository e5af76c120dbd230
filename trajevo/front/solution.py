"""Solutions: rows of a front, with the motions that they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

from trajevo.base.arrays import Array
from trajevo.base.shown.brief import cut
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.cell.placement import BasePlacement
from trajevo.formulation.cell.visited import Visited
from trajevo.front.exchange_rates import ON_LIMIT, ExchangeRates, exchange_rates
from trajevo.front.notebook import motion_frame, solution_html
from trajevo.front.quantities import Quantities
from trajevo.trajectory.batch import TrajectoryBatch

if TYPE_CHECKING:
    import pandas as pd

    from trajevo.front.front import Front


@dataclass(frozen=True, eq=False)
class Solution:
    """One row of a front.

    Attributes:
        front: the front.
        index: its row.
        rule: name of the rule that chose it.
        reason: why it was chosen, one sentence.
    """

    front: Front
    index: int
    rule: str
    reason: str

    @property
    def x(self) -> Array:
        """Decision vector, shape (n_var,)."""
        row: Array = self.front.X[self.index]
        return row

    def __str__(self) -> str:
        return f"Solution({self.rule}, row {self.index}: {self.F})"

    def __repr__(self) -> str:
        return cut(str(self))

    def _repr_html_(self) -> str:
        return solution_html(self)

    def to_dataframe(self, *, step: float = 0.01) -> pd.DataFrame:
        """The motion at samples: time, then position, velocity, acceleration, jerk and effort of every joint.

        The columns are those of ``export(..., format="csv")``, angles in the problem's own unit.

        Args:
            step: time between samples [s]; the last interval takes 0.5 to 1.5 steps and ends with the motion.

        Raises:
            InvalidInputError: a step that is not positive, or so short that there are over ten million samples.
        """
        return motion_frame(self, step)

    @property
    def F(self) -> Quantities:
        """Objective name -> value, SI; printed with its units."""
        return self._quantities(self.front.F[self.index])

    @property
    def G(self) -> dict[str, float]:
        """Constraint name -> value, at most 0, as a share of the limit."""
        return dict(zip(self.front.record.constraints, self.front.G[self.index].tolist(), strict=True))

    @property
    def trajectory(self) -> TrajectoryBatch:
        """Its trajectory, a batch of one."""
        return self.rollout.trajectory

    @cached_property
    def rollout(self) -> Rollout:
        """The robot on its trajectory; made once."""
        return self.front.problem.rollout(self.x)

    @cached_property
    def base(self) -> BasePlacement | None:
        """Where the robot's base stands; None if it does not move, or where its problem cannot be made again."""
        return BasePlacement.of(self.rollout)

    @cached_property
    def visits(self) -> Visited | None:
        """In which order and postures its points are visited; None if neither is chosen."""
        return Visited.of(self.rollout, self.front.problem.interpolant)

    @property
    def order(self) -> tuple[int, ...] | None:
        """Number of the point that is visited at each place, from 0; None if it is given."""
        return self.visits.order if self.visits is not None and self.visits.free else None

    @property
    def postures(self) -> tuple[str, ...] | None:
        """Name of the posture at each place, empty for joint positions; None if neither it nor the order is chosen."""
        return None if self.visits is None else self.visits.postures

    @cached_property
    def known_to(self) -> Quantities:
        """How far each objective is known, SI: how much it changes when segments have twice as many samples."""
        return self._quantities(self.front.known_to([self.index])[0])

    def sensitivity(self, objective: str | None = None, *, within: float = ON_LIMIT) -> ExchangeRates:
        """What holds an objective back, and what a little more of it would buy.

        Args:
            objective: name of the objective that should fall; the first one if None.
            within: share of a limit below it that counts as being on it.

        Raises:
            UnknownNameError: no such objective.
            InvalidInputError: ``within`` is not a number from 0 to 1.
        """
        return exchange_rates(self.front, [self.index], objective, within=within)[0]

    def sheet(self, *, dwell: float = 0.0, supplementary: Mapping[str, Any] | None = None, creator: str = "") -> Any:
        """The sheet of what the motion carries, to check, sign and keep; see :func:`trajevo.payload_sheet`.

        Args:
            dwell: time at rest after the motion, until it begins anew [s].
            supplementary: loads that are mounted on the arm, joint -> payload, its settings or its mass [kg].
            creator: who makes the sheet.

        Raises:
            InvalidInputError: as for :func:`trajevo.payload_sheet`.
        """
        made = import_module("trajevo.page.sheet.sheet").payload_sheet
        return made(self, dwell=dwell, supplementary=supplementary, creator=creator)

    def _quantities(self, row: Array) -> Quantities:
        objectives = self.front.record.objectives
        values = dict(zip(self.front.objective_names, row.tolist(), strict=True))
        return Quantities(values, {objective.name: objective.unit for objective in objectives})
