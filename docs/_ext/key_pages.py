"""The pages of the keys of files, in Markdown."""

from __future__ import annotations

import keys

TASK = """# task.toml

A task is a robot, the points that it must visit, and what is wanted of the motion: `trajevo init` writes one to begin
with, [how tasks are written](../how_to/tasks.md) shows what they can say. Numbers are in SI units; where the unit is
called *angle*, they are in that of the key `angle`. Where text is allowed for a number, it has its unit: `"250 mm"`,
`"90 deg/s"`. Limits of your own package add their keys to `[constraints]`.
"""

STUDY = """# study.toml

A study is the product of factors: [how studies are run](../how_to/cluster.md). Its keys are the arguments of
[`Study`](api/trajevo.Study.rst), and settings of the search stand beside them.
"""

ROBOT = """# robot.toml

What a URDF cannot say of a robot: [how a robot of your own is described](../how_to/own_robot.md). Every number has its
unit in a key `unit` beside it; any unit of that quantity can be written.
"""

CATALOGUE = """# catalogue.toml

Robots to choose from, with what a buyer knows of them: [which robot](../how_to/which_robot.md). A task names the folder
of this file, or the file: `robots = "arms"`. Every robot is a table with the keys below and those of `[robot]` and
`[robot.limits]` of a [task](task_toml.md); paths start from the folder of the file.
"""


def pages() -> dict[str, str]:
    """The pages by their files in `reference`."""
    return {
        "task_toml.md": _page(TASK, keys.task()),
        "study_toml.md": _page(STUDY, keys.study()),
        "robot_toml.md": _page(ROBOT, keys.robot()),
        "catalogue_toml.md": _page(CATALOGUE, keys.catalogue()),
    }


def _page(introduction: str, tables: list[keys.Table]) -> str:
    parts = [introduction.strip()]
    for table in tables:
        parts += ["## At the top" if not table.title else "## " + table.title.replace("[", r"\[").replace("]", r"\]")]
        parts += [table.says] if table.says and table.title else []
        rows = [f"| `{key.name}` | {_cell(key)} | {_value(key.default)} | {_unit(key.unit)} |" for key in table.keys]
        parts.append("\n".join(["| key | meaning | default | unit |", "|---|---|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def _cell(key: keys.Key) -> str:
    says = key.says.replace("|", r"\|")
    return f"{says}<br>*{key.kind}*".replace('"', "&quot;")


def _value(default: str) -> str:
    return f"`{default}`" if default and default != "needed" else default


def _unit(unit: str) -> str:
    return "no unit" if unit == "1" else unit.replace("*", "·").replace("^2", "²").replace("^3", "³")
