"""Results of a study: a table, and a dataset along its factors, with hypervolumes that refer to the same box."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.files import why_not, write_whole
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.base.units import display, pretty
from trajevo.errors import InvalidInputError
from trajevo.exporters.exporter import cell
from trajevo.front.hypervolume import hypervolume
from trajevo.front.records import ObjectiveRecord
from trajevo.study.record import Cell, StudyRecord

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

TABLE_FILE, DATASET_FILE = "results.csv", "results.nc"


@dataclass(frozen=True, eq=False)
class StudyBox:
    """The box whose dominated share is the hypervolume of every run of a study.

    Attributes:
        lower: corner of the best values, shape (n_obj,), SI.
        upper: corner of the worst values, shape (n_obj,), SI.
        origin: where it comes from, one sentence.
    """

    lower: Array
    upper: Array
    origin: str

    __repr__ = brief

    def share(self, F: Array) -> float:
        """Hypervolume of objective values, shape (N, n_obj), SI."""
        return hypervolume(F - self.lower, self.upper - self.lower)


@dataclass(frozen=True, eq=False)
class CellResult:
    """Results of a finished cell.

    Attributes:
        cell: the cell.
        F: objective values of its front, shape (N, n_obj), SI.
        knee: objective values of its knee, shape (n_obj,), SI; NaN if nothing is feasible.
        evaluations: number of individuals evaluated by the end of each generation, and of polishing if there was any,
            shape (K,).
        hypervolume: dominated share of the study's box at the same times, shape (K,). Only the last value is known, the
            others are NaN, if the run had another box and its individuals no longer exist.
        generations: number of finished generations.
        seconds: wall time [s].
        cpu_seconds: CPU time of the process [s].
        failures: number of individuals whose evaluation failed.
    """

    cell: Cell
    F: Array
    knee: Array
    evaluations: Array
    hypervolume: Array
    generations: int
    seconds: float
    cpu_seconds: float
    failures: int

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class StudyResults:
    """Results of all finished cells of a study.

    Attributes:
        folder: the study's folder.
        record: the study as data.
        unfinished: number of cells that are not finished, and so not among the results.
        objectives: names and SI units of the columns of F.
        angle: unit in which angles are shown.
        length: unit in which lengths are shown.
        box: box of the hypervolume, None if no cell has found anything feasible.
        cells: the results, in the order of the study's cells.
    """

    folder: Path
    record: StudyRecord
    unfinished: int
    objectives: tuple[ObjectiveRecord, ...]
    angle: str
    length: str
    box: StudyBox | None
    cells: tuple[CellResult, ...]

    __repr__ = brief

    def _repr_html_(self) -> str:
        shown = [self.display(k) for k in range(len(self.objectives))]
        least_of = (f"least {name} [{pretty(unit)}]" for name, unit, _ in shown)
        headers = ["levels", "runs", "median hypervolume", *least_of]
        rows = []
        for levels in dict.fromkeys(result.cell.combination for result in self.cells):
            runs = [result for result in self.cells if result.cell.combination == levels]
            least = [np.inf] * len(shown)
            for result in runs:
                least = np.minimum(least, result.F.min(axis=0, initial=np.inf)).tolist()
            values = (f"{value * factor:.5g}" for value, (_, _, factor) in zip(least, shown, strict=True))
            median = float(np.median([result.hypervolume[-1] for result in runs]))
            rows.append((levels or "all", str(len(runs)), f"{median:.5g}", *values))
        told = f"{len(self.cells)} cells, {self.unfinished} not finished; {self.origin}"
        return html.shown(f"Results of the study in {self.folder}", html.sentence(told), html.table(headers, rows))

    @property
    def units(self) -> dict[str, str]:
        """Column of the table -> its unit, for columns that have one."""
        named = {f"{kind}_{one.name}": one.unit for kind in ("least", "knee") for one in self.objectives}
        return {"seconds": "s", "cpu_seconds": "s"} | named

    def levels(self, factor: str) -> tuple[Any, ...]:
        """Levels of a factor as the table has them: their values where all are numbers, else their labels."""
        levels = self.record.factors[factor]
        numeric = all(isinstance(level.value, int | float) and not isinstance(level.value, bool) for level in levels)
        if not numeric:
            return tuple(level.label for level in levels)
        whole = all(isinstance(level.value, int) for level in levels)
        return tuple(level.value if whole else float(level.value) for level in levels)

    def table(self) -> pd.DataFrame:
        """One row per finished cell: factors, repeat, seed, effort and results in SI units; see :attr:`units`."""
        import pandas as pd

        names = [one.name for one in self.objectives]
        rows = []
        for result in self.cells:
            row: dict[str, Any] = {"cell": result.cell.name} | self._levels_of(result.cell)
            row |= {"repeat": result.cell.repeat, "seed": result.cell.seed}
            row |= {"hypervolume": result.hypervolume[-1], "generations": result.generations}
            row |= {"evaluations": int(result.evaluations[-1]), "seconds": result.seconds}
            row |= {"cpu_seconds": result.cpu_seconds}
            row |= {"front_size": len(result.F), "failures": result.failures}
            least = result.F.min(axis=0) if len(result.F) else np.full(len(names), np.nan)
            row |= {f"least_{name}": float(value) for name, value in zip(names, least, strict=True)}
            row |= {f"knee_{name}": float(value) for name, value in zip(names, result.knee, strict=True)}
            rows.append(row)
        return pd.DataFrame(rows)

    def dataset(self) -> xr.Dataset:
        """The table as a dataset whose dimensions are the factors and ``repeat``; NaN where a cell is not finished.

        ``hypervolume_history`` and ``evaluations_history`` also have the dimension ``generation``. ``front`` contains
        the points of all fronts one after another, and ``front_cell`` names the cell of each point.
        """
        import pandas as pd
        import xarray as xr

        table = self.table().drop(columns="cell").set_index([*self.record.factors, "repeat"])
        data: xr.Dataset = xr.Dataset.from_dataframe(table)
        for name in ("hypervolume", "evaluations"):
            columns = [pd.Series(getattr(result, name), dtype=np.float64) for result in self.cells]
            history = pd.concat(columns, axis=1, keys=table.index).rename_axis(index="generation")
            history.index += 1
            data[f"{name}_history"] = history.unstack().to_xarray()
        order = {factor: list(self.levels(factor)) for factor in self.record.factors}
        data = data.reindex(order | {"repeat": np.arange(1, self.record.repeats + 1)})
        points = np.concatenate([result.F for result in self.cells])
        owners = [result.cell.name for result in self.cells for _ in range(len(result.F))]
        data["front"] = (("point", "objective"), points)
        data = data.assign_coords(
            objective=[one.name for one in self.objectives],
            front_cell=("point", np.array(owners, dtype=object)),
            objective_unit=("objective", [one.unit for one in self.objectives]),
        )
        for name, unit in self.units.items():
            data[name].attrs["units"] = unit
        data["hypervolume"].attrs["long_name"] = "share of the reference box"
        data.attrs = {"title": "trajevo study", "problem": self.record.problem or "via-points", "box": str(self.origin)}
        return data

    @property
    def origin(self) -> str:
        """Box of the hypervolume in one sentence."""
        if self.box is None:
            return "no cell has found anything feasible"
        corners = (", ".join(f"{value:.6g}" for value in corner) for corner in (self.box.lower, self.box.upper))
        return "hypervolume: share of the box from ({}) to ({}), {}".format(*corners, self.box.origin)

    def save(self, folder: str | Path | None = None) -> tuple[Path, Path]:
        """Write the table, with units in its header, and the dataset.

        Args:
            folder: folder to write to; the study's folder if None.

        Returns:
            The files: ``results.csv`` and ``results.nc`` (netCDF-4).

        Raises:
            InvalidInputError: they cannot be written.
        """
        place = self.folder if folder is None else Path(folder)
        units = {name: f"{name} [{unit}]" for name, unit in self.units.items()}
        stream = io.StringIO()
        table = self.table().map(lambda value: cell(value) if isinstance(value, str) else value)
        table.rename(columns=units).to_csv(stream, index=False)
        try:
            place.mkdir(parents=True, exist_ok=True)
            write_whole(place / TABLE_FILE, stream.getvalue().encode())
            write_whole(place / DATASET_FILE, self.dataset().to_netcdf(engine="netcdf4", format="NETCDF4"))
        except OSError as error:
            raise InvalidInputError(f"{place}: the results cannot be written there: {why_not(error)}") from error
        return place / TABLE_FILE, place / DATASET_FILE

    def display(self, objective: int) -> tuple[str, str, float]:
        """Name of an objective, the unit in which it is shown, and the factor from SI to this unit."""
        one = self.objectives[objective]
        return one.name, *display(one.unit, angle=self.angle, length=self.length)

    def _levels_of(self, cell: Cell) -> dict[str, Any]:
        found = {}
        for factor, label in cell.labels.items():
            labels = [level.label for level in self.record.factors[factor]]
            found[factor] = self.levels(factor)[labels.index(label)]
        return found
