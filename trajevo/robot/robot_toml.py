"""The file ``robot.toml``: what a URDF cannot hold, with units, converted to SI."""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from pydantic_core import PydanticCustomError

from trajevo.base.arrays import Array
from trajevo.base.toml import Place, read_toml, validated
from trajevo.base.units import per_time, si_unit, to_si
from trajevo.errors import InvalidInputError, TrajevoError, UnknownNameError, known_names
from trajevo.robot.loading.dh import DhTable
from trajevo.robot.loading.dh_keys import DhKeys
from trajevo.robot.loading.drive_keys import SourcedDriveKeys, SourcedSupplyKeys
from trajevo.robot.loading.drives import drive_values
from trajevo.robot.transmission import CoupledScrews, Direct, Transmission

#: A number: integers are accepted, text and booleans are not.
_Number = Annotated[float, pydantic.Strict()]


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("expected printable characters on one line")
    return text


#: Text that is printed and exported.
_Text = Annotated[str, pydantic.AfterValidator(_printable)]


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, defer_build=True)


class _Limit(_Strict):
    limit: Annotated[_Number, pydantic.Field(gt=0.0)] = pydantic.Field(
        description="Greatest magnitude; inf for none [`unit`]."
    )
    unit: str = pydantic.Field(description="Unit of the number, such as deg/s^3.")


class _DirectedLimit(_Strict):
    """One limit for both directions of motion, or one for each; all are magnitudes."""

    limit: Annotated[_Number, pydantic.Field(gt=0.0)] | None = pydantic.Field(
        None, description="Greatest magnitude in both directions; inf for none [`unit`]."
    )
    forward: Annotated[_Number, pydantic.Field(gt=0.0)] | None = pydantic.Field(
        None, description="In the positive direction [`unit`]."
    )
    backward: Annotated[_Number, pydantic.Field(gt=0.0)] | None = pydantic.Field(
        None, description="In the negative direction [`unit`]."
    )
    unit: str = pydantic.Field(description="Unit of the numbers, such as deg/s, mm/s^2 or N*m.")

    @pydantic.model_validator(mode="after")
    def _one_or_both(self) -> _DirectedLimit:
        given = [name for name in ("limit", "forward", "backward") if getattr(self, name) is not None]
        if given not in (["limit"], ["forward", "backward"]):
            raise ValueError("expected either limit, or forward and backward")
        return self


class _Range(_Strict):
    lower: _Number = pydantic.Field(description="Lower end; -inf for none [`unit`].")
    upper: _Number = pydantic.Field(description="Upper end; inf for none [`unit`].")
    unit: str = pydantic.Field(description="Unit of both, such as deg or mm.")


class _Amount(_Strict):
    value: Annotated[_Number, pydantic.Field(ge=0.0, allow_inf_nan=False)] = pydantic.Field(
        description="The amount [`unit`]."
    )
    unit: str = pydantic.Field(description="Unit of the number.")


class _DryFriction(_Strict):
    """One value for both directions of motion, or one for each."""

    value: Annotated[_Number, pydantic.Field(ge=0.0, allow_inf_nan=False)] | None = pydantic.Field(
        None, description="In both directions [`unit`]."
    )
    forward: Annotated[_Number, pydantic.Field(ge=0.0, allow_inf_nan=False)] | None = pydantic.Field(
        None, description="In the positive direction [`unit`]."
    )
    backward: Annotated[_Number, pydantic.Field(ge=0.0, allow_inf_nan=False)] | None = pydantic.Field(
        None, description="In the negative direction [`unit`]."
    )
    unit: str = pydantic.Field(description="Unit of the numbers, N or N*m.")

    @pydantic.model_validator(mode="after")
    def _one_or_both(self) -> _DryFriction:
        given = [name for name in ("value", "forward", "backward") if getattr(self, name) is not None]
        if given not in (["value"], ["forward", "backward"]):
            raise ValueError("expected either value, or forward and backward")
        return self


class _Vector(_Strict):
    vector: tuple[_Number, _Number, _Number] = pydantic.Field(description="Its x, y and z [`unit`].")
    unit: str = pydantic.Field(description="Unit of the numbers, m/s^2.")


