"""Folders that were written before the package had rooms are read, shown, gone on with and exported.

``data/old_runs.zip``: an interrupted run of the pointing mechanism, one of the hybrid manipulator, a worked task,
a study of which one cell of two is finished, all of eight individuals; and what going on with the runs gave there.
"""

import json
import zipfile
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import refused, trajevo
from trajevo import collect, optimise, read_run, resume, study_standing

OLD = Path(__file__).parent / "data" / "old_runs.zip"
RUNS = {"pointing_interrupted": None, "hybrid": 4, "ur5_pick_and_place": 4}


@pytest.fixture
def old(tmp_path):
    with zipfile.ZipFile(OLD) as archive:
        archive.extractall(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", RUNS)
def test_an_old_run_is_read_shown_and_exported(name, old):
    front = read_run(old / name)
    assert len(front) >= 4
    assert front.run.interrupted == (name == "pointing_interrupted")
    # Energies of old runs were sums over the samples, which differ by more than rounding where they are no paper's.
    other = name == "ur5_pick_and_place"
    with pytest.warns(UserWarning, match="other formulas .*energy differs by 1.3 %") if other else nullcontext():
        F = front.problem.evaluate(front.X)[0]
    for k, objective in enumerate(front.objective_names):
        np.testing.assert_allclose(F[:, k], front.F[:, k], rtol=0.02 if objective == "energy" else 1e-9)
    shown = trajevo("show", old / name)
    assert shown.returncode == 0, shown.stderr
    assert "knee" in shown.stdout
    exported = trajevo("export", old / name, "--solution", "knee", "--format", "csv")
    assert exported.returncode == 0, exported.stderr


def test_an_old_run_with_other_energies_is_not_gone_on_with(old):
    with pytest.warns(UserWarning, match="begun with other versions"):
        refused(
            lambda: resume(old / "ur5_pick_and_place", generations=4, progress=False),
            r"begun with formulas \w+ of trajevo, here they are 5: energy of an individual on record is [\d.]+ J, here",
        )
    front = read_run(old / "ur5_pick_and_place")
    with pytest.warns(UserWarning, match="energy differs by"):
        problem = front.problem
    again = optimise(problem, seed=1, initial=front.X, generations=2, population=20, polish=False, progress=False)
    assert len(again)


@pytest.mark.parametrize("name", ["pointing_interrupted", "hybrid"])
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_an_old_run_is_gone_on_with_as_it_would_have_been(name, old):
    expected = json.loads((old / "resumed.json").read_text(encoding="utf-8"))[name]
    front = resume(old / name, generations=RUNS[name], progress=False)
    np.testing.assert_allclose(front.F, expected, rtol=1e-9)


def test_an_old_study_is_gone_on_with(old):
    assert str(study_standing(old / "study")) == "2 cells: 1 finished, 1 waiting"
    done = trajevo("study", "run", old / "study", "--quiet")
    assert done.returncode == 0, done.stderr
    assert collect(old / "study").table()["interpolant"].tolist() == ["smooth", "quintic"]


def test_old_folders_hold_no_place_of_the_machine_that_wrote_them():
    with zipfile.ZipFile(OLD) as archive:
        for name in archive.namelist():
            content = archive.read(name)
            assert not any(place in content for place in (b"/tmp", b"/home", b"/root", b"/Users", b"/usr")), name
    assert OLD.stat().st_size < 80_000
