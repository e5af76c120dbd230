"""Pages of the keys of task.toml, study.toml and robot.toml, from the models that read these files."""

from __future__ import annotations

import inspect
import re
import types
import typing
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields
from typing import Any, Literal, get_args, get_origin

import pydantic
from pydantic_core import PydanticUndefined

from trajevo.formulation.constraints.scene import Attached, Scene
from trajevo.formulation.constraints.scenes.obstacles import SHAPES, Obstacle
from trajevo.formulation.keys.robot_keys import RobotOffer
from trajevo.formulation.search import Search
from trajevo.formulation.task_file import task_model
from trajevo.robot.robot_toml import RobotSettings
from trajevo.study.definition import StudySettings
from trajevo.study.robots.catalogue import CatalogueSettings
from trajevo.trajectory.interpolants.splines.b_spline import SHAPE, BSpline

#: Types in the words of a person who writes TOML.
WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false", type(Any): "anything"}

#: A unit in square brackets at the end of a description.
_UNIT = re.compile(r"\s*\[([^\]]+)\]\.?$")


@dataclass(frozen=True)
class Key:
    """One key of a table.

    Attributes:
        name: the key.
        kind: what may be written, in words.
        default: what holds if it is not given: TOML, ``needed``, or empty if nothing does.
        unit: unit of its numbers, or empty.
        says: what it means.
    """

    name: str
    kind: str
    default: str
    unit: str
    says: str


@dataclass(frozen=True)
class Table:
    """One table of a file.

    Attributes:
        title: as it stands in the file, such as ``[robot]``; of the file itself empty.
        says: what it is.
        keys: its keys.
    """

    title: str
    says: str
    keys: tuple[Key, ...]


def task() -> list[Table]:
    """The tables of ``task.toml``."""
    return [*_tables(task_model()), _bspline(), *_scene()]


def study() -> list[Table]:
    """The tables of ``study.toml``; a search's settings stand beside its other keys."""
    first, *others = _tables(StudySettings)
    search = (_key(name, field) for name, field in Search.model_fields.items() if name != "seed")
    return [Table(first.title, first.says, (*first.keys, *search)), *others]


def robot() -> list[Table]:
    """The tables of ``robot.toml``."""
    return list(_tables(RobotSettings))


def catalogue() -> list[Table]:
    """The tables of ``catalogue.toml``."""
    return list(_tables(CatalogueSettings))


def _tables(model: type[pydantic.BaseModel], place: tuple[str, ...] = (), title: str = "") -> Iterator[Table]:
    """The table of a model, and those of the models in its fields.

    Args:
        model: the model.
        place: keys that lead to it.
        title: how it is written in the file.
    """
    if model is RobotOffer:  # whose other keys, and the tables in them, are those of another table
        added = RobotOffer.model_fields.keys() - RobotOffer.__mro__[1].model_fields.keys()  # type: ignore[attr-defined]
        told = ((name, field) for name, field in model.model_fields.items() if name in added)
        yield Table(title, _first(model), tuple(_key(name, field) for name, field in told))
        return
    own = {name: field for name, field in model.model_fields.items() if not (model is Search and name == "seed")}
    yield Table(title, _first(model), tuple(_key(name, field) for name, field in own.items()))
    for name, field in own.items():
        ways: dict[Any, list[Any]] = {}
        for inner, around in _models(field.annotation):
            ways.setdefault(inner, []).append(around)
        for inner, around_it in ways.items():
            path = (*place, field.alias or name, *(("NAME",) if around_it == [dict] else ()))
            dotted = ".".join(path)
            titles = (f"[[{dotted}]]" if around is list else f"[{dotted}]" for around in around_it)
            yield from _tables(inner, path, " or ".join(titles))


def _models(annotation: Any, around: Any = None) -> Iterator[tuple[type[pydantic.BaseModel], Any]]:
    """Models in an annotation, each with the list or the mapping that holds it."""
    if inspect.isclass(annotation) and issubclass(annotation, pydantic.BaseModel):
        yield annotation, around
    origin = get_origin(annotation)
    for part in get_args(annotation) if origin is not Literal else ():
        yield from _models(part, origin if origin in (list, dict) else around)


def _key(name: str, field: Any) -> Key:
    alias = "name" if name == "algorithm" and field.validation_alias is not None else field.alias
    says, unit = _with_unit(field.description or "")
    return _made(alias or name, field.annotation, _default(field), says, unit)


