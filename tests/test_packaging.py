"""The wheel is a good citizen: one package, found by name from any folder, beside any packages of the user's own."""

import fcntl
import json
import os
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest

import trajevo
from tests.docs.blocks import blocks, compare
from trajevo.base import jit

ROOT = Path(__file__).parents[1]
LINE = 20 * "=" + "\n"
COMMANDS = """
import json, sys
from trajevo.cli.main import main
for arguments in json.loads(sys.argv[1]):
    sys.argv[1:] = arguments
    try:
        main()
    except SystemExit as ended:
        assert not ended.code, ended.code
    print(20 * "=")
"""


@dataclass(frozen=True)
class Installed:
    """The wheel, installed where nothing of the checkout can be found, with the packages of the tests beside it."""

    home: Path

    @property
    def python(self) -> Path:
        return self.home / "bin" / "python"

    @property
    def package(self) -> Path:
        (package,) = self.home.glob("lib/python*/site-packages/trajevo")
        return package

    def run(self, *command, cwd):
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
        # Loops are compiled for each installation, which takes longer than all else here; below, one of them is.
        environment |= {jit.CHOICE: "numpy", "MPLBACKEND": "Agg", "COLUMNS": "160"}
        result = subprocess.run(
            [str(self.python), *map(str, command)], cwd=cwd, env=environment, capture_output=True, text=True
        )
        assert result.returncode == 0, result.stdout + result.stderr
        return result.stdout

    def trajevo(self, *arguments, cwd):
        return self.run(self.home / "bin" / "trajevo", *arguments, cwd=cwd)

    def commands(self, *commands, cwd):
        """What several commands print, in one process, which spares their starts."""
        return self.run("-c", COMMANDS, json.dumps(commands), cwd=cwd).split(LINE)[:-1]

    def script(self, text, *, cwd):
        file = cwd / "my_script.py"
        file.write_text(text, encoding="utf-8")
        return self.run(file.name, cwd=cwd)


