import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import netCDF4
import numpy as np
import pytest
import xarray as xr

from tests.helpers import UNDRAWN, forked, impossible, refused, small_problem, trajevo
from trajevo import Front, load_robot, optimise
from trajevo.exporters.export import export, extension, is_exported
from trajevo.exporters.netcdf import MAGIC, dataset
from trajevo.problems import PointingMechanism

GUIDE = Path(__file__).parents[2] / "docs/how_to/other_programs.md"
SMALL = {"seed": 1, "generations": 8, "population": 20, "progress": False}


@pytest.fixture(scope="module")
def pointing() -> Front:
    return optimise(PointingMechanism(), **SMALL, polish=False)


def test_the_same_front_gives_the_same_content(pointing):
    first, second = (dataset(pointing) for _ in range(2))
    xr.testing.assert_identical(first, second)


def test_files_are_known_again_and_other_netcdf_is_not(pointing, tmp_path):
    assert extension("netcdf") == "nc"
    assert is_exported(export(pointing, tmp_path / "front.nc", format="netcdf"))
    for kind in ("NETCDF4", "NETCDF3_CLASSIC"):
        with netCDF4.Dataset(tmp_path / "mine.nc", "w", format=kind) as mine:
            mine.createDimension("x", 2)
        assert not is_exported(tmp_path / "mine.nc")
    whole = (tmp_path / "front.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    assert not is_exported(tmp_path / "cut.nc")


def test_a_write_that_fails_leaves_the_older_file(pointing, tmp_path):
    file = export(pointing.knee(), tmp_path / "front.nc", format="netcdf")
    before = file.read_bytes()
    pointing.save(tmp_path / "front.json")
    front = Front.load(tmp_path / "front.json")

    def write():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        refused(lambda: export(front, file, format="netcdf"), f"^{file}: cannot be written: File too large")

    assert forked(write) == 0
    assert file.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["front.json", "front.nc"]


def test_what_is_no_file_is_written_into_and_stays(pointing, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    reader = subprocess.Popen(["cat", tmp_path / "pipe"], stdout=subprocess.PIPE)
    try:
        export(pointing.knee(), tmp_path / "pipe", format="netcdf")
        assert (tmp_path / "pipe").is_fifo()
        assert reader.communicate(timeout=60)[0].startswith(MAGIC)
    finally:
        reader.kill()
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


def test_the_lines_of_the_guide_run(pointing, tmp_path, monkeypatch):
    mpl.use("Agg")
    (tmp_path / "runs" / "task").mkdir(parents=True)
    export(pointing, tmp_path / "runs" / "task" / "front.nc", format="netcdf")
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"```python\n(import xarray.*?)```", GUIDE.read_text(), re.DOTALL)
    names = {}
    exec(code, names)
    axes = plt.gca()
    try:
        assert axes.get_ylabel() == "effort of the joint [N*m]"
        assert axes.get_xlabel() == "time from the start [s]"
        assert [text.get_text() for text in axes.get_legend().get_texts()] == ["joint_1", "joint_2"]
        np.testing.assert_allclose(axes.lines[0].get_xdata()[-1], pointing.knee().F["time"])
    finally:
        plt.close("all")
        names["front"].close()


# --- bad input


@pytest.mark.parametrize("format", ["csv", "json", "ros2", "moveit"])
def test_a_front_is_refused_where_one_solution_fits(pointing, tmp_path, format):
    says = rf"source: the format '{format}' holds one solution, as front.knee\(\), got a front of {len(pointing)}"
    refused(lambda: export(pointing, tmp_path / "x", format=format), says)
    refused(lambda: export(5, tmp_path / "x", format=format), "holds one solution, as front.knee\\(\\), got int")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"angle": "deg"}, "angle: the format 'netcdf' is in rad, got 'deg'"),
        ({"step": 0.0}, "step: expected a positive time"),
        ({"step": 1e-7}, r"step: 1e-07 s gives over 10000000 samples of [0-9]+ motions of up to [0-9.]+ s"),
    ],
)
def test_bad_settings_are_refused(pointing, tmp_path, arguments, says):
    refused(lambda: export(pointing, tmp_path / "x.nc", format="netcdf", **arguments), says)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("samples", [1, 0, -3, 2.0, True, None, "a"])
