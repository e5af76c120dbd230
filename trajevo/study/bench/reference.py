"""The best that is known of a benchmark problem: decision vectors, evaluated again whenever they are read.

A file ``reference.json`` holds what is said of a problem, what was published, and the best known set as decision
vectors. The values beside them are only compared: a set counts if the problem itself finds the same objectives and
every limit kept. Limits that the problem proves at every instant are thereby proven again. Of capacities, the greatest
payloads of given motions, it is also proven that none is greater.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, final

import numpy as np
import pydantic

from trajevo.base.arrays import Array, frozen, numbers
from trajevo.base.files import read_text, write_whole
from trajevo.base.plain import from_json
from trajevo.base.shown.brief import brief
from trajevo.capacity.dlcc import TOLERANCES, capacities
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.archive import Archive
from trajevo.front.hypervolume import hypervolume
from trajevo.front.thinning import thinned
from trajevo.verification.certificate import Certificate
from trajevo.verification.certify import certify_all

#: Share by which values found again may differ from those in the file: machines round differently.
SAME = 1e-9

#: Share by which a capacity may be less than the bound that is proven of it: it is of samples, rounded down.
LEFT = 1e-5

#: Greatest number of members of a best known front, by the number of objectives; many objectives need more.
MOST_MEMBERS = {2: 200, 3: 300}
_MOST_OF_MANY = 500

#: Share by which a least value must be less than the best known one to be kept: less is rounding.
_BETTER = 1e-12

#: What is asked: a front, the least value of the first objective, or the greatest payloads of given motions.
Kind = Literal["front", "least", "capacity"]

_Number = Annotated[float, pydantic.Field(allow_inf_nan=False)]


class _Model(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)

    __repr__ = brief


@final
class Published(_Model):
    """A value of an objective from elsewhere.

    Attributes:
        objective: name of the objective.
        value: the value, in ``unit``.
        unit: its SI unit.
        source: where it is printed, or what computed it.
        basis: ``"printed"`` if it was looked up, in the source itself or in a text that quotes it; ``"not looked up"``
            if its note says what speaks for it; ``"computed"`` if it is printed nowhere, but a solver that is not
            trajevo's, or a closed form, found it.
        tolerance: share of the value by which the best known one may differ from it and still confirm it; None where
            both need not be equal, as with a value for motions of another kind.
        note: what it is a value of, and how it compares.
    """

    objective: str
    value: _Number
    unit: str
    source: str
    basis: Literal["printed", "not looked up", "computed"]
    tolerance: _Number | None = None
    note: str = ""


class Registered(_Model):
    """A registered problem and its arguments, for problems that a task cannot state."""

    name: str
    arguments: dict[str, Any] = {}


@final
class ReferenceFile(_Model):
    """What ``reference.json`` holds.

    Attributes:
        title: what the problem is, in one line.
        source: where the problem is from.
        kind: ``"front"``; ``"least"`` for the least value of the first objective; or ``"capacity"`` for the greatest
            payloads of given motions.
        found_by: how the best known set was found.
        objectives: names of the objectives, as the problem has them.
        units: their SI units.
        ideal: near corner of the hypervolume's box [SI].
        reference_point: far corner of the hypervolume's box [SI].
        published: what others have printed.
        registered: the registered problem, where there is no task.
        variables: decision vectors of the best known set [SI]; of capacities each is a given motion, but for the last
            variable, the payload's mass.
        values: their objectives [SI].
    """

    title: str
    source: str
    kind: Kind
    found_by: str
    objectives: tuple[str, ...]
    units: tuple[str, ...]
    ideal: tuple[_Number, ...]
    reference_point: tuple[_Number, ...]
    published: tuple[Published, ...] = ()
    registered: Registered | None = None
    variables: tuple[tuple[_Number, ...], ...] = ()
    values: tuple[tuple[_Number, ...], ...] = ()

    @classmethod
    def read(cls, file: Path) -> ReferenceFile:
        """Read a file.

        Raises:
            InvalidInputError: it cannot be read, or a key is missing, unknown or of the wrong type.
        """
        try:
            found = cls.model_validate(from_json(read_text(file)))
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            raise InvalidInputError(f"{file}: {place}: {first['msg'][:1].lower()}{first['msg'][1:]}") from error
        except ValueError as error:
            raise InvalidInputError(f"{file}: cannot be read as JSON: {error}") from error
        wanted = len(found.objectives)
        for key in ("units", "ideal", "reference_point"):
            if len(getattr(found, key)) != wanted:
                raise InvalidInputError(
                    f"{file}: {key}: expected one for each of {wanted} objectives, got {len(getattr(found, key))}"
                )
        return found


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """The best known set of a benchmark problem.

    Attributes:
        kind: ``"front"``, or ``"least"`` for the least value of the first objective.
        objectives: names of the objectives.
        ideal: near corner of the hypervolume's box, shape (n_obj,) [SI]; fixed for good.
        reference_point: far corner of it, shape (n_obj,) [SI].
        variables: decision vectors, shape (members, n_var), sorted by the first objective.
        values: their objectives, evaluated again, shape (members, n_obj) [SI].
        published: what others have printed.
        file: what the file says.
    """

    kind: Kind
    objectives: tuple[str, ...]
    ideal: Array
    reference_point: Array
    variables: Array
    values: Array
    published: tuple[Published, ...]
    file: ReferenceFile = field(repr=False)
    _problem: TrajectoryProblem = field(repr=False)

    __repr__ = brief

    @classmethod
    def of(cls, file: ReferenceFile, problem: TrajectoryProblem, place: str = "reference.json") -> Reference:
        """The best known set of a file, evaluated by its problem.

        Args:
            file: what the file says.
            problem: the problem.
            place: name of the file, for messages.

        Raises:
            InvalidInputError: the file's objectives are not the problem's, or a member breaks a limit or has other
                values than the file says.
        """
        if file.objectives != problem.objective_names:
            raise InvalidInputError(
                f"{place}: objectives: expected those of the problem, {list(problem.objective_names)}, got "
                f"{list(file.objectives)}"
            )
        units = tuple(objective.unit for objective in problem.objectives)
        if file.units != units:
            raise InvalidInputError(f"{place}: units: expected {list(units)}, got {list(file.units)}")
        X, values = np.empty((0, problem.n_var)), np.empty((0, problem.n_obj))
        if file.variables:
            X = numbers(file.variables, name=f"{place}: variables", shape=("members", problem.n_var))
            kept = numbers(file.values, name=f"{place}: values", shape=(len(X), problem.n_obj))
            values = _checked(problem, X, place)
            off = np.abs(values - kept) > SAME * np.abs(kept)
            if off.any():
                row, column = (int(found) for found in np.argwhere(off)[0])
                raise InvalidInputError(
                    f"{place}: values.{row}: expected {values[row, column]:.17g} for {file.objectives[column]}, as the "
                    f"problem finds, got {kept[row, column]:.17g}"
                )
            if file.kind == "capacity":
                _check_greatest(problem, X, place)
        ideal, corner = (frozen(np.array(each)) for each in (file.ideal, file.reference_point))
        return cls(file.kind, file.objectives, ideal, corner, frozen(X), frozen(values), file.published, file, problem)

    def improved(self, X: Any, *, found_by: str = "") -> Reference:
        """The best of this set and other decision vectors, which are checked in the same way.

        A front is that of both, or 200 to 500 members spread over it if they have more hypervolume than this set; a
        least value is replaced by a lesser one. Capacities stay: it is proven that none is greater.

        Args:
            X: decision vectors, shape (B, n_var).
            found_by: what found them, to be told of a set that has changed.

        Returns:
            A better set, or this one if nothing is better.

        Raises:
            InvalidInputError: a decision vector is outside its bounds or breaks a limit.
        """
        new = numbers(X, name="X", shape=("B", self._problem.n_var))
        values = _checked(self._problem, new, "X")
        if self.kind == "capacity":
            return self
        merged, F = np.concatenate([self.variables, new]), np.concatenate([self.values, values])
        rows = self._least(F) if self.kind == "least" else self._front(F)
        if (rows < len(self.variables)).all() or not self.hypervolume(F[rows]) > self.hypervolume(self.values):
            return self
        told = {"variables": _tuples(merged[rows]), "values": _tuples(F[rows])}
        file = self.file.model_copy(update={**told, **({"found_by": found_by} if found_by else {})})
        return replace(self, variables=frozen(merged[rows]), values=frozen(F[rows]), file=file)

    def hypervolume(self, values: Any) -> float:
        """Share of the box between ideal and reference point that objectives (N, n_obj) dominate."""
        F = numbers(values, name="values", shape=("N", len(self.objectives)))
        inside = (self.reference_point > F).all(axis=1)
        return hypervolume(np.maximum(F[inside] - self.ideal, 0.0), self.reference_point - self.ideal)

    def certificates(self) -> tuple[Certificate, ...]:
        """Certificates of all members, by limits of joints and drives alone, see :func:`trajevo.certify`.

        What the problem checks at samples only may exceed its limit between them, which these tell.
        """
        return certify_all(self._problem.rollout(self.variables))

    @property
    def proven(self) -> bool:
        """Whether the problem itself proves all limits at every instant, so that reading the set proves them again."""
        return all(limit.proof != "samples" for limit in self._problem.constraints)

    def write(self, file: str | Path) -> None:
        """Write ``reference.json``, one member a line."""
        data = self.file.model_dump(exclude_none=True)
        rows = {key: data.pop(key) for key in ("variables", "values")}
        text = json.dumps(data, indent=2, ensure_ascii=False)[:-2]
        for key, lines in rows.items():
            listed = ",\n".join(f"    {json.dumps([float(number) for number in line])}" for line in lines)
            text += f',\n  "{key}": [' + (f"\n{listed}\n  ]" if lines else "]")
        write_whole(Path(file), f"{text}\n}}\n".encode())

    def _least(self, F: Array) -> Array:
        """The row of the least value; this set's own unless another is less by more than rounding."""
        best = int(F[:, 0].argmin())
        if len(self.values) and F[best, 0] >= self.values[0, 0] * (1.0 - _BETTER):
            best = 0
        return np.array([best])

    def _front(self, F: Array) -> Array:
        """Rows of the front of all values that are within the box, in their order."""
        inside = np.flatnonzero((self.reference_point > F).all(axis=1))
        archive = Archive(1, F.shape[1], 0)
        archive.add(inside[:, None].astype(float), F[inside], np.empty((len(inside), 0)))
        rows = archive.X[:, 0].astype(np.intp)
        most = MOST_MEMBERS.get(F.shape[1], _MOST_OF_MANY)
        rows = rows[thinned(F[rows], most)] if len(rows) > most else rows
        return rows[np.lexsort(F[rows].T[::-1])]


