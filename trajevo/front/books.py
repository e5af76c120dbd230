"""What a run records while it goes on: the archive and the history by generation, and the front made from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.jit import Kind
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.archive import Archive
from trajevo.front.front import Front
from trajevo.front.hypervolume import Chronicle, Volume, Volumes, hypervolume
from trajevo.front.records import Blocking, FailedIndividual, History, ProblemRecord, Run, Stop, installed_versions

#: No run counts to this, and no other number of a history reaches it.
_MOST = 2**31


class Books:
    """Records what an algorithm evaluates, generation by generation.

    If every solution of the problem stands for a curve of another problem's solutions (``problem.expansion``), fronts
    and hypervolumes are those of the other problem, here called the target.
    """

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.problem = problem
        self.target = problem if problem.expansion is None else problem.expansion.problem
        self.archive = Archive(problem.n_var, problem.n_obj, problem.n_ieq_constr)
        self.reference_point = self.target.reference_point
        self.evaluations: list[int] = []
        self.hypervolume: list[float | Volume] = []
        self.least_violation: list[float | None] = []
        self.front_size: list[int] = []
        self.polishing: list[int] = []
        self.cpu_seconds: list[float] = []
        self._chronicle, self._volume_at = Chronicle(problem.n_obj), 0
        self._volume: float | Volume = 0.0

    def collect(self, X: Array, out: dict[str, Any]) -> None:
        """Add evaluated individuals to the archive; pymoo's problem calls this after every evaluation.

        Args:
            X: decision vectors, shape (B, n_var).
            out: results of the problem: ``"F"``, ``"G"`` and, if individuals failed, ``"failure"``.
        """
        said = out.get("failure")
        x, F, G = (np.atleast_2d(values) for values in (X, out["F"], out["G"]))
        change = self.archive.add(x, F, G, None if said is None else np.atleast_1d(said).tolist())
        if change is not None:
            self._chronicle.change(*change)

    def close(self, number: int, evaluations: int, *, polishing: int = 0, cpu_seconds: float = 0.0) -> Generation:
        """Record a finished generation.

        Args:
            number: number of the generation.
            evaluations: individuals evaluated so far.
            polishing: further evaluations, spent on refining members or on finding the first population.
            cpu_seconds: CPU time of the run so far [s].
        """
        if self._volume_at != self._chronicle.time:
            self._changed()
        volume, violation = self._volume, self.archive.least_violation
        self.evaluations.append(evaluations)
        self.hypervolume.append(volume)
        self.least_violation.append(violation if np.isfinite(violation) else None)
        self.front_size.append(len(self.archive.F))
        self.polishing.append(polishing)
        self.cpu_seconds.append(cpu_seconds)
        return Generation(number, volume, violation, len(self.archive.F))

    def history(self) -> History:
        """The history by generation."""
        corner = self.reference_point
        return History(
            reference_point=None if corner is None else tuple(corner.tolist()),
            evaluations=tuple((np.array(self.evaluations) + np.cumsum(self.polishing)).tolist()),
            hypervolume=Volumes(self.hypervolume),
            least_violation=tuple(self.least_violation),
            front_size=tuple(self.front_size),
        )

    def arrays(self) -> dict[str, Array]:
        """The history as arrays, for a checkpoint; ``evaluations`` does not include those of ``polishing``."""
        corner = self.reference_point
        return {
            "reference_point": np.array([] if corner is None else corner, dtype=np.float64),
            "evaluations": np.array(self.evaluations, dtype=np.int64),
            "hypervolume": np.array(self.measured(), dtype=np.float64),
            "least_violation": np.array([np.nan if v is None else v for v in self.least_violation], dtype=np.float64),
            "front_size": np.array(self.front_size, dtype=np.int64),
            "polishing": np.array(self.polishing, dtype=np.int64),
            "cpu_seconds": np.array(self.cpu_seconds, dtype=np.float64),
        }

    def measured(self) -> list[float]:
        """Compute the hypervolume of every generation."""
        return [float(volume) for volume in self.hypervolume]

    def reopen(self, books: Mapping[str, Array]) -> None:
        """Restore the history from :meth:`arrays`; the caller then collects the individuals again.

        Raises:
            KeyError: an array is missing.
            ValueError: an array has another shape or type than a history, or a value that no run has.
        """
        corner = books["reference_point"]
        if corner.shape not in ((0,), (self.target.n_obj,)) or corner.dtype.kind != "f" or not (corner > 0.0).all():
            raise ValueError(f"expected a positive reference_point of {self.target.n_obj} objectives")
        for name in ("evaluations", "hypervolume", "least_violation", "front_size", "polishing", "cpu_seconds"):
            values, kind = books[name], "i" if name in ("evaluations", "front_size", "polishing") else "f"
            known = values[~np.isnan(values)] if name == "least_violation" and values.dtype.kind == "f" else values
            whole = values.shape == books["evaluations"].shape and values.ndim == 1 and values.dtype.kind == kind
            if not (whole and (known >= (-_MOST if name == "hypervolume" else 0)).all() and (known < _MOST).all()):
                raise ValueError(f"expected {name} of every generation, in numbers that a run has")
        if (books["evaluations"] + np.cumsum(books["polishing"]) >= _MOST).any():
            raise ValueError(f"expected fewer than {_MOST} evaluations")
        self.reference_point = np.array(corner, dtype=np.float64) if len(corner) else None
        self.evaluations = [int(value) for value in books["evaluations"]]
        self.hypervolume = [float(value) for value in books["hypervolume"]]
        self.least_violation = [None if np.isnan(value) else float(value) for value in books["least_violation"]]
        self.front_size = [int(value) for value in books["front_size"]]
        self.polishing = [int(value) for value in books["polishing"]]
        self.cpu_seconds = [float(value) for value in books["cpu_seconds"]]

    def front(
        self,
        *,
        algorithm: str,
        settings: dict[str, Any],
        seed: int,
        evaluations: int,
        interrupted: bool,
        seconds: float,
        stopped_by: Stop = "",
        resumed: Sequence[int] = (),
        kernels: Kind | None,
        versions: dict[str, str] | None = None,
        last: bool = False,
    ) -> Front:
        """The front of the target problem; with ``last`` it takes the archive's memory, and nothing can be added."""
        archive = self.archive if self.problem.expansion is None else self._expanded()
        failed = tuple(FailedIndividual(x=tuple(x.tolist()), said=said) for x, said in self.archive.failed)
        X, F, G = archive.ordered(last=last)
        return Front(
            X=X,
            F=F,
            G=G,
            record=ProblemRecord.of(self.target),
            run=Run(
                algorithm=algorithm,
                settings=settings | self._solved_as(),
                seed=seed,
                generations=len(self.evaluations),
                evaluations=evaluations + sum(self.polishing),
                failures=self.archive.failures,
                first_failure=failed[0].said if failed else "",
                failed=failed,
                interrupted=interrupted,
                stopped_by=stopped_by,
                resumed=tuple(resumed),
                seconds=seconds,
                cpu_seconds=tuple(self.cpu_seconds),
                versions=installed_versions() if versions is None else versions,
                kernels=kernels,
            ),
            history=self.history(),
            blocking=None if len(F) else _blocking(self.archive, self.problem.constraint_names),
            _problem=self.target,
        )

    def _solved_as(self) -> dict[str, Any]:
        """Settings in which the solved problem differs from the target."""
        own, shown = self.problem.settings, self.target.settings
        return {key: value for key, value in own.items() if shown.get(key) != value}

    def _expanded(self) -> Archive:
        """Archive of the points that the solutions stand for, evaluated by the target problem."""
        expanded = Archive(self.target.n_var, self.target.n_obj, self.target.n_ieq_constr)
        X, _ = self._points()
        if len(X):
            expanded.add(X, *self.target.evaluate(X, return_values_of=["F", "G"]))
        return expanded

    def _points(self) -> tuple[Array, Array]:
        """Decision vectors and objectives of the target problem so far."""
        X, F = self.archive.X, self.archive.F
        return (X, F) if self.problem.expansion is None or not len(X) else self.problem.expansion.points(X, F)

    def _changed(self) -> None:
        """Update the hypervolume after a change of the archive: computed when it is read, or at once for curves."""
        curves = self.problem.expansion is not None
        F = self._points()[1] if curves else self.archive.F
        if self.reference_point is None and len(F):
            self.reference_point = _box_corner(F)
        self._volume_at = self._chronicle.time
        if self.reference_point is None:
            self._volume = 0.0
        elif curves:
            self._volume = hypervolume(F, self.reference_point)
        else:
            self._volume = Volume(partial(self._chronicle.at, self._volume_at), self.reference_point)