class _Joint(_Strict):
    position: _Range = pydantic.Field(description="Range of positions.")
    velocity: _DirectedLimit = pydantic.Field(description="Greatest velocity.")
    acceleration: _DirectedLimit = pydantic.Field(description="Greatest acceleration.")
    jerk: _Limit = pydantic.Field(description="Greatest jerk.")
    effort: _DirectedLimit = pydantic.Field(description="Greatest torque or force.")
    viscous_friction: _Amount | None = pydantic.Field(None, description="Friction by velocity, in N*m*s/rad or N*s/m.")
    coulomb_friction: _DryFriction | None = pydantic.Field(None, description="Dry friction, in N*m or N.")
    armature: _Amount | None = pydantic.Field(
        None, description="Inertia of what turns with the motor, on the joint's side, in kg*m^2 or kg."
    )
    rotor_inertia: _Amount | None = pydantic.Field(
        None, description="Inertia of the motor's rotor; with `gear_ratio` instead of `armature`, in kg*m^2."
    )
    gear_ratio: Annotated[_Number, pydantic.Field(gt=0.0, allow_inf_nan=False)] | None = pydantic.Field(
        None, description="Turns of the motor per turn of the joint; no unit."
    )

    @pydantic.model_validator(mode="after")
    def _armature_or_gear(self) -> _Joint:
        by_gear = [name for name in ("rotor_inertia", "gear_ratio") if getattr(self, name) is not None]
        if len(by_gear) == 1 or (by_gear and self.armature is not None):
            raise ValueError("expected armature, or rotor_inertia and gear_ratio")
        return self


class _CoupledScrews(_Strict):
    kind: Literal["coupled_screws"] = pydantic.Field(
        description="Two parallel screws that drive one slide and one swivel."
    )
    screws: tuple[_Text, _Text] = pydantic.Field(description="Names of the two actuators.")
    slide: str = pydantic.Field(description="Joint of the URDF that slides.")
    swivel: str = pydantic.Field(description="Joint of the URDF that swivels.")
    span: _Amount = pydantic.Field(description="Distance of the screws.")


class _Place(_Strict):
    """Numbers are in m and rad, or text with a unit."""

    position: list[_Number | str] = pydantic.Field(
        [0.0, 0.0, 0.0], description="Where its origin is, x, y and z; a text has its unit [m]."
    )
    rpy: list[_Number | str] = pydantic.Field(
        [0.0, 0.0, 0.0], description="How it is turned: roll, pitch and yaw; a text has its unit [rad]."
    )


class _Tool(_Place):
    name: _Text = pydantic.Field(description="Name of the tool's frame.")
    parent: str = pydantic.Field(description="Frame to which it is mounted.")
    mass: _Number | str = pydantic.Field(0.0, description="Its mass; a text has its unit [kg].")
    com: list[_Number | str] | None = pydantic.Field(
        None, description="Its centre of mass in its own frame, x, y and z; a text has its unit [m]."
    )
    inertia: list[_Number] | list[list[_Number]] | None = pydantic.Field(
        None, description="Its inertia about the centre of mass: 3 principal values, or 3 rows of 3 [kg*m^2]."
    )


class RobotSettings(_Strict):
    """The keys of ``robot.toml``, each number with its unit beside it."""

    name: _Text = pydantic.Field(description="Name of the robot.")
    dh: DhKeys | None = pydantic.Field(None, description="Denavit-Hartenberg table, instead of a URDF.")
    urdf: str | None = pydantic.Field(
        default=None, validate_default=True, description="File beside this one that describes links and joints."
    )
    tool: _Text = pydantic.Field(description="Frame at the end effector.")
    reference: _Text = pydantic.Field(description="Where the numbers come from.")
    format: Annotated[int, pydantic.Field(strict=True, ge=1, le=1)] = pydantic.Field(
        description="Version of this format."
    )
    gravity: _Vector = pydantic.Field(description="Gravity in the base frame.")
    allow_massless: Annotated[bool, pydantic.Strict()] = pydantic.Field(
        False, description="Links without mass are meant: efforts leave them out."
    )
    transmission: _CoupledScrews | None = pydantic.Field(
        None, description="How actuators move the joints, unless each moves its own."
    )
    base: _Place | None = pydantic.Field(None, description="Where the robot stands in the cell.")
    tools: list[_Tool] | None = pydantic.Field(
        None, description="Tools that can be mounted, of which `tool` names one."
    )
    joints: dict[str, _Joint] = pydantic.Field(description="Limits and friction of each joint, by its name.")
    drives: dict[str, SourcedDriveKeys] = pydantic.Field({}, description="Drives of joints, by their names.")
    supply: SourcedSupplyKeys | None = pydantic.Field(None, description="Supply of all drives.")

    @pydantic.field_validator("urdf")
    @classmethod
    def _or_dh(cls, urdf: str | None, info: pydantic.ValidationInfo) -> str | None:
        if urdf is None and "dh" in info.data and info.data["dh"] is None:  # a table that is wrong is no data
            raise PydanticCustomError("missing", "expected a URDF, or a table [dh] instead")
        if urdf is not None and info.data.get("dh") is not None:
            raise ValueError("expected either the name of a URDF or a table [dh], got both")
        return urdf


