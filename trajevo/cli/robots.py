"""Commands that need no run: ``trajevo list`` and ``check-robot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.screen.printed import print_examination, print_list
from trajevo.robot.examine import examine

RobotArgument = Annotated[
    str, typer.Argument(help="Name, folder with robot.toml, or URDF.", autocompletion=completion.robots)
]
MasslessOption = Annotated[
    bool, typer.Option("--allow-massless", help="Links without mass are meant: efforts leave them out.")
]

_out = Terminal()


def list_everything() -> None:
    """List problems, their building blocks, formats and robots."""
    print_list(_out)


def check_robot(
    robot: RobotArgument,
    lock: Annotated[list[str] | None, typer.Option(help="Joint to hold still; may be repeated.")] = None,
    limits: Annotated[
        Path | None, typer.Option(help="MoveIt's joint_limits.yaml, whose limits take the place of the robot's own.")
    ] = None,
    allow_massless: MasslessOption = False,
) -> None:
    """Show everything that is wrong with a robot at once; exit code 1 if it cannot be loaded."""
    examination = examine(robot, lock=lock or (), limits=limits, allow_massless=allow_massless or None)
    print_examination(_out, examination)
    if examination.errors:
        raise typer.Exit(1)