def build(kind, source, folder):
    """A distribution of a source folder, built by what is installed, without network."""
    command = [sys.executable, "-m", "build", f"--{kind}", "--no-isolation", "--outdir", str(folder), str(source)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = Path(folder).glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return built


def install(wheel, home):
    """An environment with the wheel; links to all that the tests have, trajevo excepted, stand for its dependencies."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(home)], check=True)
    installed = Installed(home)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(installed.python)]
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", "--no-compile", str(wheel)], check=True)
    site = installed.package.parent
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if not (site / entry.name).exists() and not entry.name.lstrip("_").startswith("trajevo"):
            (site / entry.name).symlink_to(entry)


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """A folder that all workers of this session share, with the wheel and an environment that has it."""
    shared, session = tmp_path_factory.getbasetemp(), os.environ.get("PYTEST_XDIST_TESTRUNUID")
    folder = (shared.parent if session else shared) / f"packaging-{session or 'alone'}"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "ready").exists():
            install(build("wheel", ROOT, folder), folder / "environment")
            (folder / "ready").touch()
    return folder


@pytest.fixture
def installed(built):
    return Installed(built / "environment")


def content(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_a_wheel_holds_one_package_and_all_that_it_needs(built):
    (wheel,) = built.glob("*.whl")
    names = set(content(wheel))
    assert {name.partition("/")[0] for name in names} == {"trajevo", f"trajevo-{trajevo.__version__}.dist-info"}
    assert names >= {f"trajevo/{name}" for name in ("py.typed", "problems/py.typed", "problems/geminism.dat")}
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    for folder, place in (("trajevo", ""), *((name, "trajevo/") for name in ("problems", "robots", "notebooks"))):
        own = {place + name for name in tracked if name.startswith(f"{folder}/") and (ROOT / name).is_file()}
        assert own <= names, own - names


@pytest.mark.long
def test_a_source_distribution_gives_the_same_wheel(built, tmp_path):
    with tarfile.open(build("sdist", ROOT, tmp_path)) as archive:
        archive.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    (wheel,) = built.glob("*.whl")
    again, direct = content(build("wheel", source, tmp_path / "again")), content(wheel)
    assert set(again) == set(direct)
    assert [name for name in direct if direct[name] != again[name]] == []


def test_commands_work_in_an_empty_folder(installed, tmp_path):
    before = {file for file in installed.package.rglob("*") if "__pycache__" not in file.parts}
    assert installed.trajevo("--version", cwd=tmp_path) == f"trajevo {trajevo.__version__}\n"
    assert not any(tmp_path.iterdir())
    small = ("--generations", "2", "--population", "8", "--no-polish", "--quiet", "--no-pictures")
    told, checked, _ = installed.commands(
        ["list"], ["check-robot", "hybrid_manipulator"], ["solve", "pointing", *small], cwd=tmp_path
    )
    assert "pointing" in told
    assert "puma560" in told
    assert "0 errors" in checked
    assert [entry.relative_to(tmp_path).as_posix() for entry in tmp_path.glob("*")] == ["runs"]
    assert [run.name for run in (tmp_path / "runs").iterdir()] == ["pointing"]
    assert {file for file in installed.package.rglob("*") if "__pycache__" not in file.parts} == before


def test_an_example_is_copied_with_what_it_needs_and_solved(installed, tmp_path):
    names, _ = installed.commands(["examples"], ["examples", "hybrid_manipulator", "mine"], cwd=tmp_path)
    for name in ("ur5_pick_and_place", "hybrid_payloads", "05_your_own_robot"):
        assert name in names
    assert {file.name for file in (tmp_path / "mine").iterdir()} == {"hybrid_manipulator.toml", "hybrid_points.csv"}
    code = """
from trajevo import Study, load_study, load_task

copy, kept = load_task("mine/hybrid_manipulator.toml"), load_task("hybrid_manipulator")
assert copy.problem.settings == kept.problem.settings
front = kept.solve(generations=2, population=8, polish=False, progress=False, out="runs/kept")
assert len(front.history.hypervolume) == 2
study = Study(task="hybrid_manipulator", seed=1, repeats=2, factors={"payload": [1.0]})
print(len(study.cells), len(load_study("hybrid_payloads").cells))
"""
    assert installed.script(code, cwd=tmp_path) == "2 40\n"


LOOP = """
import numpy as np
from trajevo.front.archive import _join

kept, taken = np.empty(1, dtype=bool), np.empty(1, dtype=bool)
_join(np.array([[1.0, 2.0]]), np.array([[0.0, 1.0]]), kept, taken)
print(*kept, *taken, all(file.is_file() for file in _join.kept()), len(_join.kept()) > 0)
"""


@pytest.mark.skipif(find_spec("numba") is None, reason="nothing is compiled without numba")
def test_loops_of_the_wheel_are_compiled_and_kept(installed, tmp_path):
    assert installed.script(LOOP, cwd=tmp_path) == "False True True True\n"


OWN_PACKAGES = """
import multiprocessing, pickle, sys
import problems, robots, tests
import trajevo
from trajevo import load_problem, load_robot, optimise
from trajevo.problems import *


def evaluated(problem):
    import problems

    return problems.MINE, type(problem).__module__, problem.evaluate(problem.xl[None])[0].tolist()


if __name__ == "__main__":
    assert (problems.MINE, robots.MINE, tests.MINE) == ("problems", "robots", "tests")
    assert trajevo.problems is not problems
    made = [HybridManipulator(), PickAndPlace(), PointingMechanism(), TimeJerkReparameterisation(), problems.Mine()]
    made.append(ViaPointProblem(**made[-1].settings))
    assert type(load_problem("pointing")) is PointingMechanism
    assert load_robot("puma560").dof == 6
    front = optimise(made[2], seed=1, generations=2, population=8, polish=False, progress=False)
    assert len(pickle.loads(pickle.dumps(front))) == len(front)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.map(evaluated, made)
    here = [evaluated(problem) for problem in made]
    assert there == here, (there, here)
    print(*(module for _, module, _ in there))
"""


def own_packages(folder):
    """What a user's own project may hold."""
    for name in ("problems", "robots", "tests"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(f"MINE = {name!r}\n", encoding="utf-8")
    with (folder / "problems" / "__init__.py").open("a", encoding="utf-8") as file:
        file.write("from .mine import Mine\n")
    (folder / "problems" / "mine.py").write_text(
        "from trajevo.problems import ViaPointProblem\n\n\n"
        "class Mine(ViaPointProblem):\n"
        "    def __init__(self) -> None:\n"
        "        points = [[0.0] * 6, [0.2] * 6, [0.5] * 6]\n"
        "        super().__init__(robot='puma560', points=points, objectives=('time', 'energy'))\n",
        encoding="utf-8",
    )


def test_a_users_own_packages_stay_and_problems_go_to_spawned_processes(installed, tmp_path):
    own_packages(tmp_path)
    modules = installed.script(OWN_PACKAGES, cwd=tmp_path).split()
    assert modules.pop(4) == "problems.mine"
    assert all(module.startswith("trajevo.") for module in modules)


@pytest.mark.long
def test_problems_go_to_the_workers_of_a_dask_cluster(installed, tmp_path):
    own_packages(tmp_path)
    code = """
from distributed import Client, LocalCluster
import problems
from trajevo.problems import HybridManipulator


def evaluated(problem):
    import os, trajevo
    return os.getpid(), trajevo.__file__, problem.evaluate(problem.xl[None])[0].tolist()


if __name__ == "__main__":
    local = LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None)
    with local as cluster, Client(cluster) as client:
        there = client.submit(evaluated, HybridManipulator()).result()
    here = evaluated(HybridManipulator())
    assert there[0] != here[0] and there[1:] == here[1:]
    print("the same")
"""
    assert installed.script(code, cwd=tmp_path) == "the same\n"


TYPED = """
from trajevo import Front, Solution, dlcc, export, load_problem, load_robot, load_task, optimise, plots, read_run
from trajevo.problems import HybridManipulator, PointingMechanism, hybrid_manipulator


def best_of(payload: float) -> Solution:
    problem = HybridManipulator(payload=payload)
    front = optimise(problem, seed=1, generations=3)
    plots.front(front, mark=front.knee())
    print(dlcc(front.knee()).mass, load_robot("ur5").dof, hybrid_manipulator.paper_solution().shape)
    return front.knee()


reveal_type(best_of(1.0))
reveal_type(optimise(PointingMechanism(), seed=1))
reveal_type(load_task("ur5_pick_and_place"))
reveal_type(read_run("runs/first"))
"""


@pytest.mark.long
def test_a_users_script_passes_strict_type_checks_and_no_name_is_any(installed, tmp_path):
    own_packages(tmp_path)
    (tmp_path / "typed.py").write_text(TYPED, encoding="utf-8")
    names = [f"{room}.{name}" for room in ("trajevo", "trajevo.plots", "trajevo.problems") for name in _names(room)]
    lines = ["import trajevo", "import trajevo.plots", "import trajevo.problems", *(f"reveal_type({n})" for n in names)]
    (tmp_path / "names.py").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "wrong.py").write_text(
        "from trajevo import nothing, optimise\nfrom trajevo.plots import nowhere\noptimise(3)\n",
        encoding="utf-8",
    )
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--python-executable", installed.python]
    command += ["--cache-dir", tmp_path / "cache", "typed.py", "names.py", "wrong.py"]
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "MYPYPATH")}
    told = subprocess.run(list(map(str, command)), cwd=tmp_path, env=environment, capture_output=True, text=True).stdout
    said = {file: [line for line in told.splitlines() if line.startswith(file)] for file in ("typed", "names", "wrong")}
    assert sum(map(len, said.values())) == len(told.splitlines()), told
    assert [line.rpartition(" is ")[2].strip('"') for line in said["typed"]] == [
        "trajevo.front.solution.Solution",
        "trajevo.front.front.Front",
        "trajevo.solvers.task.Task",
        "trajevo.front.front.Front",
    ]
    assert len(said["names"]) == len(names)
    assert not [line for line in said["names"] if 'type is "Any"' in line or ": error: " in line]
    assert [line.split(":")[1] for line in said["wrong"] if ": error: " in line] == ["1", "2", "3"], told


