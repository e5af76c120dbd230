"""House rules that a linter can check, so that `make test` alone shows a breach."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_imports_run_one_way():
    script = "import sys; from importlinter.cli import lint_imports_command; sys.exit(lint_imports_command())"
    result = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(
    "file", sorted((*ROOT.glob("trajevo/**/*.py"), *ROOT.glob("problems/*.py"))), ids=lambda f: f.name
)
def test_files_stay_short(file):
    assert len(file.read_text().splitlines()) <= 300


def test_only_robot_and_dynamics_call_pinocchio():
    callers = {file.name for file in ROOT.glob("trajevo/**/*.py") if "import pinocchio" in file.read_text()}
    dynamics = {"payload.py", "dynamics.py", "rnea_kernel.py"}
    assert callers <= dynamics | {"robot.py", "robot_model.py", "collision.py", "solids.py"}


def test_everything_that_the_package_names_is_there_whatever_was_imported_before():
    script = (
        "import sys, importlib; {first}import trajevo\n"
        "assert set(trajevo.__all__) <= set(dir(trajevo))\n"
        "exec('from trajevo import *')\n"
        "assert callable(optimise) and callable(trajevo.optimise)\n"
        "assert set(trajevo.__all__) <= set(globals())\n"
        "try: trajevo.nothing\n"
        "except AttributeError as error: assert \"'trajevo' has no attribute 'nothing'\" in str(error)\n"
    )
    for first in ("", "import trajevo.solvers.optimise; "):
        subprocess.run([sys.executable, "-c", script.format(first=first)], check=True)