def test_bad_samples_are_refused(pointing, samples):
    refused(lambda: dataset(pointing, samples=samples), "samples: expected a whole number of at least 2")


def test_too_many_samples_are_refused(pointing):
    says = f"samples: 10000000 of {len(pointing)} motions are over 10000000 instants"
    refused(lambda: dataset(pointing, samples=10_000_000), says)


@pytest.mark.parametrize("source", [5, None, "runs/first"])
def test_what_is_no_front_is_refused(source, tmp_path):
    refused(lambda: dataset(source), "source: expected a front or a solution, got ")
    refused(lambda: export(source, tmp_path / "x.nc", format="netcdf"), "source: expected a front or a solution")


def test_an_empty_front_says_why(tmp_path):
    problem = small_problem(constraints=(impossible(load_robot("pointing_mechanism"), 0.1),))
    empty = optimise(problem, **SMALL, polish=False)
    refused(lambda: dataset(empty), "the front is empty: nothing feasible was found")
    refused(lambda: export(empty, tmp_path / "x.nc", format="netcdf"), "the front is empty")


def test_places_that_cannot_be_written_are_named(pointing, tmp_path):
    (tmp_path / "folder").mkdir()
    for place in (tmp_path / "no" / "front.nc", tmp_path / "folder"):
        refused(lambda place=place: export(pointing.knee(), place, format="netcdf"), f"{place}: cannot be written: ")
    refused(lambda: export(pointing.knee(), "", format="netcdf"), "file: expected the path of a file, got ''")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


# --- the command line


def test_the_command_writes_all_solutions_or_one(pointing, tmp_path):
    pointing.save(tmp_path / "front.json")
    result = trajevo("export", tmp_path, "--format", "netcdf")
    prove = f"next: trajevo certify {tmp_path} --all proves at every instant that limits are kept\n"
    assert (result.returncode, result.stdout) == (0, f"written: {tmp_path / 'front.nc'}\n{prove}"), result.stderr
    with netCDF4.Dataset(tmp_path / "front.nc") as content:
        assert len(content["solution"]) == len(pointing)
    result = trajevo("export", tmp_path, "--format", "netcdf", "--solution", "utopia", "--step", "0.5")
    assert result.returncode == 0, result.stderr
    with netCDF4.Dataset(tmp_path / "utopia.nc") as content:
        assert content["solution"][:].tolist() == [pointing.utopia().index]
        assert np.diff(content["instant"][:]).max() <= 0.5
    result = trajevo("export", tmp_path, "--format", "csv")
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith(f"written: {tmp_path / 'knee.csv'}\nnext: trajevo certify {tmp_path}")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--solution", "best"], "error: unknown solution 'best'; known: a row from 0 to"),
        (["--angle", "deg"], "error: angle: the format 'netcdf' is in rad, got 'deg'"),
        (["--out", "/no/such/front.nc"], "error: /no/such/front.nc: cannot be written: No such file or directory"),
    ],
)
def test_the_command_refuses_with_a_sentence(pointing, tmp_path, options, says):
    pointing.save(tmp_path / "front.json")
    result = trajevo("export", tmp_path, "--format", "netcdf", *options)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith(says)
    assert "Traceback" not in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["front.json"]


def test_a_new_run_removes_the_old_netcdf_and_keeps_others(tmp_path):
    small = ("--generations", "2", "--population", "20", "--no-polish", *UNDRAWN, "--quiet")
    assert trajevo("solve", "pointing", "--out", tmp_path, *small).returncode == 0
    assert trajevo("export", tmp_path, "--format", "netcdf").returncode == 0
    with netCDF4.Dataset(tmp_path / "mine.nc", "w") as mine:
        mine.createDimension("x", 2)
    assert trajevo("solve", "pointing", "--out", tmp_path, "--overwrite", *small).returncode == 0
    assert [path.name for path in tmp_path.glob("*.nc")] == ["mine.nc"]


def test_importing_the_command_line_loads_neither_xarray_nor_netcdf():
    script = "import sys, trajevo.cli.main; print({'xarray', 'netCDF4', 'pandas'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"
