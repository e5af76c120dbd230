"""What is asked when robots are compared: one task in tool poses, the robots, and what of them counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from trajevo.base.plain import plain_data
from trajevo.base.shown.brief import brief
from trajevo.base.toml import Places, read_toml, validated
from trajevo.errors import InvalidInputError, TrajevoError, checked_name
from trajevo.formulation.examples import example_file
from trajevo.formulation.objectives import NAMED_OBJECTIVES, UNUSED_PAYLOAD
from trajevo.formulation.task_file import TaskSettings, task_model
from trajevo.path.tables import read_table
from trajevo.study.definition import in_json
from trajevo.study.robots.catalogue import Candidate, candidates_of, chosen_among

#: Objectives that a catalogue tells and no motion changes, with what they are.
OF_ROBOTS = {"price": "price of the robot", "mass": "mass of the arm"}

#: Limits of joints that one number, or one for each direction, can give for every joint of every robot.
_WAYS = {"backward", "forward"}

#: Columns of a file of tool poses.
_OF_POSES = {"x", "y", "z"}


@final
@dataclass(frozen=True)
class RobotTask:
    """A task for several robots.

    Attributes:
        content: keys of the task without the robots, and without what only robots tell.
        folder: folder from which its relative paths start.
        title: what the task is called.
        objectives: names of all objectives, those of robots among them.
        candidates: the robots.
    """

    content: Mapping[str, Any]
    folder: Path
    title: str
    objectives: tuple[str, ...]
    candidates: tuple[Candidate, ...]

    __repr__ = brief

    @property
    def of_motions(self) -> tuple[str, ...]:
        """The objectives that motions have."""
        return tuple(name for name in self.objectives if name not in OF_ROBOTS)

    @property
    def currency(self) -> str:
        """Currency of all prices; empty if none is told."""
        return next((one.currency for one in self.candidates if one.currency), "")


def asked_of(task: str | Path | Mapping[str, Any], robots: Any = None) -> RobotTask:
    """A task with robots to choose from.

    Args:
        task: file of a task, name of an example, or the keys of a task as a mapping, with paths relative to the current
            folder.
        robots: names, files or tables of robots, or a catalogue, in place of those of the task; a name that the task
            gives one of its own robots means that one. Those of the task if None.

    Raises:
        UnknownNameError: no such task.
        InvalidInputError: a key that is unknown or has an invalid value, no robots, or a key that belongs to one robot;
            the message names file, line and key.
    """
    if isinstance(task, Mapping):
        content, places = plain_data("task", in_json(dict(task))), Places(Path("task"), {})
        if "robot" not in content and "robots" not in content and robots is not None:
            content["robots"] = []
    elif isinstance(task, str | Path):
        content, places = read_toml(example_file("task", task))
        content = in_json(content)
    else:
        raise InvalidInputError(f"task: expected a file, a name or the keys of a task, got {type(task).__name__}")
    settings = validated(task_model(), content, places)
    folder = places.file.resolve().parent
    _check_objectives(settings.objectives, places)
    _check_shared(settings, folder, places)
    candidates = _candidates(settings, robots, folder, places)
    _check_told(settings.objectives, candidates, places)
    return RobotTask(
        content=_of_motions(content, settings, places),
        folder=folder,
        title=settings.name or ("task" if isinstance(task, Mapping) else places.file.stem),
        objectives=tuple(settings.objectives),
        candidates=candidates,
    )


def _candidates(settings: TaskSettings, robots: Any, folder: Path, places: Places) -> tuple[Candidate, ...]:
    own: tuple[Candidate, ...] = ()
    if settings.robots or (robots is None and settings.robots is not None):
        with places.at("robots"):
            own = candidates_of(settings.robots, folder=folder)
    if robots is not None:
        return chosen_among(own, robots, folder=Path.cwd())
    if settings.robots is None:
        with places.at("robot"):
            raise InvalidInputError(
                "robot: expected robots to choose from, got a task for one; write robots = [...] in its place, or name "
                "them: choose_robot(task, robots=[...]), trajevo choose-robot TASK --robots ..."
            )
    return own


def _of_motions(content: Mapping[str, Any], settings: TaskSettings, places: Places) -> dict[str, Any]:
    """The keys of the task that every robot shares, without what only robots tell."""
    kept = {key: value for key, value in content.items() if key not in ("robot", "robots")}
    columns = [k for k, name in enumerate(settings.objectives) if name not in OF_ROBOTS]
    if not columns:
        with places.at("objectives"):
            raise InvalidInputError(
                f"objectives: expected one of the motion beside {' and '.join(settings.objectives)}, such as time"
            )
    kept["objectives"] = [settings.objectives[k] for k in columns]
    corner = settings.reference_point
    if corner is not None and len(corner) == len(settings.objectives):
        kept["reference_point"] = [corner[k] for k in columns]
    return kept


def _check_objectives(objectives: Sequence[str], places: Places) -> None:
    """Refuse an objective that neither motions nor robots have, before any robot is loaded."""
    with places.at("objectives"):
        for name in objectives:
            if name not in OF_ROBOTS and ":" not in name:  # a function of the user's is file:function
                checked_name("objective", name, [*NAMED_OBJECTIVES.names(), UNUSED_PAYLOAD, *OF_ROBOTS])


def _check_told(objectives: Sequence[str], candidates: Sequence[Candidate], places: Places) -> None:
    """Refuse an objective of robots that one of them does not tell, or prices of different currencies."""
    with places.at("objectives"):
        for name in OF_ROBOTS:
            lacking = [one.name for one in candidates if getattr(one, name) is None]
            if name in objectives and lacking:
                example = '"24000 EUR"' if name == "price" else "18.4"
                raise InvalidInputError(
                    f"objectives: expected a {name} of every robot, got none of {', '.join(lacking)}; give it in the "
                    f"catalogue or in robots ({name} = {example})"
                )
        currencies = sorted({one.currency for one in candidates if one.price is not None})
        if "price" in objectives and len(currencies) > 1:
            written = " and ".join(currency or "none" for currency in currencies)
            raise InvalidInputError(f"objectives: price needs one currency for all robots, got {written}")


def _check_shared(settings: TaskSettings, folder: Path, places: Places) -> None:
    """Refuse what belongs to the joints of one robot, by its key."""
    one = "belong to the joints of one robot"
    with places.at("points"):
        if isinstance(settings.points, str):
            names = {name.casefold() for name in _columns(folder / settings.points)}
            if not names >= _OF_POSES:
                raise InvalidInputError(
                    f"points: {settings.points}: joint positions {one}; expected tool poses, columns x, y, z and those "
                    "of the orientation"
                )
        else:
            for k, point in enumerate(settings.points):
                if isinstance(point, list) or point.joints is not None:
                    raise InvalidInputError(
                        f"points: point {k}: joint positions {one}; expected a tool pose, {{ position = [x, y, z], rpy "
                        "= [...] }"
                    )
    with places.at("moving"):
        for box in settings.moving:
            if box.joints is not None:
                raise InvalidInputError(f"moving: point {box.point}: joints {one}; expected tool, half widths [m]")
    with places.at("passing"):
        for each in settings.passing:
            if each.velocity is not None or each.acceleration is not None:
                raise InvalidInputError(
                    f"passing: point {each.point}: velocities of joints {one}; expected a stop, a dwell or a window"
                )
    _check_limits(settings, places)


def _columns(file: Path) -> tuple[str, ...]:
    try:
        return tuple(read_table(file, example="x [m], y [m], z [m]").names)
    except TrajevoError as error:
        raise InvalidInputError(f"points: {error}") from error


def _check_limits(settings: TaskSettings, places: Places) -> None:
    for quantity, given in settings.limits.model_dump(exclude_none=True).items():
        pair = quantity == "position" and isinstance(given, list) and not any(isinstance(one, list) for one in given)
        for_all = pair or (not isinstance(given, list) and (not isinstance(given, dict) or set(given) <= _WAYS))
        if not for_all:
            with places.at("limits", quantity):
                raise InvalidInputError(
                    f"{quantity}: limits of single joints belong to one robot; expected one for all joints, or limits "
                    "= { ... } of each robot in robots"
                )