def _tuples(rows: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, rows.tolist()))


def _checked(problem: TrajectoryProblem, X: Array, place: str) -> Array:
    """Objectives of decision vectors that are within their bounds and keep all limits, shape (B, n_obj).

    Raises:
        InvalidInputError: one that is not or does not; the message names the variable or the constraint.
    """
    outside = (problem.xl > X) | (problem.xu < X)
    if outside.any():
        row, column = (int(found) for found in np.argwhere(outside)[0])
        bounds = f"{problem.xl[column]:g} to {problem.xu[column]:g}"
        name = problem.variables[column].name
        raise InvalidInputError(f"{place}: row {row}: {name}: expected {bounds}, got {X[row, column]:.17g}")
    F, G = problem.evaluate(X, return_values_of=["F", "G"]) if len(X) else (np.empty((0, problem.n_obj)), X[:, :0])
    broken = ~(G <= 0.0)
    if broken.any():
        row, column = (int(found) for found in np.argwhere(broken)[0])
        excess = f"{100.0 * G[row, column]:.3g} % of its limit"
        raise InvalidInputError(f"{place}: row {row}: breaks {problem.constraint_names[column]} by {excess}")
    found: Array = F
    return found


def _check_greatest(problem: TrajectoryProblem, X: Array, place: str) -> None:
    """Check that no motion of (B, n_var) carries more than its own mass, the last variable [kg].

    Raises:
        InvalidInputError: the payload is no variable of the problem, or one that may carry more; the message names it.
    """
    if problem.payload_range is None:
        raise InvalidInputError(f"{place}: kind: expected a payload that is a variable, as capacities are asked for")
    # Proofs a tenth as wide as what is left.
    upper = capacities(problem.rollout(X), tolerance=max(0.1 * LEFT, TOLERANCES[0])).upper
    more = np.minimum(upper, problem.payload_range[1]) > X[:, -1] * (1.0 + LEFT)
    if more.any():
        row = int(np.flatnonzero(more)[0])
        raise InvalidInputError(
            f"{place}: row {row}: expected a payload of {upper[row]:.9g} kg, got {X[row, -1]:.9g} kg"
        )
