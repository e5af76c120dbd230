"""Commands that need no run: ``trajevo list`` and ``check-robot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trajevo.cli import completion
from trajevo.cli.console import Terminal
from trajevo.cli.screen.printed import print_examination, print_list
from trajevo.errors import InvalidInputError
from trajevo.robot.examine import examine

RobotArgument = Annotated[
    str,
    typer.Argument(
        help="Name, folder with robot.toml, or file: URDF, xacro or MJCF.", autocompletion=completion.robots
    ),
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
    xacro: Annotated[
        list[str] | None, typer.Option(help="NAME=VALUE of an argument of a xacro file; may be repeated.")
    ] = None,
    packages: Annotated[
        list[Path] | None, typer.Option(help="Folder that holds packages of meshes and xacro; may be repeated.")
    ] = None,
    allow_massless: MasslessOption = False,
) -> None:
    """Show everything that is wrong with a robot at once; exit code 1 if it cannot be loaded."""
    examination = examine(
        robot,
        lock=lock or (),
        limits=limits,
        allow_massless=allow_massless or None,
        xacro=_arguments(xacro) if xacro else None,
        packages=packages or None,
    )
    print_examination(_out, examination)
    if examination.errors:
        raise typer.Exit(1)


def _arguments(given: list[str]) -> dict[str, str]:
    """Arguments of a xacro file by name, from texts NAME=VALUE."""
    found = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise InvalidInputError(f"--xacro: expected NAME=VALUE, got {text!r}")
        found[name] = value
    return found
