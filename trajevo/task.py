"""Tasks: a robot, its points and what is wanted, in a file ``task.toml`` of some 15 lines."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from trajevo.algorithms import algorithm_settings
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.front import Front
from trajevo.optimise import optimise
from trajevo.problem import TrajectoryProblem
from trajevo.registry import load_problem
from trajevo.robot import Robot, robot_of
from trajevo.toml_lines import Place, key_lines, line_of
from trajevo.visits import joint_points

#: Types of errors that say no more than that a value is of another kind, as every other member of a union says too.
_OTHER_KIND = ("float_type", "list_type", "dict_type", "string_type", "model_type", "tuple_type")

#: The registered problem that a task is solved as.
TASK_PROBLEM = "via-points"

_Number = Annotated[float, pydantic.Strict()]
_Values = _Number | str | list[_Number | str] | dict[str, _Number | str]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)


class _Robot(_Strict):
    name: str
    tool: str | None = None
    lock: dict[str, _Number] | None = None
    gravity: tuple[_Number, _Number, _Number] | None = None


class _Limits(_Strict):
    """One number for all joints, one for each, or by joint; SI or text with a unit; positions in pairs."""

    position: list[_Number | str | list[_Number | str]] | dict[str, list[_Number | str]] | None = None
    velocity: _Values | None = None
    acceleration: _Values | None = None
    jerk: _Values | None = None
    effort: _Values | None = None


class _Payload(_Strict):
    mass: _Number
    com: tuple[_Number, _Number, _Number] = (0.0, 0.0, 0.0)
    inertia: list[list[_Number]] | None = None
    model: str = "rigid"


class _Point(_Strict):
    """Joint positions, or a pose of the tool [m], orientation by roll, pitch, yaw or by quaternion x, y, z, w."""

    joints: list[_Number] | None = None
    position: tuple[_Number, _Number, _Number] | None = None
    rpy: tuple[_Number, _Number, _Number] | None = None
    quaternion: tuple[_Number, _Number, _Number, _Number] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> _Point:
        if (self.joints is None) == (self.position is None):
            raise ValueError("expected either joints, or position with rpy or quaternion where it counts")
        if self.joints is not None and (self.rpy is not None or self.quaternion is not None):
            raise ValueError("joints have no rpy or quaternion")
        if self.rpy is not None and self.quaternion is not None:
            raise ValueError("expected rpy or quaternion, got both")
        return self


class _Moving(_Strict):
    """A box in which a point may move: around its joint positions, or around its tool position [m]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)]
    joints: _Number | list[_Number] | None = None
    tool: tuple[_Number, _Number, _Number] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> _Moving:
        if (self.joints is None) == (self.tool is None):
            raise ValueError("expected either joints or tool, the half widths of the box")
        return self


class _Constraints(_Strict):
    limits: list[str] = ["position", "velocity", "acceleration", "jerk", "effort"]
    effort_margin: _Number = 0.0
    overshoot: _Number | None = None
    tool_speed: _Number | None = None
    tool_height: _Number | None = None
    longest_time: _Number | None = None


class _Algorithm(_Strict):
    name: str = "nsga2"
    generations: Annotated[int, pydantic.Field(strict=True, ge=1)] | None = None
    population: Annotated[int, pydantic.Field(strict=True, ge=4)] | None = None
    offsprings: Annotated[int, pydantic.Field(strict=True, ge=1)] | None = None
    crossover_probability: _Number | None = None
    crossover_index: _Number | None = None
    mutation_probability: _Number | None = None
    mutation_index: _Number | None = None


class TaskSettings(_Strict):
    """The keys of ``task.toml``; SI, save for ``angle``, the unit of joint positions and of ``rpy`` in it."""

    format: Literal[1] = 1
    robot: str | _Robot
    angle: Literal["rad", "deg"] = "rad"
    limits: _Limits = _Limits()
    payload: _Number | _Payload = 0.0
    points: str | list[list[_Number] | _Point]
    moving: list[_Moving] = []
    interpolant: str = "quintic_spline"
    duration_bounds: tuple[_Number, _Number]
    objectives: list[str] = ["time", "energy"]
    constraints: _Constraints = _Constraints()
    scene: dict[str, Any] | None = None
    reference_point: list[_Number] | None = None
    algorithm: _Algorithm = _Algorithm()
    seed: Annotated[int, pydantic.Field(strict=True, ge=0)] = 1
    samples: Annotated[int, pydantic.Field(strict=True, ge=2)] = 6


@dataclass(frozen=True, eq=False)
class Task:
    """A task that was read: the problem it sets and how it is to be solved.

    Attributes:
        file: where it was read from.
        settings: its keys.
        problem: the problem, the same that its class makes of the same things.
    """

    file: Path
    settings: TaskSettings
    problem: TrajectoryProblem

    def solve(
        self,
        *,
        seed: int | None = None,
        generations: int | None = None,
        population: int | None = None,
        progress: bool = True,
    ) -> Front:
        """Solve it with the task's algorithm; what is given here goes before what the file says."""
        own = self.settings.algorithm.model_dump(exclude_none=True)
        name, length = own.pop("name"), own.pop("generations", None)
        if population is not None:
            own["population"] = population
        return optimise(
            self.problem,
            seed=self.settings.seed if seed is None else seed,
            generations=length if generations is None else generations,
            progress=progress,
            **algorithm_settings(name, own, self.problem.evolution.population),
        )


