"""Robots to choose from: names, files or tables, or a catalogue that tells their price, mass and reach."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, final

import pydantic

from trajevo.base.plain import plain_data
from trajevo.base.shown.brief import brief
from trajevo.base.toml import Places, read_toml, validated
from trajevo.base.units import quantity
from trajevo.errors import InvalidInputError, TrajevoError, no_such_file
from trajevo.formulation.keys.robot_keys import RobotOffer
from trajevo.robot.locate import is_described, robot_path, robot_source
from trajevo.robot.robot import Robot
from trajevo.study.definition import in_json

CATALOGUE_FILE = "catalogue.toml"

#: Keys of an offer that no robot has.
_OF_OFFERS = ("name", "path", "price", "mass", "reach")

#: An amount of money: a number, and the currency after it.
_PRICE = re.compile(r"\s*(\d+(?:\.\d+)?)\s*([^\d\s.,].{0,11}?)\s*")

#: Greatest reach and mass of an arm, and the unit in which greater ones were probably meant.
_MOST = {"m": (20.0, "mm"), "kg": (10_000.0, "g")}

#: What a price is expected to be.
_A_PRICE = 'expected an amount and its currency, such as "24000 EUR"'


@final
@dataclass(frozen=True)
class Candidate:
    """A robot to choose from.

    Attributes:
        name: what it is called in tables and pictures.
        robot: keys of ``[robot]`` of a task, as plain data, with a path that does not depend on the task's folder.
        price: its price [``currency``]; None if it is not told.
        currency: currency of the price; empty without one.
        mass: mass of the arm [kg]; None if it is not told.
        reach: its reach [m]; None if it is not told.
    """

    name: str
    robot: Mapping[str, Any]
    price: float | None = None
    currency: str = ""
    mass: float | None = None
    reach: float | None = None

    __repr__ = brief


class CatalogueSettings(pydantic.BaseModel):
    """The keys of ``catalogue.toml``; paths in it are relative to its folder."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    format: Literal[1] = pydantic.Field(1, description="Version of this format.")
    robot: list[str | RobotOffer] = pydantic.Field(description="The robots, one table each.")


class _Listed(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)

    robots: list[str | RobotOffer]


def candidates_of(given: Any, *, folder: Path) -> tuple[Candidate, ...]:
    """Robots in any form in which a user may list them.

    Args:
        given: a list of names, files, :class:`~trajevo.Robot` or tables with the keys of ``[[robots]]`` of a task; or a
            catalogue, the path of a folder or of its ``catalogue.toml``. A folder without such a file offers every
            folder with ``robot.toml`` and every robot's file in it.
        folder: folder from which relative paths start.

    Raises:
        InvalidInputError: no robots, two of one name, no catalogue there, or a key that is unknown or has an invalid
            value; the message names the robot.
    """
    if isinstance(given, str | Path):
        return _checked(_catalogue(given, folder), f"{given}: ")
    if isinstance(given, Mapping) or not isinstance(given, Sequence):
        raise InvalidInputError(
            f"robots: expected a list of robots or the path of a catalogue, got {type(given).__name__}"
        )
    places = Places(Path("robots"), {})
    plain = [one if isinstance(one, RobotOffer) else _plain(one) for one in given]
    try:
        offers = validated(_Listed, {"robots": plain}, places).robots
    except InvalidInputError as error:
        raise InvalidInputError(str(error).removeprefix(places.prefix(()))) from error
    return _checked([_candidate(one, folder, "robots: ") for one in offers], "robots: ")


def _plain(one: Any) -> Any:
    """A name, a file, a robot or a table as the keys of an offer."""
    if isinstance(one, Robot):
        if one.settings is None:
            raise InvalidInputError(f"robots: {one.name!r} was not loaded by load_robot, so no file can refer to it")
        loaded = one.settings if isinstance(one.settings, Mapping) else {"name": str(one.settings)}
        return {"path": str(loaded["name"]), **plain_data("robots", in_json(dict(loaded))), "name": one.name}
    return str(one) if isinstance(one, Path) else plain_data("robots", in_json(one))


def _catalogue(given: str | Path, folder: Path) -> list[Candidate]:
    if not str(given).strip():  # the path of no text is that of the folder itself
        raise InvalidInputError(f"robots: expected a list of robots, or a folder with {CATALOGUE_FILE}, got {given!r}")
    place = folder / given
    file = place / CATALOGUE_FILE if place.is_dir() else place
    if file.is_file() and file.suffix == ".toml":
        content, places = read_toml(file)
        settings = validated(CatalogueSettings, content, places)
        found = []
        for number, offer in enumerate(settings.robot):
            found.append(_candidate(offer, file.resolve().parent, places.start(("robot", number))))
        return found
    if not place.is_dir():
        listed = f"; one robot is written as a list, [{str(given)!r}]" if len(Path(given).parts) == 1 else ""
        got = f"the file {given}" if place.exists() else no_such_file(place, "folder").replace(str(place), str(given))
        raise InvalidInputError(
            f"robots: expected a list of robots, or a folder with {CATALOGUE_FILE}, got {got}{listed}"
        )
    robots = sorted(one for one in place.iterdir() if (one / "robot.toml").is_file() or _is_file_of_robot(one))
    if not robots:
        raise InvalidInputError(
            f"robots: {given}: expected {CATALOGUE_FILE}, folders with robot.toml or files of robots in it, got none"
        )
    return [_candidate(str(one.resolve()), place, f"{given}: ") for one in robots]