def entry_problems(path: Path) -> list[str]:
    """Every entry of a ``robot.toml`` that is missing, unknown or of the wrong type, one sentence each.

    Raises:
        InvalidInputError: the file cannot be read as TOML.
    """
    content, places = read_toml(path)
    try:
        RobotSettings.model_validate(content)
    except pydantic.ValidationError as error:
        return [places.told(entry, RobotSettings) for entry in error.errors()]
    return []


class RobotFile:
    """A ``robot.toml`` that was read and checked.

    Args:
        path: the file.

    Raises:
        InvalidInputError: the file cannot be read, or an entry is missing, unknown or wrong; the message names it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        content, self.places = read_toml(path)
        self.settings = validated(RobotSettings, content, self.places)

    @property
    def urdf(self) -> Path | None:
        """The URDF; None if a Denavit-Hartenberg table takes its place."""
        return None if self.settings.urdf is None else self.path.parent / self.settings.urdf

    def written(self) -> str:
        """The Denavit-Hartenberg table as URDF text.

        Raises:
            InvalidInputError: there is none, or an entry that cannot be used.
        """
        if self.settings.dh is None:
            raise InvalidInputError(f"{self.path}: expected a table [dh], got none")
        try:
            return DhTable.of(**self.settings.dh.arguments).urdf(self.settings.name)
        except TrajevoError as error:
            raise InvalidInputError(f"{self._at('dh')}: {str(error).removeprefix('dh.')}") from error

    @property
    def base(self) -> dict[str, Any] | None:
        """Pose of the first link in the cell, as written."""
        return None if self.settings.base is None else self.settings.base.model_dump()

    @property
    def tools(self) -> list[dict[str, Any]] | None:
        """The tools of which one can be mounted, as written."""
        given = self.settings.tools
        return None if given is None else [tool.model_dump(exclude_none=True) for tool in given]

    def gravity(self) -> Array:
        """Gravity in the base frame, shape (3,) [m/s²]."""
        given = self.settings.gravity
        if not np.isfinite(given.vector).all():
            raise InvalidInputError(
                f"{self._at('gravity', 'vector')}: expected finite numbers, got {list(given.vector)}"
            )
        return np.array([self._si(x, given.unit, "m/s^2", ("gravity",)) for x in given.vector])

    def transmission(
        self, model_names: tuple[str, ...], model_units: tuple[str, ...]
    ) -> tuple[Transmission, tuple[str, ...], tuple[str, ...]]:
        """The transmission, and the names and units of the actuators in the order of the model's joints."""
        given = self.settings.transmission
        if given is None:
            return Direct(), model_names, model_units
        for role, name, unit in (("slide", given.slide, "m"), ("swivel", given.swivel, "rad")):
            if name not in model_names or model_units[model_names.index(name)] != unit:
                raise InvalidInputError(
                    f"{self._at('transmission', role)}: expected a joint of the URDF in {unit}, got {name!r}"
                )
        slide, swivel = model_names.index(given.slide), model_names.index(given.swivel)
        names, units = list(model_names), list(model_units)
        names[slide], names[swivel] = given.screws
        if len(set(names)) < len(names):
            raise InvalidInputError(
                f"{self._at('transmission', 'screws')}: expected new names, got {list(given.screws)}"
            )
        units[slide] = units[swivel] = "m"
        span = self._si(given.span.value, given.span.unit, "m", ("transmission", "span"))
        if not span > 0.0:
            raise InvalidInputError(f"{self._at('transmission', 'span')}: expected a positive length, got {span}")
        return CoupledScrews(slide, swivel, span), tuple(names), tuple(units)

    def limits(self, names: tuple[str, ...], units: tuple[str, ...], locked: Collection[str] = ()) -> dict[str, Array]:
        """Columns of JointLimits, SI; entries of locked joints are ignored."""
        if set(self.settings.joints) - set(locked) != set(names):
            for name in self.settings.joints:
                if name not in names and name not in locked:
                    start = self.places.start(("joints", name))
                    raise InvalidInputError(
                        f"{start}[joints.{name}]: unknown joint {name!r}; {known_names(name, names)}"
                    )
            missing = next(name for name in names if name not in self.settings.joints)
            raise InvalidInputError(f"{self.path}: expected a table [joints.{missing}] with the limits of that joint")
        rows = [self.joint_limits(name, unit) for name, unit in zip(names, units, strict=True)]
        keys = dict.fromkeys(key for row in rows for key in row)
        return {key: np.array([row.get(key, row[key.removesuffix("_backward")]) for row in rows]) for key in keys}

    def joint_limits(self, name: str, unit: str) -> dict[str, float]:
        """Limits of one actuator of the file, SI: lower, upper, velocity, acceleration, jerk, effort.

        Where they differ by direction, also those of the negative one, as ``velocity_backward``.
        """
        joint = self.settings.joints[name]
        lower, upper = self._range(joint.position, unit, ("joints", name, "position"))
        row = {"lower": lower, "upper": upper}
        si = {key: per_time(unit, order) for order, key in enumerate(("velocity", "acceleration", "jerk"), start=1)}
        si["effort"] = "N" if unit == "m" else "N*m"
        for key, expected in si.items():
            given: _Limit | _DirectedLimit = getattr(joint, key)
            place = ("joints", name, key)
            if given.limit is not None:
                row[key] = self._si(given.limit, given.unit, expected, place)
            elif isinstance(given, _DirectedLimit) and given.forward is not None and given.backward is not None:
                row[key] = self._si(given.forward, given.unit, expected, place)
                row[f"{key}_backward"] = self._si(given.backward, given.unit, expected, place)
        return row

    def drives(
        self, names: tuple[str, ...], units: tuple[str, ...], locked: Collection[str] = ()
    ) -> dict[str, dict[str, Any]]:
        """What is told of the drives of joints, SI, by joint; entries of locked joints are ignored."""
        found = {}
        for name, given in self.settings.drives.items():
            if name in locked:
                continue
            if name not in names:
                start = self.places.start(("drives", name))
                raise InvalidInputError(f"{start}[drives.{name}]: unknown joint {name!r}; {known_names(name, names)}")
            at = partial(self._at, "drives", name)
            found[name] = drive_values(given.arguments, units[names.index(name)], at)
        return found

    @property
    def supply(self) -> dict[str, Any] | None:
        """What is told of the supply of all drives, as written."""
        return None if self.settings.supply is None else self.settings.supply.arguments

    def friction(self, names: tuple[str, ...], units: tuple[str, ...]) -> dict[str, Array]:
        """Columns of Friction, SI; NaN where nothing is declared."""
        expected = {
            "viscous": ("viscous_friction", "value", {"m": "N*s/m", "rad": "N*m*s/rad"}),
            "coulomb": ("coulomb_friction", "forward", {"m": "N", "rad": "N*m"}),
            "coulomb_backward": ("coulomb_friction", "backward", {"m": "N", "rad": "N*m"}),
            "armature": ("armature", "value", {"m": "kg", "rad": "kg*m^2"}),
        }
        columns = {}
        for column, (key, way, unit_of) in expected.items():
            values = []
            for name, unit in zip(names, units, strict=True):
                given: _Amount | _DryFriction | None = getattr(self.settings.joints[name], key)
                if given is None:
                    values.append(self._geared(name) if key == "armature" else np.nan)
                    continue
                value = getattr(given, way) if given.value is None else given.value
                values.append(self._si(value, given.unit, unit_of[unit], ("joints", name, key)))
            columns[column] = np.array(values)
        return columns

    def _geared(self, name: str) -> float:
        """Armature of a joint by the inertia of its rotor and its gear, NaN without them [kg·m² or kg]."""
        joint = self.settings.joints[name]
        if joint.rotor_inertia is None or joint.gear_ratio is None:
            return float("nan")
        rotor, place = joint.rotor_inertia, ("joints", name, "rotor_inertia")
        return self._si(rotor.value, rotor.unit, "kg*m^2", place) * joint.gear_ratio**2

    def _range(self, given: _Range, unit: str, place: Place) -> tuple[float, float]:
        """Lower and upper position, SI; an error shows them in the units of the file, where they can be corrected."""
        if not given.lower < given.upper:  # also false for NaN
            raise InvalidInputError(
                f"{self._at(*place)}: lower must be below upper, got {given.lower:g} and {given.upper:g} {given.unit}"
            )
        lower, upper = (self._si(x, given.unit, unit, place) for x in (given.lower, given.upper))
        return lower, upper

    def _si(self, value: float, unit: str, expected: str, place: Place) -> float:
        try:
            found = si_unit(unit)
        except UnknownNameError as error:
            raise InvalidInputError(f"{self._at(*place)}: {error}") from error
        if found != expected:
            raise InvalidInputError(f"{self._at(*place)}: unit {unit!r}, expected one that converts to {expected!r}")
        return value * to_si(unit) if math.isfinite(value) else value

    def _at(self, *place: str | int) -> str:
        """File and line of a key, and what it is the key of."""
        joint = f"joint {place[1]!r}: {place[2]}" if place[0] == "joints" else ".".join(map(str, place))
        return self.places.start(place) + joint