def _with_unit(text: str) -> tuple[str, str]:
    """A description without its unit, and the unit; ``1`` stands for none."""
    found = _UNIT.search(text)
    return (text[: found.start()].rstrip(".") + ".", found[1].replace("`", "")) if found else (text, "")


def _default(field: Any) -> str:
    if field.default is PydanticUndefined and field.default_factory is None:
        return "needed"
    return _toml(field.default)


def _toml(value: Any) -> str:
    """A value as it is written in TOML; nothing for None, an empty list, or a table of defaults."""
    if value is None or value in ([], {}, ()) or isinstance(value, pydantic.BaseModel):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _kinds(annotation: Any) -> Iterator[str]:
    """What may be written for an annotation, in words."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is typing.Annotated:
        yield from _kinds(parts[0])
    elif origin in (typing.Union, types.UnionType):
        for part in parts:
            yield from _kinds(part)
    elif origin is Literal:
        yield from map(_toml, parts)
    elif origin is tuple:
        yield "list" if parts[-1] is Ellipsis else f"{len(parts)} values"
    elif origin is list:
        inner = " or ".join(dict.fromkeys(_kinds(parts[0])))
        yield {"table": "tables", "text": "list of texts", "number": "list of numbers"}.get(inner, "list")
    elif origin is dict or (inspect.isclass(annotation) and issubclass(annotation, pydantic.BaseModel)):
        yield "table"
    elif annotation in WORDS:
        yield WORDS[annotation]


def _first(thing: Any) -> str:
    """The first sentence of a docstring, for people who read no Python; a model without one has no sentence."""
    own = vars(thing).get("__doc__") or ""
    text = " ".join(own.partition("\n\n")[0].split()).replace("``", "`")
    return re.sub(r":\w+:`~?(?:[^`<]*\.)?([^`<]+)`", r"`\1`", text)


def _bspline() -> Table:
    """The settings of B-splines, as their class describes them."""
    said = described(BSpline)
    keys = tuple(_plain(name, type(value), _toml(value), said[name]) for name, value in SHAPE.items())
    return Table("[bspline]", "How the curves of the interpolant `bspline` are.", keys)


def _scene() -> Iterator[Table]:
    """What is around the robot: the scene, its obstacles by shape, and what links carry."""
    read = Key("file", "text", "", "", "File with more obstacles: a scene of MoveIt (.scene) or MJCF (.xml).")
    yield Table("[scene]", _first(Scene), (read, *_of_fields(Scene)))
    common = _of_fields(Obstacle)
    turned = Key("rotation", "list", "", "1", "Rotation matrix in place of `rpy`, 3 rows of 3.")
    shape = Key(
        "shape", " or ".join(map(_toml, SHAPES)), "needed", "", "What it is; its own keys are in the tables below."
    )
    yield Table("[[scene.obstacles]]", _first(Obstacle), (shape, *common, turned))
    for name, kind in SHAPES.items():
        own = tuple(key for key in _of_fields(kind) if key.name not in {one.name for one in common})
        yield Table(f'[[scene.obstacles]] with shape = "{name}"', _first(kind), own)
    on = next(key for key in _of_fields(Attached) if key.name == "on")
    yield Table("[[scene.attached]]", f"{_first(Attached)} Besides `on` it has the keys of an obstacle.", (on,))


def _of_fields(kind: type) -> tuple[Key, ...]:
    """Keys of a dataclass, as its docstring describes its attributes."""
    said, hints = described(kind), typing.get_type_hints(kind)
    return tuple(
        _plain(one.name, hints[one.name], "needed" if one.default is MISSING else _toml(one.default), said[one.name])
        for one in fields(kind)  # type: ignore[arg-type]
    )


def _plain(name: str, annotation: Any, default: str, text: str) -> Key:
    says, unit = _with_unit(text.replace("if None", "if not given").replace("None for", "without it"))
    return _made(name, annotation, default, says, unit)


def _made(name: str, annotation: Any, default: str, says: str, unit: str) -> Key:
    kinds = " or ".join(dict.fromkeys(_kinds(annotation))) or "table"
    return Key(name, kinds, default, unit, f"{says[:1].upper()}{says[1:].rstrip('.')}.")


def described(kind: type) -> dict[str, str]:
    """What the docstrings of a class and of its bases say of each attribute."""
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        listed = inspect.cleandoc(one.__doc__ or "").partition("Attributes:\n")[2].partition("\n\n")[0]
        for name, text in re.findall(r"^    (\w+): (.+(?:\n {8}.+)*)", listed, re.MULTILINE):
            found[name] = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", " ".join(text.split())).replace("``", "`")
    return found