def _is_file_of_robot(place: Path) -> bool:
    return place.is_file() and is_described(place)


def _candidate(offer: str | RobotOffer, folder: Path, where: str) -> Candidate:
    """A candidate from an offer; ``where`` begins messages about it."""
    if isinstance(offer, str):
        offer = RobotOffer.model_validate({"name": offer})
    name = Path(offer.name).name.removesuffix(Path(offer.name).suffix) if _is_path(offer.name) else offer.name
    given = in_json(offer.model_dump(exclude_none=True, exclude=set(_OF_OFFERS), by_alias=True))
    at = f"{where}{name}: "
    without_file = {"dh", "joints"} & set(given)
    if without_file and offer.path is not None:
        raise InvalidInputError(f"{at}path: expected none with {min(without_file)}, which describes the robot itself")
    source = offer.name if offer.path is None else offer.path
    given["name"] = name if without_file else _from(source, folder)
    if not without_file:
        try:
            robot_source(given["name"])
        except TrajevoError as error:
            raise InvalidInputError(f"{at}{str(error).removeprefix('robot: ')}") from error
    if "packages" in given:
        listed = given["packages"]
        given["packages"] = [str(folder / one) for one in ([listed] if isinstance(listed, str) else listed)]
    price, currency = _price(offer.price, f"{at}price")
    return Candidate(
        name=name,
        robot=given,
        price=price,
        currency=currency,
        mass=_amount(offer.mass, "kg", f"{at}mass"),
        reach=_amount(offer.reach, "m", f"{at}reach"),
    )


def _is_path(source: str) -> bool:
    return len(Path(source).parts) > 1 or Path(source).suffix.lower() in (".urdf", ".xacro", ".xml", ".mjcf")


def _from(source: str, folder: Path) -> str:
    """A robot's name, or its path from a folder on."""
    known = robot_path(source, folder=folder) is not None or _is_path(source)
    return str((folder / source).resolve()) if known else source


def _price(given: float | str | None, name: str) -> tuple[float | None, str]:
    """Amount and currency."""
    if given is None:
        return None, ""
    if isinstance(given, str):
        match = _PRICE.fullmatch(given)
        if match is None:
            raise InvalidInputError(f"{name}: {_A_PRICE}, got {given!r}")
        return float(match[1]), match[2]
    if not math.isfinite(given) or given < 0.0:
        raise InvalidInputError(f"{name}: {_A_PRICE}, got {given!r}")
    return float(given), ""


def _amount(given: float | str | None, unit: str, name: str) -> float | None:
    """A mass or a length."""
    if given is None:
        return None
    value = quantity(given, unit, name=name) if isinstance(given, str) else float(given)
    if not math.isfinite(value) or value <= 0.0:
        raise InvalidInputError(f"{name}: expected a positive number [{unit}], got {given!r}")
    most, small = _MOST[unit]
    if value > most:
        raise InvalidInputError(
            f"{name}: {value:g} {unit} looks like {small}: expected at most {most:g} {unit}, {1e-3 * value:g} if it is "
            f"{small}"
        )
    return value


def _checked(candidates: Sequence[Candidate], where: str) -> tuple[Candidate, ...]:
    if not candidates:
        raise InvalidInputError(f"{where}expected at least one robot to choose from, got an empty list")
    counts = Counter(one.name.casefold() for one in candidates)
    twice = next((one for one in candidates if counts[one.name.casefold()] > 1), None)
    if twice is not None:
        raise InvalidInputError(
            f"{where}the robot {twice.name!r} is given twice; give each a name of its own (name = ..., path = ...)"
        )
    return tuple(candidates)


def chosen_among(candidates: Sequence[Candidate], names: Any, *, folder: Path) -> tuple[Candidate, ...]:
    """Candidates by their names; what is no candidate's name is a robot in any other form.

    Args:
        candidates: those of a task; may be none.
        names: as for :func:`candidates_of`.
        folder: as for :func:`candidates_of`.

    Raises:
        InvalidInputError: as for :func:`candidates_of`.
    """
    known = {one.name: one for one in candidates}
    if isinstance(names, str | Path) or not isinstance(names, Sequence) or not known:
        return candidates_of(names, folder=folder)
    found: list[Candidate] = []
    for one in names:
        own = known.get(one) if isinstance(one, str) else None
        found += [own] if own is not None else candidates_of([one], folder=folder)
    return _checked(found, "robots: ")