def load_task(file: str | Path) -> Task:
    """Read a task.

    Args:
        file: TOML, see :class:`TaskSettings`; relative paths in it count from its folder.

    Raises:
        InvalidInputError: it cannot be read, or a key is missing, unknown or has a value that cannot be used; the
            message names file, line and key.
    """
    path = Path(file)
    try:
        text = path.read_text(encoding="utf-8")
        content = tomllib.loads(text)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InvalidInputError(f"{path}: cannot be read as TOML: {why}") from error
    where = _Places(path, key_lines(text))
    try:
        settings = TaskSettings.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(where.told(_deepest(error))) from error
    return Task(path, settings, _problem(settings, where))


@dataclass(frozen=True)
class _Places:
    file: Path
    lines: dict[Place, int]

    def prefix(self, place: Place) -> str:
        line = line_of(self.lines, place)
        at = f"{self.file}: line {line}: " if line else f"{self.file}: "
        return at + ".".join(map(str, place)) + (": " if place else "")

    def told(self, error: Any) -> str:
        # Unions put the names of their members into the place; keys of the file are left.
        place = tuple(p for p in error["loc"] if isinstance(p, int) or (p.isidentifier() and not p.startswith("_")))
        place = tuple(p for p in place if p not in ("float", "str", "list", "dict", "constrained"))
        got = "" if error["type"] in ("missing", "value_error") else f", got {error['input']!r}"
        return self.prefix(place) + str(error["msg"]).removeprefix("Value error, ") + got

    @contextmanager
    def at(self, *place: str) -> Iterator[None]:
        """Errors of what is made of a key name its line."""
        try:
            yield
        except TrajevoError as error:
            raise InvalidInputError(self.prefix(place) + str(error).removeprefix(f"{place[-1]}: ")) from error

    def guess(self, error: TrajevoError) -> str:
        """Errors of the problem begin with the argument's name: the key's, here or in a table."""
        said = str(error).split(":")[0].split(".")[0]
        name = {"boxes": "moving"}.get(said, said)
        place = next((place for place in self.lines if place[-1] == name), ())
        return self.prefix(place) + (str(error).removeprefix(f"{said}: ") if place else str(error))


def _deepest(error: pydantic.ValidationError) -> Any:
    """The most telling of the errors: in a union that of the member that got furthest."""
    return max(error.errors(), key=lambda found: (found["type"] not in _OTHER_KIND, len(found["loc"])))


def _problem(settings: TaskSettings, where: _Places) -> TrajectoryProblem:
    to_rad = math.pi / 180.0 if settings.angle == "deg" else 1.0
    folder = where.file.resolve().parent
    with where.at("robot"):
        robot = _robot(settings, folder, to_rad)
    with where.at("points"):
        points = joint_points(_points(settings, folder, robot, to_rad), robot)
    arguments = {
        "robot": robot,
        "points": points,
        "duration_bounds": settings.duration_bounds,
        "interpolant": settings.interpolant,
        "moving": [_box(box, robot, to_rad) for box in settings.moving],
        "objectives": settings.objectives,
        "constraints": settings.constraints.limits,
        **settings.constraints.model_dump(exclude={"limits"}),
        "scene": settings.scene,
        "payload": settings.payload if isinstance(settings.payload, float | int) else settings.payload.model_dump(),
        "reference_point": settings.reference_point,
        "samples": settings.samples,
    }
    try:
        return load_problem(TASK_PROBLEM, **arguments)
    except TrajevoError as error:
        raise InvalidInputError(where.guess(error)) from error


def _robot(settings: TaskSettings, folder: Path, to_rad: float) -> Robot:
    given: dict[str, Any] = (
        {"name": settings.robot} if isinstance(settings.robot, str) else settings.robot.model_dump(exclude_none=True)
    )
    limits = settings.limits.model_dump(exclude_none=True)
    if limits:
        given["limits"] = limits
    local = folder / given["name"]
    if local.suffix == ".urdf" or (local / "robot.toml").is_file():
        given["name"] = local
    if "lock" in given and to_rad != 1.0:
        given["lock"] = {name: value * to_rad for name, value in given["lock"].items()}
    return robot_of(given)


def _points(settings: TaskSettings, folder: Path, robot: Robot, to_rad: float) -> Any:
    if isinstance(settings.points, str):
        return folder / settings.points
    points: list[Any] = []
    for point in settings.points:
        joints = point if isinstance(point, list) else point.joints
        if joints is not None:
            points.append(_in_radians(joints, robot, to_rad))
            continue
        pose: dict[str, Any] = {} if isinstance(point, list) else point.model_dump(exclude_none=True)
        if "rpy" in pose:
            pose["rpy"] = [angle * to_rad for angle in pose["rpy"]]
        points.append(pose)
    return points


def _box(box: _Moving, robot: Robot, to_rad: float) -> Mapping[str, Any]:
    if box.tool is not None:
        return {"point": box.point, "tool": list(box.tool)}
    widths = box.joints if isinstance(box.joints, list) else [box.joints or 0.0] * robot.dof
    return {"point": box.point, "joints": _in_radians(widths, robot, to_rad)}


def _in_radians(values: list[float], robot: Robot, to_rad: float) -> list[float]:
    """Angles of turning joints in rad; lengths as they are. Another number of values is refused where they are used."""
    if len(values) != robot.dof or to_rad == 1.0:
        return list(values)
    return [value * (to_rad if unit == "rad" else 1.0) for value, unit in zip(values, robot.joint_units, strict=True)]
