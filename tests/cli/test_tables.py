"""Tables of any width: nothing is cut, and no line is longer than the terminal while words allow it."""

import io
import random

import pytest
from rich.console import Console, ConsoleDimensions

from tests.helpers import trajevo
from trajevo.cli.console import Terminal
from trajevo.cli.screen.tables import Listing, fitted, wrapped

NAMES = [
    "knee",
    "shoulder_lift_joint",
    "93.1 % effort of shoulder_pan_joint",
    "3.9434",
    "-6.28319",
    "a.b:Name",
    "",
    "µ²",
]


def printed(table, width):
    out = Console(file=io.StringIO(), width=width, color_system=None)
    out.print(table)
    return out.file.getvalue()


@pytest.mark.parametrize("width", [20, 40, 60, 80, 120])
@pytest.mark.parametrize("seed", range(6))
def test_every_letter_of_every_cell_is_printed(seed, width):
    draw = random.Random(seed)
    headers = [
        f"{draw.choice(['velocity', 'closest limit', 'L_xy 75 mm'])} [{unit}]" for unit in ("rad/s", "m", "kg", "1")
    ]
    rows = [[draw.choice(NAMES) for _ in headers] for _ in range(5)]
    table = Listing(*headers, title="a title")
    for row in rows:
        table.add(*row)
    text = printed(table, width)
    assert "…" not in text
    letters = sorted("".join(text.replace("─", "").replace(":", "").split()))
    blocks = not any("─" in line for line in text.splitlines())
    told = ["a title", *(cell for row in rows for cell in row), *(headers[1:] * len(rows) if blocks else headers)]
    assert letters == sorted("".join("".join(told).replace(":", "").split()))
    if not blocks:
        assert max(map(len, text.splitlines())) <= width


def test_headers_wrap_before_cells_and_cells_before_names():
    columns = [["joint", "shoulder_pan_joint"], ["velocity [rad/s]", "3.15"], ["closest limit", "12 % effort of elbow"]]
    assert fitted(columns, 60) == [18, 16, 20]
    assert fitted(columns, 46) == [18, 8, 20]
    assert fitted(columns, 40, names=False) == [18, 8, 14]
    assert fitted(columns, 30, names=False) is None
    assert fitted(columns, 30) == [11, 8, 11]
    assert fitted(columns, 20) is None
    assert wrapped("12 % effort of shoulder_pan_joint", 18) == ["12 % effort of", "shoulder_pan_joint"]
    assert wrapped("12 % effort of shoulder_pan_joint", 13) == ["12 % effort", "of shoulder_", "pan_joint"]
    assert wrapped("one\ntwo three", 5) == ["one", "two", "three"]


def test_a_table_has_a_cell_for_each_header():
    with pytest.raises(ValueError, match="zip"):
        Listing("a", "b").add("1")


@pytest.fixture
def columns(monkeypatch):
    def of(width):
        monkeypatch.setattr(Terminal, "size", ConsoleDimensions(width, 25))

    return of


def test_joints_of_a_robot_have_whole_names_and_units_at_80_columns(columns):
    columns(80)
    told = trajevo("check-robot", "ur5").stdout
    lines = told.splitlines()
    assert lines[0].endswith(", 6 revolute joints, 20.9939 kg")
    header = " ".join(lines[2].split() + lines[3].split())
    for unit in ("[rad]", "[rad/s]", "[rad/s²]", "[rad/s³]", "[N·m]"):
        assert unit in header
    rows = [line.split() for line in lines if line.startswith("shoulder_lift_joint ")]
    assert rows == [["shoulder_lift_joint", "-6.28319", "6.28319", "3.15", "-", "-", "150"]]


def test_joints_of_each_unit_have_a_table_of_their_own(columns):
    columns(80)
    told = trajevo("check-robot", "hybrid_manipulator").stdout
    straight, turning = told.index("[m/s²]"), told.index("[rad/s²]")
    assert straight < told.index("screw_1") < told.index("screw_3") < turning < told.index("joint_4")
    assert "[N]" in told[:turning]
    assert "[N·m]" in told[turning:]
    assert "actuator" in told
    assert max(map(len, told.splitlines()[1:-4])) <= 80


def test_a_narrow_terminal_gets_blocks(columns):
    columns(40)
    told = trajevo("check-robot", "ur5").stdout
    assert "shoulder_lift_joint\n  lower [rad]: -6.28319\n" in told


def test_the_list_fits_a_terminal(columns):
    columns(80)
    told = trajevo("list").stdout
    assert max(map(len, told.splitlines()[:-1])) <= 80
    assert "(rad or m)²/s³" in told
    assert "{" not in told
