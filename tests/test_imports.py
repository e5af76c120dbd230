"""Nothing is imported before it is needed, since the person who waits for an import has asked for something else."""

import subprocess
import sys

import pytest

from tests.helpers import mostly_long, trajevo
from trajevo.base import jit, kernels
from trajevo.base.machine_code import writing
from trajevo.cli.main import COMMANDS

#: Packages that take long, and only some commands need.
SLOW = {
    *("scipy", "matplotlib", "PIL", "pandas", "yaml", "numba", "xarray", "netCDF4", "autograd"),
    *("pymoo.algorithms", "pymoo.util.ref_dirs", "pymoo.mcdm"),
}
#: What trajevo computes with.
COMPUTES = {"numpy", "pydantic", "pymoo", "pinocchio", "coal", "moocore"}
SHOWS = {"rich", "typer"}
#: What a search from Python needs only for files, obstacles and points that anyone may give, and for a robot.
LATER = {f"trajevo.formulation.{room}" for room in ("task_file", "via_points", "constraints.clearance")}
LATER |= {"pinocchio", "coal"}


def imported(program, *arguments, cwd=None):
    """Names of all modules that a program has imported at its end."""
    script = f"import sys\ntry:\n    {program}\nexcept SystemExit:\n    pass\nprint('modules:', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", script, *map(str, arguments)], capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.rpartition("modules:")[2].split())


COMMAND = "from trajevo.cli.main import main; main()"


#: Programs, and what they never import.
PROGRAMS = [
    ("import trajevo", SLOW | COMPUTES | SHOWS),
    ("import trajevo.plots", SLOW | COMPUTES | SHOWS),
    ("from trajevo import optimise", SLOW | SHOWS | LATER),
    ("from trajevo import optimise, resume, read_run, load_task, load_robot, polish", SLOW | SHOWS),
    ("from trajevo import ViaPointProblem, Front, Study, certify, verify, export, dlcc", SLOW | SHOWS),
    ("from trajevo import analyse, report, load_study, run_study, workspace_capacity", SLOW | SHOWS),
]


@pytest.mark.parametrize(("program", "never"), mostly_long(PROGRAMS, *PROGRAMS[:4], several=True))
def test_a_name_imports_what_it_needs(program, never):
    assert imported(program) & never == set()


#: Imports each argument in a child of its own, in which what trajevo computes with and shows by is loaded already.
CHILDREN = """
import os, sys
import coal, moocore, numpy, pinocchio, pydantic, pymoo.core.problem, rich.console, typer
print(*sys.modules, flush=True)
for module in sys.argv[1:]:
    child = os.fork()
    if not child:
        __import__(module)
        print(*sys.modules, flush=True)
        os._exit(0)
    if os.waitpid(child, 0)[1]:
        sys.exit(module)
"""


@pytest.mark.parametrize("every", mostly_long([1, 2, 6], 6))
def test_a_command_imports_what_it_needs(every):
    modules = sorted({f"trajevo.cli.{home.module}" for home in COMMANDS.values()})[::every]
    assert len(modules) > 5 / every
    done = subprocess.run([sys.executable, "-c", CHILDREN, *modules], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loaded, *others = [set(line.split()) for line in done.stdout.splitlines()]
    assert loaded & SLOW == set()
    assert len(others) == len(modules)
    for module, found in zip(modules, others, strict=True):
        assert module in found
        assert found & SLOW == set(), module


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["init", "task.toml"], ["init", "--help"]])
def test_what_computes_nothing_imports_nothing_that_computes(arguments, tmp_path):
    assert (
        imported(COMMAND, *arguments, cwd=tmp_path) & (SLOW | COMPUTES - {"pydantic"}) == set()
    )  # typer imports pydantic


def test_a_run_imports_neither_pictures_nor_other_algorithms(tmp_path):
    small = ["--generations", "3", "--population", "12", "--quiet", "--report", "short", "--no-pictures"]
    modules = imported(COMMAND, "solve", "pointing", *small, "--out", tmp_path / "run")
    never = {"matplotlib", "PIL", "pandas", "scipy.stats"}
    never |= {"pymoo.algorithms.moo.nsga3", "pymoo.util.ref_dirs", "autograd"}
    never |= {"trajevo.solvers.rivals", "trajevo.solvers.gradient.normal_constraint"}
    if writing.suits() and kernels.ready():  # compiled loops that are kept are called without numba
        never.add("numba")
    assert modules & never == set()


@pytest.mark.parametrize("kind", ["compiled", "numpy"])
def test_a_run_with_either_kind_of_kernel_imports_neither_scipy_nor_masked_arrays(kind, tmp_path, monkeypatch):
    if kind == "compiled" and not (writing.suits() and kernels.ready()):
        pytest.skip("loops are not compiled")
    monkeypatch.setenv(jit.CHOICE, kind)
    assert trajevo("init", "task.toml", cwd=tmp_path).returncode == 0
    small = ["--generations", "3", "--population", "12", "--quiet", "--report", "short", "--no-pictures"]
    modules = imported(COMMAND, "solve", "task.toml", *small, "--out", tmp_path / "run", cwd=tmp_path)
    assert ("llvmlite" in modules) == (kind == "compiled")
    assert modules & {"numba", "scipy", "numpy.ma"} == set()


def test_a_task_with_poses_is_read_without_scipy(tmp_path):
    assert trajevo("init", "task.toml", cwd=tmp_path).returncode == 0
    assert "rpy = [" in (tmp_path / "task.toml").read_text()
    modules = imported("import trajevo; trajevo.load_task('task.toml').problem.interpolant.points", cwd=tmp_path)
    assert modules & SLOW == set()