def _names(room):
    return {"trajevo": trajevo, "trajevo.plots": trajevo.plots, "trajevo.problems": trajevo.problems}[room].__all__


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(file.stem for file in ROOT.glob("notebooks/[0-9]*.ipynb")))
def test_a_notebook_of_the_wheel_runs_in_an_empty_folder(name, installed, tmp_path):
    installed.trajevo("examples", name, cwd=tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == [f"{name}.ipynb"]
    installed.run("-m", "jupytext", "--to", "py:percent", f"{name}.ipynb", "--output", "cells.py", cwd=tmp_path)
    # As in a notebook, processes that a study starts do not run the cells again.
    installed.run("-c", "exec(compile(open('cells.py').read(), 'cells.py', 'exec'))", cwd=tmp_path)


@pytest.mark.long
def test_the_start_page_runs_from_the_wheel_in_an_empty_folder(installed, tmp_path):
    told = ""
    for block in blocks("start.md"):
        if block.language == "python":
            told += installed.script(block.code, cwd=tmp_path)
        for words, _ in block.commands if block.language == "sh" and not block.no_run else ():
            told += installed.trajevo(*words[1:], cwd=tmp_path)
        compare(block, f"start.md:{block.line}", told)
    assert (tmp_path / "runs" / "task" / "report.html").is_file()
