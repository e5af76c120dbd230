"""Check that the numbers of a front that was read from a file follow from its decision vectors."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import final

import numpy as np

from trajevo.base import jit
from trajevo.base.arrays import Array
from trajevo.base.units import pretty
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.records import FORMULAS, installed_versions

#: Share by which objectives may differ between machines, and of the greatest value of all solutions, for values near 0.
_SAME, _SAME_OF_ALL = 1e-6, 1e-9
#: Difference of a constraint, as a share of its limit, between machines: some are distances over a tolerance of 1e-6 m.
_SAME_SHARE = 1e-4
#: The same for objectives and constraints that other formulas of trajevo computed.
_OTHER_FORMULAS = 0.01
#: Objectives that formulas before the third summed over the samples of each segment, and how far that was off at most.
_OF_SAMPLES = {
    *("energy", "square_power", "square_effort", "square_effort_rate", "effort_ratio", "joint_travel", "tool_path"),
}
_OFF_AT_SAMPLES = 0.2


@final
@dataclass(eq=False)
class RecordCheck:
    """Compares rows of a front with what its problem computes, every row once.

    Attributes:
        file: the front's file, for messages.
        X: decision vectors, shape (N, n_var).
        F: objectives on record, shape (N, n_obj).
        G: constraints on record, shape (N, n_constr).
        versions: versions on record.
    """

    file: Path
    X: Array
    F: Array
    G: Array
    versions: dict[str, str]
    _seen: set[int] = field(default_factory=set, repr=False)
    _told: set[str] = field(default_factory=set, repr=False)

    @property
    def few(self) -> tuple[int, ...]:
        """The first and the last row, and some between them."""
        return (
            tuple(sorted(set(np.linspace(0, len(self.X) - 1, 4).round().astype(int).tolist()))) if len(self.X) else ()
        )

    def unseen(self, rows: Iterable[int]) -> list[int]:
        """Those of the rows that were not compared yet."""
        return sorted(set(rows) - self._seen)

    def leave(self, why: Exception) -> None:
        """Warn that the numbers are not compared, and why."""
        self._seen.update(range(len(self.X)))
        warnings.warn(f"{self.file}: the numbers are as recorded, not checked: {why}", stacklevel=5)

    def compare(self, problem: TrajectoryProblem, rows: Iterable[int]) -> None:
        """Compare rows that were not compared yet; takes a few milliseconds, since nothing is compiled for it.

        Effort and tool-speed limits that are proven between samples are compared at the samples: their values on record
        may be coarse bounds, which are not below the samples.

        Args:
            problem: the problem of the front.
            rows: the rows.

        Warns:
            UserWarning: other formulas of trajevo computed the front, and values differ by up to 1 %, or 20 % where
                they were sums over samples.

        Raises:
            InvalidInputError: a value on record is not that of its decision vector; the message names the file, the
                row, the objective or constraint, and both values.
        """
        new = self.unseen(rows)
        if not new:
            return
        F, columns = self._computed(problem, new)
        same_formulas = self.versions.get(FORMULAS[0]) == FORMULAS[1]
        self._compare_objectives(problem, new, F, same_formulas)
        self._compare_constraints(problem, new, columns, _SAME_SHARE if same_formulas else _OTHER_FORMULAS)
        self._seen.update(new)

    def _computed(self, problem: TrajectoryProblem, rows: list[int]) -> tuple[Array, list[Array]]:
        """Objectives (R, n_obj), and the columns of every constraint, (R, n)."""
        try:
            with jit.uncompiled(), np.errstate(all="ignore"):
                rollout = problem.rollout(self.X[rows])
                plain = replace(rollout, dynamics=replace(rollout.dynamics))  # without kernels that are compiled
                F = np.stack([objective.function(plain) for objective in problem.objectives], axis=1)
                return F, [constraint.at_samples.function(plain) for constraint in problem.constraints]
        except Exception as error:  # whatever a problem raises for decision vectors that are not its own
            raise InvalidInputError(
                f"{self.file}: rows {', '.join(map(str, rows))}: the problem cannot evaluate their decision vectors: "
                f"{error}; the file is damaged or was changed"
            ) from error

    def _compare_objectives(self, problem: TrajectoryProblem, rows: list[int], F: Array, same_formulas: bool) -> None:
        recorded = self.F[rows]
        apart = np.abs(F - recorded)
        size = np.maximum(np.abs(F), np.abs(recorded))
        allowed = _SAME * size + _SAME_OF_ALL * np.abs(self.F).max(axis=0)
        for k, objective in enumerate(problem.objectives):
            wrong = ~(apart[:, k] <= allowed[:, k])
            other = _OFF_AT_SAMPLES if objective.name in _OF_SAMPLES else _OTHER_FORMULAS
            if not same_formulas and (apart[wrong, k] <= other * size[wrong, k]).all():
                self._tell(objective.name, (apart[:, k] / np.maximum(size[:, k], np.finfo(float).tiny)).max(), wrong)
                continue
            for row in np.flatnonzero(wrong):
                unit = pretty(objective.unit)
                self._refuse(
                    problem,
                    rows[row],
                    objective.name,
                    f"{recorded[row, k]:.9g} {unit}",
                    f"{F[row, k]:.9g} {unit}".rstrip(),
                )

    def _compare_constraints(
        self, problem: TrajectoryProblem, rows: list[int], columns: list[Array], allowed: float
    ) -> None:
        column = 0
        for constraint, computed in zip(problem.constraints, columns, strict=True):
            recorded = self.G[rows, column : column + len(constraint.names)]
            column += len(constraint.names)
            # A proof says at most 0, with a value that may be coarse.
            wrong = computed > allowed if constraint.proof == "pieces" else np.abs(computed - recorded) > allowed
            if constraint.sampled is not None:
                wrong = computed > recorded + allowed
            for row, k in np.argwhere(wrong | np.isnan(computed)):
                values = (f"{100.0 * (1.0 + value[row, k]):.6g} % of its limit" for value in (recorded, computed))
                self._refuse(problem, rows[row], constraint.names[k], *values)

    def _tell(self, objective: str, share: float, wrong: Array) -> None:
        if wrong.any() and objective not in self._told:
            self._told.add(objective)
            warnings.warn(
                f"{self.file}: recorded by trajevo {self.versions.get('trajevo', 'of an unknown version')} with other "
                f"formulas than those of {installed_versions()['trajevo']} here: {objective} differs by "
                f"{100.0 * share:.2g} %",
                stacklevel=6,
            )

    def _refuse(self, problem: TrajectoryProblem, row: int, name: str, recorded: str, computed: str) -> None:
        another = "" if problem.registered_name else ", or its problem is another one than that given"
        raise InvalidInputError(
            f"{self.file}: row {row}: {name} is recorded as {recorded}, but the decision vector gives {computed}: the "
            f"file is damaged or was changed{another}"
        )
