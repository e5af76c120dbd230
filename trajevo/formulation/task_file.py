"""The file ``task.toml``: its keys, and where in it a mistake stands."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.toml_lines import Place, key_lines, line_of

#: Types of errors that say no more than that a value is of another kind, as every other member of a union says too.
_OTHER_KIND = ("float_type", "list_type", "dict_type", "string_type", "model_type", "tuple_type")

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


class MovingSettings(_Strict):
    """A box in which a point may move: around its joint positions, or around its tool position [m]."""

    point: Annotated[int, pydantic.Field(strict=True, ge=0)]
    joints: _Number | list[_Number] | None = None
    tool: tuple[_Number, _Number, _Number] | None = None

    @pydantic.model_validator(mode="after")
    def _one_kind(self) -> MovingSettings:
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
    held: Literal["sampled", "certified"] = "certified"


class AlgorithmSettings(_Strict):
    """An algorithm by name and what it is run with; what is left out is the problem's."""

    name: str = "nsga2"
    generations: Annotated[int, pydantic.Field(strict=True, ge=1)] | None = None
    population: Annotated[int, pydantic.Field(strict=True, ge=4)] | None = None
    offsprings: Annotated[int, pydantic.Field(strict=True, ge=1)] | None = None
    crossover_probability: _Number | None = None
    crossover_index: _Number | None = None
    mutation_probability: _Number | None = None
    mutation_index: _Number | None = None
    starts: str | None = None
    evaluations: Annotated[int, pydantic.Field(strict=True, ge=1)] | None = None
    cpu_time: _Number | None = None
    polish: Annotated[bool, pydantic.Field(strict=True)] | None = None
    polish_every: Annotated[int, pydantic.Field(strict=True, ge=1)] | None = None


class TaskSettings(_Strict):
    """The keys of ``task.toml``; SI, save for ``angle``, the unit of the points' joint positions and ``rpy`` and of
    the boxes in joint space.
    """

    format: Literal[1] = 1
    robot: str | _Robot
    angle: Literal["rad", "deg"] = "rad"
    limits: _Limits = _Limits()
    payload: _Number | _Payload = 0.0
    payload_range: tuple[_Number, _Number] | None = None
    points: str | list[list[_Number] | _Point]
    moving: list[MovingSettings] = []
    interpolant: str = "quintic_spline"
    duration_bounds: tuple[_Number, _Number]
    objectives: list[str] = ["time", "energy"]
    constraints: _Constraints = _Constraints()
    scene: dict[str, Any] | None = None
    reference_point: list[_Number] | None = None
    algorithm: AlgorithmSettings = AlgorithmSettings()
    seed: Annotated[int, pydantic.Field(strict=True, ge=0)] = 1
    samples: Annotated[int, pydantic.Field(strict=True, ge=2)] = 6


def read_task(file: Path) -> tuple[TaskSettings, Places]:
    """The keys of a task, and their lines.

    Raises:
        InvalidInputError: it cannot be read, or a key is missing, unknown or of another kind; the message names file,
            line and key.
    """
    content, places = read_toml(file)
    return checked_settings(content, places), places


def read_toml(file: Path) -> tuple[dict[str, Any], Places]:
    """Content of a TOML file, and the lines of its keys.

    Raises:
        InvalidInputError: it cannot be read.
    """
    try:
        text = file.read_text(encoding="utf-8")
        return tomllib.loads(text), Places(file, key_lines(text))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InvalidInputError(f"{file}: cannot be read as TOML: {why}") from error


def checked_settings(content: dict[str, Any], places: Places) -> TaskSettings:
    """The content of a task's file as its keys.

    Raises:
        InvalidInputError: a key is missing, unknown or of another kind; the message names it.
    """
    try:
        return TaskSettings.model_validate(content)
    except pydantic.ValidationError as error:
        raise InvalidInputError(places.told(_deepest(error))) from error


@dataclass(frozen=True)
class Places:
    """Lines of the keys of a file, for messages.

    Attributes:
        file: the file.
        lines: path of a key -> its line.
    """

    file: Path
    lines: dict[Place, int]

    def prefix(self, place: Place) -> str:
        """File, line and key, as messages begin."""
        line = line_of(self.lines, place)
        at = f"{self.file}: line {line}: " if line else f"{self.file}: "
        return at + ".".join(map(str, place)) + (": " if place else "")

    def told(self, error: Any) -> str:
        """An error of pydantic as one sentence."""
        # Unions put the names of their members into the place; keys of the file are left.
        place = tuple(p for p in error["loc"] if isinstance(p, int) or (p.isidentifier() and not p.startswith("_")))
        place = tuple(p for p in place if p not in ("float", "str", "list", "dict", "MovingSettings"))
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
        """An error of the problem, which begins with the argument's name: the key's, here or in a table."""
        said = str(error).split(":")[0].split(".")[0]
        name = {"boxes": "moving"}.get(said, said)
        place = next((place for place in self.lines if place[-1] == name), ())
        return self.prefix(place) + (str(error).removeprefix(f"{said}: ") if place else str(error))


def _deepest(error: pydantic.ValidationError) -> Any:
    """The most telling of the errors: in a union that of the member that got furthest."""
    return max(error.errors(), key=lambda found: (found["type"] not in _OTHER_KIND, len(found["loc"])))
