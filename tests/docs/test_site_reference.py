"""The reference of the site: every public name, command, key and format is there, with its units."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

import trajevo
from trajevo import plots, problems
from trajevo.cli.main import app
from trajevo.exporters.export import EXPORTERS
from trajevo.formulation.constraints.scenes.obstacles import SHAPES
from trajevo.formulation.search import Search
from trajevo.formulation.task_file import task_model
from trajevo.robot.robot_toml import RobotSettings
from trajevo.study.bench.suite import benchmark, benchmarks
from trajevo.study.definition import StudySettings

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "_ext"))

import api  # noqa: E402
import api_pages  # noqa: E402
import bench_problems  # noqa: E402
import commands  # noqa: E402
import copied  # noqa: E402
import formats  # noqa: E402
import key_pages  # noqa: E402
import references  # noqa: E402
import units  # noqa: E402


@pytest.fixture(scope="module")
def pages():
    return api_pages.pages()


@pytest.fixture(scope="module")
def keys():
    return key_pages.pages()


def entries():
    return [entry for found in api.groups().values() for entry in found]


@pytest.mark.parametrize("room", [trajevo, plots, problems], ids=lambda room: room.__name__)
def test_every_public_name_has_a_page_to_which_its_group_leads(room, pages):
    by_value = {id(entry.value): entry for entry in entries()}
    for name in room.__all__:
        if (room, name) == (trajevo, "plots"):
            assert "# Pictures" in pages["pictures.md"]
            continue
        entry = by_value[id(getattr(room, name))]
        page = pages[f"{entry.place}.rst"]
        assert f".. auto{entry.kind}:: {entry.place}\n" in page or f".. py:data:: {entry.place}\n" in page
        assert f"import {entry.name}\n" in page
        (group,) = (title for title, found in api.groups().items() if entry in found)
        assert f"[`{entry.name}`]({entry.place}.rst)" in pages["index.md"]
        assert f"[{group}](" in pages["index.md"]
        assert entry.says, name


def test_groups_are_those_of_the_facade_in_its_order():
    source = (
        (ROOT / "trajevo" / "__init__.py").read_text(encoding="utf-8").partition("_NAMES = {")[2].partition("\n}")[0]
    )
    titles = re.findall(r"^    # (.+)$", source, re.MULTILINE)
    assert list(api.groups())[: len(titles)] == titles
    assert sum(len(api.groups()[title]) for title in titles) == len(trajevo.__all__) - 1


def test_what_public_functions_give_has_pages_too():
    names = {entry.name for entry in api.groups()[api.RECORDS]}
    assert names >= {"Capacity", "Certificate", "Verification", "Slowdown", "Polished", "StudyResults", "Feasibility"}
    assert {entry.name for entry in api.groups()[api.ERRORS]} >= {"InvalidInputError", "UnknownNameError"}


def test_references_lead_to_pages_and_wrong_ones_nowhere():
    assert references.target_of("trajevo.robot.robot.load_robot") == "trajevo.load_robot"
    assert references.target_of("~trajevo.front.front.Front.save") == "trajevo.Front.save"
    assert references.target_of("trajevo.trajectory.interpolants.Interpolant") == "trajevo.Interpolant"
    assert references.target_of("InvalidInputError") == "trajevo.errors.InvalidInputError"
    assert references.target_of("trajevo.robot.robot.no_such_thing") is None
    assert references.exists("trajevo.capacity.scaled_path.SCALED_LIMITS", "trajevo.dlcc")
    assert not references.exists("trajevo.capacity.scaled_path.NOTHING", "trajevo.dlcc")
    assert references.has_member(trajevo.Front, "save")
    assert not references.has_member(trajevo.Front, "lost")


def test_bars_of_a_docstring_are_bars_except_in_code():
    lines = ["|q| is less than ``|v|``: a bound"]
    references.readable("method", lines)
    assert lines == [r"\|q\| is less than ``|v|``: a bound"]
    references.readable("property", lines)
    assert lines[0] == "\\ "


def test_every_docstring_names_units_shapes_and_all_arguments():
    assert list(units.all_complaints()) == []


def test_a_docstring_without_units_is_told():
    def bad(mass: float, *, points: "Array", steps: int) -> float:  # noqa: F821
        """Something.

        Args:
            mass: the mass.
            points: where to go [m].
        """
        return mass

    bad.__annotations__ = {"mass": "float", "points": "Array", "steps": "int", "return": "float"}
    told = " ".join(units.complaints("bad", bad))
    assert "bad: mass: a number without a unit" in told
    assert "bad: points: an array without its shape" in told
    assert "bad: nothing is said of steps" in told
    assert "bad: what it gives: a number without a unit" in told


def every_command(group=app, path=()):
    context = app.context_class(app, info_name="trajevo")
    names = commands.COMMANDS if group is app else group.commands
    for name in names:
        command = group.get_command(context, name)
        if hasattr(command, "commands"):
            yield from every_command(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


def test_every_command_has_a_section_with_all_its_arguments_and_options():
    page = commands.page()
    found = dict(every_command())
    assert len(found) >= 26
    for name, command in found.items():
        (section,) = re.findall(rf"\n## trajevo {name}\n(.*?)(?=\n## |\Z)", page, re.DOTALL)
        assert f"[`trajevo {name}`](#{commands.anchor(name)})" in page
        for parameter in command.params:
            if getattr(parameter, "hidden", False) or parameter.name == "help":
                continue
            written = (
                parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar or parameter.name
            )
            rows = re.findall(rf"^\| `{re.escape(written)}(?:\.\.\.)?[ `].*$", section, re.MULTILINE)
            assert len(rows) == 1, (name, written)
            (row,) = rows
            assert len(row.split("|")[2].strip()) > 5, (name, row)


def keys_of(schema):
    """Every key of a schema of pydantic, with its description."""
    for model in (schema, *schema.get("$defs", {}).values()):
        yield from ((name, entry.get("description", "")) for name, entry in model.get("properties", {}).items())


@pytest.mark.parametrize(
    ("page", "model"),
    [("task_toml.md", task_model()), ("study_toml.md", StudySettings), ("robot_toml.md", RobotSettings)],
    ids=lambda given: given if isinstance(given, str) else "",
)
def test_every_key_of_a_file_is_described(page, model, keys):
    found = list(keys_of(model.model_json_schema(by_alias=True)))
    assert len(found) > 5
    for key, description in found:
        if (page, key) != ("task_toml.md", "seed") or description:
            assert len(description) > 8, key
        assert re.search(rf"^\| `{key}` \| \S", keys[page], re.MULTILINE), key


def test_settings_of_a_search_are_keys_of_studies(keys):
    for name in set(Search.model_fields) - {"seed"}:
        key = "name" if name == "algorithm" else name
        assert f"| `{key}` |" in keys["study_toml.md"] or f"| `{name}` |" in keys["study_toml.md"]
        assert f"| `{key}` |" in keys["task_toml.md"]


#: Tables whose keys are names of the user's own, joints and arguments of xacro, or numbers of points.
NAMED = ("lock", "xacro", "position", "velocity", "acceleration", "jerk", "effort", "after")


def keys_in(content):
    for key, value in content.items():
        yield key
        if key in NAMED:
            continue
        for inner in value if isinstance(value, list) else [value]:
            if isinstance(inner, dict):
                yield from keys_in(inner)


@pytest.mark.parametrize(
    "file",
    [*ROOT.glob("trajevo/cli/*.toml"), *ROOT.glob("trajevo/cli/templates/*.toml"), *ROOT.glob("problems/tasks/*.toml")],
    ids=lambda file: file.name,
)
def test_every_key_of_the_worked_tasks_is_on_the_page(file, keys):
    listed = set(re.findall(r"^\| `(\w+)` \|", keys["task_toml.md"], re.MULTILINE))
    used = set(keys_in(tomllib.loads(file.read_text(encoding="utf-8"))))
    assert len(used) > 8
    assert used - listed == set()


def test_every_shape_and_size_of_an_obstacle_is_on_the_page(keys):
    for shape, kind in SHAPES.items():
        assert f'\\[\\[scene.obstacles\\]\\] with shape = "{shape}"' in keys["task_toml.md"]
        for name in kind.__dataclass_fields__:
            assert f"| `{name}` |" in keys["task_toml.md"]


def test_units_and_defaults_stand_in_columns_of_their_own(keys):
    page = keys["task_toml.md"]
    assert re.search(r"^\| `duration_bounds` \| .* \| needed \| s \|$", page, re.MULTILINE)
    assert re.search(r"^\| `samples` \| .*whole number.* \| `6` \|  \|$", page, re.MULTILINE)
    assert re.search(r"^\| `effort_margin` \| .* \| `0.0` \| no unit \|$", page, re.MULTILINE)
    assert re.search(r"^\| `angle` \| .* \| `\"rad\"` \|", page, re.MULTILINE)
    assert "None" not in page


def test_every_format_and_every_key_of_a_front_is_on_the_page():
    page = formats.page()
    for name in EXPORTERS:
        assert f"| `{name}` |" in page
    for record in (record for records in formats.RECORDS.values() for record in records):
        for key in formats.names(record):
            assert re.search(rf"^\| `{key}` \| \S", page, re.MULTILINE) or key in ("format", "version"), key


def test_every_problem_of_the_suite_and_what_was_published_of_it_is_on_the_page():
    page = bench_problems.page()
    for of in map(benchmark, benchmarks()):
        assert f"\n## {of.name}\n" in page
        assert f"{of.title}. " in page
        for one in of.published:
            known = one.basis
            value = f"{one.value:.9g} {one.unit}".removesuffix(" 1")
            assert f"| {one.objective} | {value} | {known} | {one.source}. {one.note} |" in page
    assert {*bench_problems.UNSTATED} <= {*benchmarks()}


def test_papers_without_results_say_how_to_make_them(tmp_path):
    docs = tmp_path / "docs"
    made = tmp_path / "build" / "reproduced" / "sun2020"
    made.mkdir(parents=True)
    (made / "page.md").write_text("![Figure 3](figure_3.png)\n", encoding="utf-8")
    (made / "figure_3.png").write_bytes(b"picture")
    first, second, *_ = copied.reproduced(docs)
    assert first.read_text(encoding="utf-8") == "![Figure 3](reproduced/sun2020/figure_3.png)\n"  # beside its story
    assert (first.parent / "figure_3.png").read_bytes() == b"picture"
    assert "trajevo reproduce guo2016" in second.read_text(encoding="utf-8")


def test_notebooks_that_are_gone_leave_the_site(tmp_path):
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "docs" / "tutorials").mkdir(parents=True)
    (tmp_path / "docs" / "tutorials" / "09_gone.ipynb").write_text("{}", encoding="utf-8")
    (tmp_path / "notebooks" / "01_here.ipynb").write_text("{}", encoding="utf-8")
    assert [file.name for file in copied.notebooks(tmp_path / "docs")] == ["01_here.ipynb"]
    assert [file.name for file in (tmp_path / "docs" / "tutorials").iterdir()] == ["01_here.ipynb"]
