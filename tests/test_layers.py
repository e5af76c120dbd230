"""The house: rooms that show the data flow, imports that run one way, files and names that stay readable."""

import ast
import graphlib
import re
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "trajevo"
FILES = sorted((*PACKAGE.glob("**/*.py"), *ROOT.glob("problems/**/*.py")))
ROOMS = sorted(folder for folder in PACKAGE.iterdir() if (folder / "__init__.py").is_file())

#: Rooms in rooms: what stands in them imports one another as rooms do.
INNER = (
    "trajectory/interpolants",
    "formulation/constraints",
    "formulation/feasibility",
    "solvers/evolutionary",
    "solvers/gradient",
    "robot/loading",
    "solvers/run",
)


def module_of(file: Path) -> str:
    return ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_of(file): file for file in FILES}


@cache
def parsed(file: Path) -> ast.Module:
    return ast.parse(file.read_text())


@cache
def imported(file: Path) -> set[str]:
    """Modules of ours that a file imports when it is imported; what only type checkers see is left out."""
    found = set()
    package = module_of(file) if file.name == "__init__.py" else module_of(file).rpartition(".")[0]
    for node in parsed(file).body:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = f"{package}.{node.module}".rstrip(".") if node.level else node.module
            base = package if node.level and node.module is None else base
            found |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return found & set(MODULES)


def test_imports_run_one_way():
    script = "import sys; from importlinter.cli import lint_imports_command; sys.exit(lint_imports_command())"
    result = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout


def test_no_file_imports_itself_by_way_of_others():
    graph = {name: imported(file) - {name} for name, file in MODULES.items()}
    graphlib.TopologicalSorter(graph).prepare()


def test_no_room_in_a_room_imports_itself_by_way_of_others():
    def place(name: str) -> str:
        path = name.replace(".", "/").removeprefix("trajevo/")
        return next((room for room in INNER if path.startswith(room)), name)

    graph: dict[str, set[str]] = {}
    for name, file in MODULES.items():
        graph.setdefault(place(name), set()).update(place(other) for other in imported(file))
    graphlib.TopologicalSorter({name: others - {name} for name, others in graph.items()}).prepare()


def test_the_listing_of_the_package_is_its_rooms_and_little_else():
    entries = {entry.name for entry in PACKAGE.iterdir() if entry.name != "__pycache__"}
    assert len(ROOMS) == 16
    assert entries == {room.name for room in ROOMS} | {"__init__.py", "__main__.py", "errors.py", "py.typed"}


@pytest.mark.parametrize("room", [*ROOMS, *(PACKAGE / inner for inner in INNER)], ids=lambda room: room.name)
def test_rooms_hold_four_to_fifteen_files(room):
    files = list(room.glob("*.py"))
    inner = [folder for folder in room.iterdir() if (folder / "__init__.py").is_file()]
    assert len(files) + len(inner) >= 4 and len(files) <= 15  # noqa: PT018 - one sentence


def test_the_contract_has_at_most_thirteen_layers():
    text = (ROOT / "pyproject.toml").read_text()
    layers = re.search(r"layers = \[(.*?)\]", text, re.DOTALL)[1]
    assert len(re.findall(r'"[^"]+"', layers)) <= 13


@pytest.mark.parametrize("file", FILES, ids=module_of)
def test_files_stay_readable(file):
    assert len(file.read_text().splitlines()) <= 450


def test_no_two_public_classes_share_a_name():
    names = Counter(
        node.name
        for file in FILES
        for node in parsed(file).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, count in names.items() if count > 1] == []


def test_the_framework_knows_no_paper():
    for name, file in MODULES.items():
        if name.startswith("trajevo"):
            assert not re.search(r"^\s*(from|import) (trajevo\.)?problems\b", file.read_text(), re.MULTILINE), name


def test_few_files_call_pinocchio():
    callers = {module_of(file).removeprefix("trajevo.") for file in FILES if "import pinocchio" in file.read_text()}
    assert callers <= {
        "dynamics.inverse_dynamics",
        "dynamics.rnea",
        "formulation.constraints.collision",
        "formulation.constraints.solids",
        "robot.payload",
        "robot.robot",
        "robot.shapes.geometry",
        "robot.urdf.model",
        "study.bench.plain.arm",
    }
