"""One import is all that users need: `trajevo`, `trajevo.plots` and `trajevo.problems`."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import trajevo
from trajevo import plots

ROOT = Path(__file__).parents[1]
FACADES = {"trajevo": trajevo, "trajevo.plots": plots}
ROOMS = {"trajevo.plots", "trajevo.problems"}
#: Prose and programs that users copy from.
GUIDES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(ROOT.glob("docs/**/*.md"))]
NOTEBOOKS = sorted((*ROOT.glob("notebooks/*.py"), *ROOT.glob("notebooks/*.ipynb")))


def declared(facade):
    """Names under TYPE_CHECKING, each with the module that it is imported from, as the file says."""
    tree = ast.parse(Path(facade.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    return {alias.name: node.module for node in block.body for alias in node.names}


@pytest.mark.parametrize("name", FACADES)
def test_a_facade_says_the_same_three_times(name):
    facade = FACADES[name]
    found = {own: f"{name}.{module}" for module, names in facade._NAMES.items() for own in names}
    rooms = {"plots": "trajevo"} if facade is trajevo else {}
    assert declared(facade) == found | rooms
    assert facade.__all__ == sorted(found | rooms)
    assert sum(map(len, facade._NAMES.values())) == len(found)
    assert set(facade.__all__) <= set(dir(facade))


def test_the_facade_lists_its_rooms_too():
    assert {"plots", "problems", "__version__"} <= set(dir(trajevo))
    assert trajevo.problems.PointingMechanism.registered_name == "pointing"


#: Runs each argument in a child of its own, in which all that its names import is loaded and nothing of trajevo.
CHILDREN = """
import os, sys, traceback
import matplotlib.pyplot, numpy, pinocchio, pydantic, pymoo.core.problem
failed = 0
for script in sys.argv[1:]:
    child = os.fork()
    if not child:
        try:
            exec(script, {})
        except BaseException:
            sys.stderr.write(script + chr(10) + traceback.format_exc())
            os._exit(1)
        os._exit(0)
    failed += os.waitpid(child, 0)[1] != 0
sys.exit(min(failed, 1))
"""


def run_in_fresh_processes(scripts):
    result = subprocess.run([sys.executable, "-c", CHILDREN, *scripts], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


STAR = """
{first}
import types
import {name} as facade
from {name} import *
known = set(globals())
assert set(facade.__all__) <= known, set(facade.__all__) - known
rooms = [one for one in facade.__all__ if isinstance(getattr(facade, one), types.ModuleType)]
assert rooms == (["plots"] if facade.__name__ == "trajevo" else []), rooms
try:
    facade.nothing
except AttributeError as error:
    assert str(error) == "module '{name}' has no attribute 'nothing'", error
else:
    raise SystemExit("a name that is not there was found")
"""
FIRST = [
    "",
    "import trajevo.solvers.optimise",
    "import trajevo.formulation.via_points",
    "import pkgutil, importlib; [importlib.import_module(m.name) for m in pkgutil.walk_packages("
    "__import__('trajevo').plots.__path__, 'trajevo.plots.')]",
]
#: What was imported before each facade, often and once more.
BEFORE = {
    "often": [*zip(FACADES, FIRST[:2], strict=False)],
    "each": [(name, first) for name in FACADES for first in FIRST],
}
#: Every module is imported by a process of its own, so that `make test` takes one of so many.
PARTS = 128


def stars(which):
    return [STAR.format(first=first, name=name) for name, first in BEFORE[which]]


def modules_alone(part):
    homes = {f"{name}.{module}" for name, facade in FACADES.items() for module in facade._NAMES}
    papers = {f"trajevo.problems.{file.stem}" for file in (ROOT / "problems").glob("[!_]*.py")}
    modules = sorted(homes | papers | {"trajevo.problems"})
    return [f"import {module}" for module in modules[part::PARTS]]


def test_names_are_there_and_modules_are_imported_whatever_was_imported_before():
    """A few of each: what the children find loaded takes seconds to import."""
    run_in_fresh_processes([*stars("often"), *modules_alone(0)])


@pytest.mark.long
@pytest.mark.parametrize("which", BEFORE)
def test_every_name_is_there_whatever_was_imported_before(which):
    run_in_fresh_processes(stars(which))


@pytest.mark.long
@pytest.mark.parametrize("part", range(PARTS))
def test_every_module_can_be_the_first_that_is_imported(part):
    run_in_fresh_processes(modules_alone(part))


def imported(code):
    """Every module that Python imports, with the names that are taken from it."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from ((node.module, alias.name) for alias in node.names)


def shown_to_users(file):
    """The Python that a file shows: blocks of a guide, cells of a notebook, or all of it."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".md":
        return re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    if file.suffix == ".ipynb":
        return ["".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    return [text]


@pytest.mark.parametrize("file", [*GUIDES, *NOTEBOOKS], ids=lambda file: file.name)
def test_examples_import_nothing_deeper_than_the_facade(file):
    for code in shown_to_users(file):
        for module, name in imported(code):
            if module.partition(".")[0] == "trajevo":
                assert module in ("trajevo", *ROOMS), f"{file.name}: {module}"
                if name is not None and module in FACADES:
                    assert name in FACADES[module].__all__, f"{file.name}: {name}"


def test_guides_and_notebooks_show_python():
    assert sum(len(shown_to_users(file)) for file in GUIDES) > 10
    assert all(shown_to_users(file) for file in NOTEBOOKS)


PYTHON = [
    file
    for folder in ("trajevo", "problems", "tests", "notebooks", "robots")
    for file in sorted(ROOT.glob(f"{folder}/**/*.py"))
]


def test_nothing_imports_a_bare_package_of_problems():
    """A folder `problems` is the user's own; ours is `trajevo.problems`."""
    for file in (*GUIDES, *PYTHON, *NOTEBOOKS):
        for code in shown_to_users(file):
            if "problems" not in code and "robots" not in code:  # to parse all takes seconds
                continue
            for module, _ in imported(code):
                assert module.partition(".")[0] not in ("problems", "robots"), f"{file}: {module}"
        if file.suffix == ".py":
            text = file.read_text(encoding="utf-8")
            assert not re.search(r"import_module\(f?[\"']problems", text), file


@pytest.mark.parametrize("command", [["-c", "from trajevo.cli.main import main; main()"], ["-m", "trajevo"]])
def test_the_version_is_told(command):
    told = subprocess.run([sys.executable, *command, "--version"], capture_output=True, text=True, check=True)
    assert told.stdout == f"trajevo {trajevo.__version__}\n"
    assert re.fullmatch(r"\d+\.\d+\.\d+", trajevo.__version__)


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_and_version_import_nothing_heavy(option):
    script = (
        "import sys; from trajevo.cli.main import app\n"
        "try: app([sys.argv[1]])\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'pydantic', 'pymoo', 'pinocchio', 'scipy', 'matplotlib', 'pandas'}\n"
        "sys.exit(', '.join(heavy & set(sys.modules)) or 0)"
    )
    result = subprocess.run([sys.executable, "-c", script, option], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
