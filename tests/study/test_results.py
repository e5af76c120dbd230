"""What a study has found: the fronts' own numbers, hypervolumes of one box, and levels compared over matched cells."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.stats import mannwhitneyu
from typer.testing import CliRunner

from tests.helpers import mostly_long, refused, small_problem, trajevo
from trajevo import Front, load_problem, optimise
from trajevo.cli.init import write_example
from trajevo.cli.study import app
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.front.hypervolume import hypervolume
from trajevo.study.collection import collect, common_box
from trajevo.study.definition import Study, load_study
from trajevo.study.folder import StudyFolder
from trajevo.study.plots import attained, attainment, attainments, hypervolume_bands, hypervolume_boxes
from trajevo.study.report import write_study
from trajevo.study.results import CellResult
from trajevo.study.run import run_study
from trajevo.study.statistics import compare_levels, holm, signed_rank

SIZES = {"seed": 5, "repeats": 3, "generations": 6, "population": 12}

#: Depression scores, the example of R's ``wilcox.test``: V = 40, p-value = 0.01953 one-sided.
FIRST = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
SECOND = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]


def ran(folder, problem="pointing", **changes):
    varied = {"polish": False} if "polish" not in changes.get("factors", {}) else {}
    study = Study(problem, **(SIZES | changes | {"fixed": varied | changes.get("fixed", {})}))
    assert run_study(study, folder, progress=False).finished
    return study


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("results") / "study"
    ran(made, factors={"interpolant": ["smooth", "quintic"], "crossover_probability": [0.5, 1]})
    return made


@pytest.fixture(scope="module")
def results(folder):
    return collect(folder)


@pytest.fixture(scope="module")
def without_reference(tmp_path_factory):
    """A problem that names no reference point, so that every run has its own."""
    made = tmp_path_factory.mktemp("results") / "study"
    points = [[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]]
    ran(
        made,
        "via-points",
        fixed={"robot": "pointing_mechanism", "points": points, "duration_bounds": [1.0, 10.0]},
        factors={"interpolant": ["quintic_spline", "septic_spline"]},
        repeats=2,
    )
    return made


def with_volumes(results, volume):
    """Results whose final hypervolumes are those of a function of the cell."""
    cells = tuple(replace(one, hypervolume=np.array([0.0, volume(one.cell)])) for one in results.cells)
    return replace(results, cells=cells)


def test_the_table_has_the_numbers_of_the_fronts(folder, results):
    table = results.table()
    assert list(table.columns[:5]) == ["cell", "interpolant", "crossover_probability", "repeat", "seed"]
    assert len(table) == 12
    for row in table.to_dict("records"):
        front = Front.load(StudyFolder(folder).cell(row["cell"]) / "front.json")
        assert row["seed"] == front.run.seed
        assert row["hypervolume"] == front.history.hypervolume[-1]
        assert row["evaluations"] == front.run.evaluations == front.run.settings["starts_evaluations"] + 72
        assert (row["seconds"], row["failures"], row["front_size"]) == (front.run.seconds, 0, len(front))
        for name in front.objective_names:
            assert row[f"least_{name}"] == front.least(name).F[name]
            assert row[f"knee_{name}"] == front.knee().F[name]
    assert results.units["knee_jerk"] == "rad/s^3"
    assert results.origin.endswith("the reference point of all runs")


def test_runs_with_reference_points_of_their_own_are_measured_in_one_box(without_reference):
    results = collect(without_reference)
    assert "a tenth beyond the worst points of all fronts" in results.origin
    worst = np.concatenate([one.F for one in results.cells]).max(axis=0)
    assert np.allclose(results.box.upper, 1.1 * worst, rtol=1e-15)
    for one in results.cells:
        front = Front.load(StudyFolder(without_reference).cell(one.cell.name) / "front.json")
        assert front.history.reference_point != tuple(results.box.upper)
        assert one.hypervolume[-1] == pytest.approx(hypervolume(front.F, results.box.upper), rel=1e-12)
        settings = front.record.settings | {"reference_point": results.box.upper.tolist()}
        same = load_problem("via-points", **settings)
        again = optimise(same, seed=one.cell.seed, generations=6, population=12, progress=False, polish=False)
        assert np.allclose(one.hypervolume, again.history.hypervolume, rtol=1e-12, atol=0.0)


def test_without_individuals_a_history_in_another_box_is_unknown_but_for_its_end(without_reference, tmp_path):
    copied = tmp_path / "study"
    (copied / "cells").mkdir(parents=True)
    (copied / "study.json").write_bytes((without_reference / "study.json").read_bytes())
    for cell in StudyFolder(without_reference).standings():
        StudyFolder(copied).cell(cell.cell.name).mkdir()
        front = StudyFolder(without_reference).cell(cell.cell.name) / "front.json"
        (StudyFolder(copied).cell(cell.cell.name) / "front.json").write_bytes(front.read_bytes())
    before, after = collect(without_reference), collect(copied)
    for one, other in zip(before.cells, after.cells, strict=True):
        assert one.hypervolume[-1] == other.hypervolume[-1]
        assert np.isnan(other.hypervolume[:-1]).all()


def test_objectives_that_are_not_positive_have_a_box_too():
    def earlier(rollout):
        return -rollout.trajectory.duration

    objectives = (Objective("early", "s", "t", earlier), Objective("jerk", "rad/s^3", "t", summed_rms_jerk))
    problem = small_problem(objectives=objectives)
    fronts = [
        optimise(problem, seed=seed, generations=4, population=12, progress=False, polish=False) for seed in (1, 2)
    ]
    box = common_box(fronts)
    assert box.origin == "from the best points of all fronts to a tenth beyond the worst"
    F = np.concatenate([front.F for front in fronts])
    assert (box.lower == F.min(axis=0)).all()
    assert np.allclose(box.upper, F.max(axis=0) + 0.1 * np.ptp(F, axis=0))
    assert 0.0 < min(box.share(front.F) for front in fronts) <= box.share(F) <= 1.0


def test_fronts_without_a_point_have_no_box():
    objectives = (
        Objective("time", "s", "t", total_time),
        Objective("nothing", "1", "t", lambda rollout: np.full(len(rollout.trajectory), np.nan)),
    )
    front = optimise(
        small_problem(objectives=objectives), seed=1, generations=2, population=8, progress=False, polish=False
    )
    assert len(front) == 0
    assert common_box([front]) is None


def test_a_level_for_which_no_motion_is_possible_is_a_result_too(tmp_path):
    """Segments of 1.5 s are shorter than the least times, those of 10 s are not: the former are not searched."""
    levels = {"duration_bounds": [[1.0, 1.5], [1.0, 10.0]]}
    ran(tmp_path / "study", factors=levels, repeats=1)
    impossible, possible = (result for result in collect(tmp_path / "study").cells)
    assert (len(impossible.F), impossible.generations) == (0, 0)
    assert (impossible.evaluations.tolist(), impossible.hypervolume.tolist()) == ([0.0], [0.0])
    assert len(possible.F) > 0
    write_study(collect(tmp_path / "study"))
    assert (tmp_path / "study" / "results.csv").exists()


def test_different_objectives_are_not_compared(tmp_path):
    points = [[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]]
    ran(
        tmp_path / "study",
        "via-points",
        fixed={"robot": "pointing_mechanism", "points": points, "duration_bounds": [1.0, 10.0]},
        factors={"objectives": [["time", "jerk"], ["time", "acceleration"]]},
        repeats=1,
        generations=2,
    )
    says = r"cells with different objectives cannot be compared: objectives=time\+jerk,repeat=01 has time \[s\], jerk"
    refused(lambda: collect(tmp_path / "study"), says)


def test_unfinished_cells_are_counted_and_none_is_refused(tmp_path, folder):
    study = Study("pointing", **SIZES, factors={"interpolant": ["smooth", "quintic"]}, fixed={"polish": False})
    place = StudyFolder(tmp_path / "study")
    place.keep(study.record)
    refused(lambda: collect(tmp_path / "study"), "no cell of the study is finished")
    for cell in study.cells[:4]:
        problem = load_problem("pointing", interpolant=cell.labels["interpolant"])
        optimise(
            problem,
            seed=cell.seed,
            generations=6,
            population=12,
            progress=False,
            out=place.cell(cell.name),
            polish=False,
        )
    results = collect(tmp_path / "study")
    assert (len(results.cells), results.unfinished) == (4, 2)
    data = results.dataset()
    assert data.hypervolume.shape == (2, 3)
    assert np.isnan(data.hypervolume.sel(interpolant="quintic").values).sum() == 2
    (only,) = compare_levels(results, "interpolant")
    assert only.pairs == 1
    file = place.cell(study.cells[0].name) / "front.json"
    other = json.loads(file.read_text())
    other["run"]["seed"] = 12
    file.write_text(json.dumps(other))
    refused(lambda: collect(tmp_path / "study"), "holds another run than this cell's: seed 12, not ")


@pytest.mark.parametrize("repeats", mostly_long([1, 2], 1))
def test_polished_runs_are_collected_with_what_polishing_found_and_took(tmp_path, repeats):
    points = [[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]]
    fixed = {"robot": "pointing_mechanism", "points": points, "duration_bounds": [1.0, 10.0], "starts": "random"}
    fixed |= {} if repeats > 1 else {"interpolant": "quintic_spline"}  # which is polished in a third of the time
    ran(tmp_path / "study", "via-points", fixed=fixed, factors={"polish": [False, True]}, repeats=repeats)
    results = collect(tmp_path / "study")
    plain, polished = results.cells[:repeats], results.cells[repeats:]
    for one in plain:
        assert len(one.hypervolume) == one.generations == 6
    for one in polished:
        assert (len(one.hypervolume), one.generations) == (7, 6)
        assert one.hypervolume[6] > one.hypervolume[5] > 0.0
        assert one.evaluations[6] > one.evaluations[5] == 72
        front = Front.load(StudyFolder(tmp_path / "study").cell(one.cell.name) / "front.json")
        assert one.hypervolume[6] == results.box.share(front.F)
        assert one.cpu_seconds == front.run.cpu_seconds[-1]
    table = results.table()
    assert list(table["evaluations"]) == [int(one.evaluations[-1]) for one in results.cells]
    assert (table.groupby("polish")["hypervolume"].median().diff().iloc[1]) > 0.0


def test_files_open_elsewhere(results, tmp_path):
    table, dataset = results.save(tmp_path)
    read = pd.read_csv(table)
    assert np.array_equal(read["knee_time [s]"], results.table()["knee_time"])
    with netCDF4.Dataset(dataset) as opened:
        assert opened["knee_time"].units == "s"
        assert opened["hypervolume"].dimensions == ("interpolant", "crossover_probability", "repeat")
    with xr.open_dataset(dataset) as opened:
        own = opened.sel(interpolant="quintic", crossover_probability=0.5, repeat=2)
        expected = results.cells[7]
        assert expected.cell.name == "interpolant=quintic,crossover_probability=0.5,repeat=02"
        assert float(own.hypervolume) == expected.hypervolume[-1]
        assert np.array_equal(own.hypervolume_history, expected.hypervolume)
        assert np.array_equal(own.evaluations_history, expected.evaluations)
        points = opened.front[opened.front_cell.values == expected.cell.name]
        assert np.array_equal(points, expected.F)
        assert list(opened.objective.values) == ["time", "acceleration", "jerk"]


def test_a_study_of_repeats_alone_and_one_of_generations_are_collected(tmp_path):
    ran(tmp_path / "repeats", repeats=2)
    data = collect(tmp_path / "repeats").dataset()
    assert data.hypervolume.dims == ("repeat",)
    ran(tmp_path / "sizes", generations=None, population=None, factors={"generations": [2, 5], "population": [8, 12]})
    results = collect(tmp_path / "sizes")
    assert results.dataset().hypervolume_history.shape == (2, 2, 3, 5)
    assert np.isnan(results.dataset().hypervolume_history.sel(generations=2).values).sum() == 2 * 3 * 3
    (better,) = compare_levels(results, "generations")
    assert (better.first, better.second, better.pairs) == (2, 5, 6)


def test_the_signed_rank_test_is_that_of_r():
    effect, p = signed_rank(FIRST, SECOND)
    assert effect == pytest.approx((40 - 5) / 45, rel=1e-14)
    assert p == pytest.approx(2 * 0.01953125, rel=1e-14)
    backwards = signed_rank(SECOND, FIRST)
    assert backwards == (pytest.approx(-effect), pytest.approx(p))


def test_equal_pairs_tell_nothing():
    assert signed_rank(FIRST, FIRST) == (0.0, 1.0)
    effect, p = signed_rank([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0], [0.0, 0.5, 1.2, 1.9, 2.7, 3.4, 9.0])
    assert effect == 1.0
    assert 0.02 < p < 0.04


def test_holm_is_that_of_r():
    assert holm([0.01, 0.04, 0.03, 0.02]) == pytest.approx([0.04, 0.06, 0.06, 0.06])
    assert holm([0.5, 0.001, 0.6]) == pytest.approx([1.0, 0.003, 1.0])
    assert len(holm([])) == 0


def test_matching_finds_a_difference_that_another_factor_hides(results):
    noise = dict(
        zip([one.cell.name for one in results.cells], np.random.default_rng(1).normal(0, 1e-3, 12), strict=True)
    )

    def volume(cell):
        heavy = 0.3 if cell.labels["crossover_probability"] == "1" else 0.0
        return 0.5 - heavy + 0.01 * (cell.labels["interpolant"] == "smooth") + noise[cell.name]

    made = with_volumes(results, volume)
    (found,) = compare_levels(made, "interpolant")
    assert (found.first, found.second, found.pairs) == ("smooth", "quintic", 6)
    assert found.difference == pytest.approx(0.01, abs=2e-3)
    assert (found.effect, found.p, found.p_holm) == (1.0, 0.03125, 0.03125)
    table = made.table()
    apart = [table[table["interpolant"] == level]["hypervolume"] for level in ("smooth", "quintic")]
    assert mannwhitneyu(*apart).pvalue > 0.1


def test_levels_and_measures_that_are_not_there_are_refused(results):
    refused(
        lambda: compare_levels(results, "payload"), "unknown factor 'payload'; known: crossover_probability, interp"
    )
    refused(
        lambda: compare_levels(results, "interpolant", measure="speed"),
        "unknown measure 'speed'; known: cpu_seconds, evaluations",
    )
    half = replace(results, cells=results.cells[:6])
    refused(lambda: compare_levels(half, "interpolant"), "no finished cells match in all but smooth and quintic")
    (by_time,) = compare_levels(results, "interpolant", measure="least_time")
    assert by_time.pairs == 6


def run_of(F, number=0):
    one = np.array(F, dtype=float).reshape(-1, 2)
    return CellResult(number, one, one, np.array([1.0]), np.array([0.0]), 1, 0.0, 0.0, 0)


def test_attainment_by_hand_counts_runs_that_found_nothing():
    group = [run_of([[1, 3], [3, 1]]), run_of([[2, 2]]), run_of([[2, 4], [4, 2]]), run_of([])]
    best, half, most = attained(group, [0, 1])
    assert sorted(map(tuple, best)) == [(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)]
    assert sorted(map(tuple, half)) == [(2.0, 3.0), (3.0, 2.0)]
    assert sorted(map(tuple, most)) == [(2.0, 4.0), (4.0, 2.0)]


def test_pictures_show_the_numbers(results):
    ax = hypervolume_boxes(results, "interpolant")
    assert [label.get_text() for label in ax.get_xticklabels()] == ["smooth", "quintic"]
    medians = [
        line.get_ydata()[0] for line in ax.lines if line.get_color() == "black" and len(set(line.get_ydata())) == 1
    ]
    table = results.table()
    for level in ("smooth", "quintic"):
        assert any(np.isclose(table[table["interpolant"] == level]["hypervolume"].median(), medians))
    assert hypervolume_bands(results, "interpolant").get_xlabel() == "individuals evaluated"
    cells = tuple(replace(one, evaluations=12 * np.arange(1, 7)) for one in results.cells)
    ax = hypervolume_bands(replace(results, cells=cells), "interpolant")
    assert ax.get_xlabel() == "generation"
    smooth = [one.hypervolume for one in results.cells if one.cell.labels["interpolant"] == "smooth"]
    assert np.allclose(ax.lines[0].get_ydata(), np.median(smooth, axis=0))
    panels = attainments(results, "interpolant")
    assert [panel.get_ylabel() for panel in panels] == ["acceleration [deg/s²]", "jerk [deg/s³]", "jerk [deg/s³]"]
    for panel in panels:
        for line in panel.lines:
            x, y = line.get_data()
            assert (np.diff(x) >= 0.0).all()
            assert (np.diff(y) <= 0.0).all()
    same = plt.subplots()[1]
    assert hypervolume_boxes(results, ax=same) is same


def test_bands_of_different_populations_count_individuals(tmp_path):
    ran(tmp_path / "study", population=None, fixed={"starts": "random"}, factors={"population": [8, 16]})
    results = collect(tmp_path / "study")
    ax = hypervolume_bands(results, "population")
    assert ax.get_xlabel() == "individuals evaluated"
    assert [list(line.get_xdata()) for line in ax.lines] == [[8, 16, 24, 32, 40, 48], [16, 32, 48, 64, 80, 96]]


def test_pictures_that_cannot_be_drawn_are_refused(results):
    says = "attainment surfaces are drawn for 2 objectives; name two of time, acceleration, jerk"
    refused(lambda: attainment(results), says)
    refused(lambda: attainment(results, objectives=("time", "time")), says)
    refused(lambda: attainment(results, objectives=("time", "cost")), "unknown objective 'cost'; known: acceleration")
    refused(lambda: hypervolume_boxes(results, "payload"), "unknown factor 'payload'")
    refused(lambda: attainments(results, axes=plt.subplots(1, 2)[1]), "axes: expected 3, got 2")
    nothing = replace(results, cells=tuple(replace(one, F=one.F[:0]) for one in results.cells))
    refused(lambda: attainment(nothing, objectives=("time", "jerk")), "too few runs .* have found anything feasible")
    assert nothing.table()["least_time"].isna().all()


def test_the_command_writes_tables_and_pictures(folder, tmp_path):
    result = trajevo("study", "collect", folder, "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert "12 cells finished, 0 not" in result.stdout
    assert "smooth - quintic" in result.stdout
    names = {file.relative_to(tmp_path / "out").as_posix() for file in (tmp_path / "out").rglob("*.*")}
    factors = ("interpolant", "crossover_probability")
    pictures = {f"plots/{kind}_{name}.png" for kind in ("hypervolume", "generations", "attainment") for name in factors}
    assert names == {"results.csv", "results.nc", "comparisons.csv", "study.html"} | pictures
    compared = pd.read_csv(tmp_path / "out" / "comparisons.csv")
    assert list(compared["pairs"]) == [6, 6]


def test_what_cannot_be_written_is_told(results, tmp_path):
    (tmp_path / "file").touch()
    refused(lambda: write_study(results, tmp_path / "file"), "the results cannot be written there")


def test_a_study_with_one_objective_is_collected_without_its_attainment(tmp_path):
    ran(tmp_path / "study", "hybrid", fixed={"objectives": "cost"}, repeats=1, generations=3)
    result = CliRunner().invoke(app, ["collect", str(tmp_path / "study")])
    assert result.exit_code == 0
    assert "not drawn: attainment_all.png: attainments: expected at least 2 objectives" in result.stdout


@pytest.mark.long
def test_what_the_docs_show_runs(tmp_path):
    docs = (Path(__file__).parents[2] / "docs/how_to/cluster.md").read_text()
    write_example(tmp_path / "task.toml")
    sizes = []
    for text in re.findall(r"```toml\n(.*?)```", docs, re.DOTALL):
        (tmp_path / "study.toml").write_text(text)
        sizes.append(len(load_study(tmp_path / "study.toml").cells))
    assert sizes == [40, 20, 60]
    (script,) = re.findall(r"```python\n(.*?)```", docs, re.DOTALL)
    (tmp_path / "script.py").write_text(script)
    result = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert "6 cells: 6 finished" in result.stdout
    assert (tmp_path / "runs" / "interpolants" / "plots" / "attainment_interpolant.png").exists()