def _blocking(archive: Archive, names: tuple[str, ...]) -> Blocking:
    if archive.nearest is None:
        return Blocking(x=(), violations={})
    x, g = archive.nearest
    worst_first = sorted(((float(by), name) for by, name in zip(g, names, strict=True) if by > 0.0), reverse=True)
    return Blocking(x=tuple(x.tolist()), violations={name: by for by, name in worst_first})


def _box_corner(F: Array) -> Array | None:
    """Reference point for a problem without one: a tenth beyond the worst values of the first feasible points.

    None if an objective is not positive, since the box begins at 0.
    """
    worst: Array = F.max(axis=0)
    return 1.1 * worst if (worst > 0.0).all() else None


@dataclass(frozen=True)
class Generation:
    """Progress of a run: generation number, hypervolume, least violation, number of points on the front."""

    number: int
    hypervolume: float | Volume
    least_violation: float
    front_size: int

    def __str__(self) -> str:
        return (
            f"hypervolume {float(self.hypervolume):.6f}  least violation {self.least_violation:.4g}  "
            f"front {self.front_size} points"
        )

    @property
    def brief(self) -> str:
        """What matters now, in a few words: the front, or how far the nearest miss is from feasible."""
        if not self.front_size:
            return f"least violation {self.least_violation:.3g}"
        return f"{self.front_size} points, hypervolume {float(self.hypervolume):.4f}"
