"""An identified payload: what was found, how sure each number is, and what the motion did not show."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from trajevo.base.arrays import Array, frozen, real_number
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.capacity.identification.physical import is_consistent, nearest_consistent, payload_of
from trajevo.errors import InvalidInputError
from trajevo.robot.payload import PARAMETERS, Payload, tensor_of

#: Units of the parameters.
UNITS = ("kg",) + 3 * ("kg·m",) + 6 * ("kg·m²",)

#: Mass, first moments and inertia among the parameters.
KINDS = (slice(0, 1), slice(1, 4), slice(4, 10))

#: Standard deviation, as a share of the greatest parameter of its kind, from which on one is hardly known.
_WEAK = 0.3

#: Confidence of what is printed.
CONFIDENCE = 0.95

#: Columns of a table of the parameters.
HEADERS = ("parameter", "found", f"± ({100.0 * CONFIDENCE:g} %)", "σ as a share")


@final
@dataclass(frozen=True, eq=False)
class IdentifiedPayload:
    """A payload that was identified from a log.

    Attributes:
        parameters: mass [kg], mass times centre of mass [kg·m] and inertia about the tool's origin [kg·m²] in the
            order of :data:`trajevo.robot.payload.PARAMETERS`, shape (10,); NaN for what the motion does not show.
        covariance: covariance of these, shape (10, 10) [their units], NaN likewise.
        condition: condition number of the regressor, its rows weighted by what is left of each joint's efforts and its
            columns scaled as for the objective ``payload_condition`` [1].
        left: standard deviation of what is left of the efforts of each joint, shape (n_joints,) [N·m or N]; NaN for
            joints of which nothing was measured.
        friction: offset [N·m or N], viscous [N·m·s/rad or N·s/m] and dry friction [N·m or N] of each joint that were
            found too, shape (n_joints, 3); None if they were not sought.
        joint_names: names of the robot's joints.
        tool: name of the frame in which the centre of mass and the inertia are.
        instants: number of instants that were used.
        freedom: rows less parameters.
        by_difference: whether a log of the same motion without payload was taken off, instead of the robot's model.
        mass_given: whether the mass was given.
        source: the log.
    """

    parameters: Array
    covariance: Array
    condition: float
    left: Array
    friction: Array | None
    joint_names: tuple[str, ...]
    tool: str
    instants: int
    freedom: int
    by_difference: bool
    mass_given: bool
    source: str

    __repr__ = brief

    @property
    def sigma(self) -> Array:
        """Standard deviation of every parameter, shape (10,) [its unit], NaN for what the motion does not show."""
        return frozen(np.sqrt(np.diagonal(self.covariance)))

    @property
    def doubt(self) -> Array:
        """Half the width of every parameter's 95 % interval, shape (10,) [its unit], NaN where it is not shown."""
        return frozen(self._factor(CONFIDENCE, 1) * self.sigma)

    @property
    def relative_sigma(self) -> Array:
        """Standard deviation of every parameter as a share of its magnitude, shape (10,) [1]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return frozen(self.sigma / np.abs(self.parameters))

    @property
    def not_shown(self) -> tuple[str, ...]:
        """Parameters that the motion does not show."""
        return tuple(name for name, value in zip(PARAMETERS, self.parameters, strict=True) if np.isnan(value))

    @property
    def hardly_known(self) -> tuple[str, ...]:
        """Parameters whose standard deviation is more than 30 % of the greatest one of their kind."""
        greatest = np.concatenate(
            [np.full(kind.stop - kind.start, np.abs(self.parameters[kind]).max()) for kind in KINDS]
        )
        weak = self.sigma > _WEAK * greatest
        return tuple(name for name, one in zip(PARAMETERS, weak, strict=True) if one)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return float(self.parameters[0])

    @property
    def com(self) -> Array:
        """Centre of mass in the tool frame, shape (3,) [m]."""
        return frozen(self.parameters[1:4] / self.mass)

    @property
    def com_covariance(self) -> Array:
        """Covariance of the centre of mass to first order, shape (3, 3) [m²]."""
        slopes = np.column_stack([-self.com, np.eye(3)]) / self.mass
        return frozen(slopes @ self.covariance[:4, :4] @ slopes.T)

    @property
    def inertia(self) -> Array:
        """Inertia about the centre of mass along the tool's axes, shape (3, 3) [kg·m²]."""
        com = self.com
        return frozen(tensor_of(self.parameters[4:]) - self.mass * (com @ com * np.eye(3) - np.outer(com, com)))

    @property
    def consistent(self) -> bool:
        """Whether a body can have what was found: its mass is positive and its pseudo-inertia positive definite."""
        if np.isnan(self.parameters[:4]).any() or not self.mass > 0.0:
            return False
        return bool(np.isnan(self.parameters[4:]).any()) or is_consistent(self.parameters)

    @cached_property
    def nearest(self) -> Array:
        """The parameters, or the nearest ones by their covariance that a body can have, shape (10,) [its unit].

        Raises:
            InvalidInputError: some parameter is not known.
        """
        if self.not_shown:
            raise InvalidInputError(f"payload: expected a motion that shows all parameters, not {self._unseen}")
        if self.consistent:
            return self.parameters
        if self.mass_given:
            raise InvalidInputError(
                f"payload: no body of {self.mass:g} kg has the moments that were found; identify the mass too"
            )
        return frozen(nearest_consistent(self.parameters, self.covariance))

    @cached_property
    def payload(self) -> Payload:
        """What was found as a payload, or the nearest one that a body can be; a point mass if no inertia was shown.

        Raises:
            InvalidInputError: the motion does not show mass and centre of mass, or the mass is not positive.
        """
        if np.isnan(self.parameters[:4]).any():
            raise InvalidInputError(f"payload: the motion does not show {self._unseen}")
        if not np.isnan(self.parameters[4:]).any():
            return payload_of(self.nearest)
        if not self.mass > 0.0:
            raise InvalidInputError(f"payload: expected a positive mass, found {self.mass:.3g} kg")
        return Payload(self.mass, tuple(self.com.tolist()))

    def half_widths(self, confidence: float = CONFIDENCE, *, together: int = 1) -> tuple[float, Array]:
        """Half the widths of the intervals of the mass [kg] and of the centre of mass, shape (3,) [m].

        Args:
            confidence: how likely an interval holds the true value, above 0 and below 1 [1].
            together: number of intervals of which that is said together.
        """
        factor = self._factor(confidence, together)
        return factor * float(self.sigma[0]), frozen(factor * np.sqrt(np.diagonal(self.com_covariance)))

    def intervals(self, confidence: float = CONFIDENCE) -> dict[str, Any]:
        """What :func:`trajevo.robust_problem` takes: ``robust_problem(problem, **found.intervals())``.

        Args:
            confidence: how likely mass and centre of mass both lie in their intervals, above 0 and below 1 [1].

        Returns:
            ``mass``, shape (2,) [kg], ``com``, shape (2, 3) [m], and ``payload``, whose inertia per kilogram counts.

        Raises:
            InvalidInputError: no such confidence, or mass and centre of mass are not known.
        """
        payload = self.payload
        mass, com = self.half_widths(confidence, together=4)
        if not self.mass > mass:
            raise InvalidInputError(
                f"payload: its mass, {self.mass:.3g} kg, is known to ± {mass:.3g} kg only, so its centre is not known"
            )
        return {
            "mass": (self.mass - mass, self.mass + mass),
            "com": np.stack([self.com - com, self.com + com]).tolist(),
            "payload": payload,
        }

    def _factor(self, confidence: float, together: int) -> float:
        from scipy.special import stdtrit  # takes 0.2 s to import

        sure = real_number(confidence)
        if sure is None or not 0.0 < sure < 1.0:
            raise InvalidInputError(f"confidence: expected a number above 0 and below 1, got {confidence!r}")
        return float(stdtrit(self.freedom, 1.0 - 0.5 * (1.0 - sure) / together))

    @property
    def rows(self) -> tuple[tuple[str, str, str, str], ...]:
        """The ten parameters as a table with the columns :data:`HEADERS`."""
        return tuple(
            (name, f"{value:.5g} {unit}", f"{doubt:.2g}", f"{100.0 * share:.3g} %")
            if np.isfinite(value)
            else (name, "not shown", "", "")
            for name, unit, value, doubt, share in zip(
                PARAMETERS, UNITS, self.parameters, self.doubt, self.relative_sigma, strict=True
            )
        )

    def _repr_html_(self) -> str:
        return html.shown("Identified payload", html.sentence(str(self)), html.table(HEADERS, self.rows))

    def __str__(self) -> str:
        parts = [self._found, self._body, *([self._shown] if self._shown else [])]
        how = "less the log without payload" if self.by_difference else "less the robot's model"
        measured = int(np.isfinite(self.left).sum())
        parts.append(
            f"from {self.instants} instants of {measured} joint{'s' if measured > 1 else ''}, {how}; condition number "
            f"{self.condition:.3g}"
        )
        return "; ".join(parts)

    @property
    def _found(self) -> str:
        if np.isnan(self.parameters[:4]).any():
            return "the motion does not show mass and centre of mass"
        mass, com = self.half_widths()
        place = ", ".join(_rounded(1e3 * x, 1e3 * d) for x, d in zip(self.com, com, strict=True))
        weight = f"{self.mass:g} kg, as given" if self.mass_given else f"{_rounded(self.mass, mass)} kg"
        return f"{weight}, centre of mass at ({place}) mm of {self.tool} ({100.0 * CONFIDENCE:g} % each)"

    @property
    def _body(self) -> str:
        if self.consistent:
            return "a body can have what was found"
        if np.isnan(self.parameters).any() or self.mass_given:
            return "no body has what was found"
        return "no body has exactly what was found, payload is the nearest that one has"

    @property
    def _shown(self) -> str:
        said = [f"the motion does not show {self._unseen}"] if self.not_shown else []
        hardly = [name for name in self.hardly_known if name not in self.not_shown]
        return "; ".join([*said, *([f"hardly known: {', '.join(hardly)}"] if hardly else [])])

    @property
    def _unseen(self) -> str:
        return ", ".join(self.not_shown)


def _rounded(value: float, doubt: float) -> str:
    """A number and its doubt with two digits of the latter."""
    places = min(max(1 - int(np.floor(np.log10(doubt))), 0), 9) if doubt > 0.0 else 9
    return f"{value:.{places}f} ± {doubt:.{places}f}"
