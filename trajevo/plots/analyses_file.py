"""The file that stores analyses beside their front: arrays and JSON, of which nothing is executed when it is read."""

from __future__ import annotations

import importlib
import io
import json
import warnings
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen
from trajevo.base.files import why_not, write_whole
from trajevo.base.plain import from_json, read_arrays
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.front import Front
from trajevo.front.records import installed_versions

_FORMAT, _VERSION = "trajevo analyses", 4

#: Modules of the records that analyses consist of, by the names of their classes; imported when one is read, since a
#: report in a hurry holds few of them.
_RECORDS = {
    "AllowedRegions": "capacity.payload_diagram",
    "AroundMotion": "capacity.payload_studies",
    "BaseMap": "solvers.base_map",
    "Capacities": "capacity.capacity",
    "Capacity": "capacity.capacity",
    "Carried": "capacity.payload_studies",
    "Certificate": "verification.certificate",
    "EffortAlong": "capacity.capacity",
    "Exchange": "front.exchange_rates",
    "ExchangeRates": "front.exchange_rates",
    "FrontBound": "verification.front_bound",
    "LeastTimes": "capacity.payload_studies",
    "LowerCurves": "verification.bounds.lower_curves",
    "PayloadCurve": "capacity.payload_time",
    "PayloadDiagram": "capacity.payload_diagram",
    "PolynomialBatch": "trajectory.polynomial",
    "Pose": "path.inverse_kinematics",
    "Proof": "verification.certificate",
    "Rival": "solvers.rivals",
    "RobustCurve": "capacity.robust",
    "Sensitivity": "capacity.sensitivity",
    "SlowdownCurve": "capacity.slowdown",
    "ToolPlane": "capacity.workspace",
    "UncertaintyPrice": "capacity.uncertainty",
    "Uncovered": "verification.certificate",
    "WeightedSums": "verification.path_bounds.weighted_sums",
    "WorkspaceCapacity": "capacity.workspace",
}

#: Errors that NumPy's reader, or the records, raise for a damaged file.
_DAMAGED = (KeyError, ValueError, TypeError, OSError, AttributeError, IndexError, ArithmeticError)


def read_analyses(file: Path, front: Front) -> dict[str, Any]:
    """Stored analyses of a front by name; none if they are of another front or another version.

    A damaged file counts as empty, with a warning.
    """
    if not file.exists():
        return {}
    try:
        arrays = read_arrays(file)
        about = from_json(str(arrays["about"]))
        if about["made"] != _made_for(front):
            return {}
        reader = _Reader(arrays, front)
        return {name: reader.value(tree) for name, tree in about["analyses"].items()}
    except _DAMAGED as error:
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        warnings.warn(f"{file}: analyses that were kept cannot be read and count as none: {said}", stacklevel=3)
        return {}


def write_analyses(file: Path, front: Front, found: Mapping[str, Any]) -> None:
    """Store analyses of a front, replacing those stored before.

    Raises:
        InvalidInputError: the file cannot be written.
    """
    writer = _Writer()
    trees = {name: writer.tree(value) for name, value in found.items()}
    about = np.array(json.dumps({"made": _made_for(front), "analyses": trees}))
    stream, arrays = io.BytesIO(), {"about": about} | writer.arrays
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    try:
        write_whole(file, stream.getbuffer())
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error


def _made_for(front: Front) -> dict[str, Any]:
    """Identification of the front and of the versions for which stored analyses are valid."""
    return {"format": _FORMAT, "version": _VERSION, "trajevo": installed_versions()["trajevo"], "front": front.digest}


@final
class _Writer:
    """Converts values to trees for JSON, with the arrays stored separately."""

    def __init__(self) -> None:
        self.arrays: dict[str, Array] = {}

    def tree(self, value: Any) -> Any:
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray):
            key = f"array_{len(self.arrays)}"
            self.arrays[key] = value
            return {"array": key}
        if isinstance(value, Mapping):
            return {"mapping": [[key, self.tree(each)] for key, each in value.items()]}
        if isinstance(value, tuple | list):
            return [self.tree(each) for each in value]
        if isinstance(value, Rollout):  # robot and payload are those of the problem
            return {"rollout": self.tree(value.trajectory)}
        if isinstance(value, TrajectoryProblem):  # that of the front
            return {"problem": None}
        if not is_dataclass(value) or type(value).__name__ not in _RECORDS:
            raise TypeError(f"analyses: no record of a file: {type(value).__name__}")
        given = {field.name: self.tree(getattr(value, field.name)) for field in fields(value) if field.init}
        return {"record": type(value).__name__, "fields": given}


@final
class _Reader:
    """Converts trees back to values; robot and payload are those of the front's problem."""

    def __init__(self, arrays: Any, front: Front) -> None:
        self._arrays, self._front = arrays, front

    def value(self, tree: Any) -> Any:
        if isinstance(tree, list):
            return tuple(self.value(each) for each in tree)
        if not isinstance(tree, dict):
            return tree
        if "array" in tree:
            return frozen(self._arrays[tree["array"]])
        if "mapping" in tree:
            return {key: self.value(each) for key, each in tree["mapping"]}
        if "rollout" in tree:
            problem = self._front.problem
            return Rollout(problem.dynamics, self.value(tree["rollout"]), kept_limits=problem.kept_limits)
        if "problem" in tree:
            return self._front.problem
        name = tree["record"]
        record = getattr(importlib.import_module(f"trajevo.{_RECORDS[name]}"), name)
        return record(**{name: self.value(each) for name, each in tree["fields"].items()})
