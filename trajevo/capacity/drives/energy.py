"""Where the electrical energy of a motion goes: motors, gears, windings, braking resistor, standby."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from trajevo.base import polynomials
from trajevo.base.arrays import Array, frozen
from trajevo.base.shown import html
from trajevo.base.shown.brief import brief
from trajevo.capacity.drives.drive_capacity import rollout_mass
from trajevo.dynamics.drives.duty import checked_dwell
from trajevo.dynamics.drives.electrical import Drawn, Motoring, summed
from trajevo.dynamics.drives.link import Works, link_of, powers_of
from trajevo.dynamics.drives.smooth_pieces import SHARES
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.front.front import Solution
from trajevo.robot.loading.supply import Recuperation
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum

#: What a motor's energy goes into, and how tables and pictures call it.
USES = {
    "mechanical": "links and payload",
    "friction": "friction of joints",
    "gear": "gears",
    "copper": "windings",
    "inverter": "inverters",
    "held": "holding at rest",
}

#: What becomes of energy that motors give back, and how a sentence tells of it.
_WAYS = {
    "none": "each drive burns what its motor gives back",
    "shared": "a link is shared",
    "full": "what motors give back goes to the mains",
}

#: Shares of a piece at which its power is looked at for instants, and how often the surroundings are looked at again.
_LOOKED_AT, _ZOOMS = 65, 4

#: Share of the greatest amount that is mere rounding.
_ROUNDING = 1e-9


@final
@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """What a motion draws from the mains, and where it goes.

    What the motors take (:data:`USES`), what is burnt, fed back or left in the link, and standby add up to it:
    ``energy = used + burnt + stored + standby``.

    Attributes:
        energy: from the mains, less what is fed back [J].
        mechanical: into links, payload and rotors by every joint, negative where they drive it, (n_joints,) [J].
        friction: lost by friction of joints, (n_joints,) [J].
        gear: lost in gears, (n_joints,) [J].
        copper: lost in windings on the motion, (n_joints,) [J].
        inverter: lost in inverters on the motion, (n_joints,) [J].
        held: lost in windings and inverters while the arm is held at rest, (n_joints,) [J].
        drawn: what each motor draws on the motion while it draws, (n_joints,) [J].
        given_back: what each motor gives back on the motion while it does, (n_joints,) [J].
        burnt: in braking resistors [J].
        fed_back: into the mains while motors give back more than others draw [J].
        stored: left in the capacitors of the link at the end [J].
        standby: of the controller [J].
        peak_power: greatest power of all motors together [W].
        peak_time: when that is [s].
        least_power: least power of all motors together, negative if they give back [W].
        least_time: when that is [s].
        times: instants, dense where powers bend, shape (K,) [s].
        power: what each motor draws then, shape (K, n_joints) [W].
        duration: of the motion [s].
        dwell: time at rest after it [s].
        mass: of the payload [kg]; NaN where several loads change along the motion and none of them is meant.
        recuperation: as :class:`~trajevo.robot.loading.supply.Supply` says.
        joint_names: names of the joints.
        robot: name of the robot.
    """

    energy: float
    mechanical: Array
    friction: Array
    gear: Array
    copper: Array
    inverter: Array
    held: Array
    drawn: Array
    given_back: Array
    burnt: float
    fed_back: float
    stored: float
    standby: float
    peak_power: float
    peak_time: float
    least_power: float
    least_time: float
    times: Array
    power: Array
    duration: float
    dwell: float
    mass: float
    recuperation: Recuperation
    joint_names: tuple[str, ...]
    robot: str

    __repr__ = brief

    @property
    def used(self) -> Array:
        """What each motor takes on balance, holding included, shape (n_joints,) [J]."""
        total: Array = sum((getattr(self, name) for name in USES), np.zeros(len(self.joint_names)))
        return total

    @property
    def recuperated(self) -> float:
        """What motors give back and others, or the same later, use [J]."""
        return float(self.given_back.sum()) - self.burnt - self.fed_back - self.stored

    def __str__(self) -> str:
        uses = {name: float(getattr(self, name).sum()) for name in USES}
        told = ", ".join(_told(uses, self._rounding, USES))
        rest = f" and {self.dwell:g} s at rest" if self.dwell else ""
        others = {"standby": self.standby, "burnt in resistors": self.burnt, "fed back": self.fed_back}
        others |= {"left in the link": self.stored}
        more = "".join(f", {clause}" for clause in _told(others, self._rounding))
        carried = "loads that change" if np.isnan(self.mass) else f"{self.mass:g} kg"
        least = self.least_power if abs(self.least_power) > _ROUNDING * abs(self.peak_power) else 0.0
        return (
            f"{self.energy:.6g} J from the mains for {self.duration:.4g} s of motion{rest} with {carried} "
            f"({_WAYS[self.recuperation]}): {told}{more}; {self.peak_power:.4g} W at {self.peak_time:.4f} s to "
            f"{least:.4g} W at {self.least_time:.4f} s"
        )

    @property
    def _rounding(self) -> float:
        """Energy that is mere rounding [J]."""
        return _ROUNDING * float(np.abs([getattr(self, name) for name in USES]).max())

    def _repr_html_(self) -> str:
        known = [name for name in USES if (np.abs(getattr(self, name)) > self._rounding).any()]
        # Lines have no axis of time: instants at equal distances.
        instants = np.linspace(self.times[0], self.times[-1], 80)
        rows = [
            (
                joint,
                *(f"{getattr(self, name)[k]:.4g}" for name in known),
                f"{self.given_back[k]:.4g}",
                html.line(np.interp(instants, self.times, self.power[:, k]), f"power of {joint} over time [W]"),
            )
            for k, joint in enumerate(self.joint_names)
        ]
        headers = ("joint", *(f"{USES[name]} [J]" for name in known), "given back [J]", f"over {self.duration:.4g} s")
        return html.shown("Electrical energy", html.sentence(str(self)), html.table(headers, rows))


def _told(amounts: Mapping[str, float], rounding: float, called: Mapping[str, str] | None = None) -> list[str]:
    """What a sentence says of energies by name that are more than rounding."""
    return [
        f"{name if called is None else called[name]} {amount:.4g} J"
        for name, amount in amounts.items()
        if abs(amount) > rounding
    ]


def energy_balance(motion: Solution | Rollout | WeightedOptimum, *, dwell: float = 0.0) -> EnergyBalance:
    """What a motion draws from the mains, and where it goes: losses by joint, recuperation, standby, powers.

    Without a dwell its ``energy`` is the objective ``electrical_energy``.

    Args:
        motion: a solution of a front, an optimum, or the first trajectory of a rollout, of a robot whose drives tell
            gear ratio, torque constant and winding resistance of every joint.
        dwell: time at rest after the motion, at its end [s]. Motors hold gravity and payload then, unless a brake
            does, and the controller is on.

    Raises:
        InvalidInputError: a drive that does not tell enough, or a dwell below 0.
    """
    given = rollout_of(motion)
    rollout = given.rows(slice(0, 1))
    rest = checked_dwell(dwell)
    motoring, parts = Motoring.of(rollout), list(Drawn.by_pieces(rollout))
    held = rest * _holding(rollout, motoring)
    duration = float(rollout.trajectory.duration[0])
    standby = rollout.robot.supply.standby * (duration + rest)
    told: dict[str, Any] = _uses(motoring, parts) | _supplied(rollout, parts, held) | _extremes(rollout, parts)
    told["energy"] += standby
    times, power = _curves(rollout, parts)
    return EnergyBalance(
        **told,
        held=frozen(held),
        standby=standby,
        times=frozen(times),
        power=frozen(power),
        duration=duration,
        dwell=rest,
        mass=rollout_mass(rollout),
        recuperation=rollout.robot.supply.recuperation,
        joint_names=rollout.robot.joint_names,
        robot=rollout.robot.name,
    )


def _supplied(rollout: Rollout, parts: list[Drawn], held: Array) -> dict[str, Any]:
    """What comes from the mains without standby, and what becomes of energy that motors give back, by name [J].

    Args:
        rollout: one motion.
        parts: what its motors draw.
        held: what they lose while they hold the arm after it, shape (n_joints,) [J].
    """
    drawn, net, supply = np.zeros(len(held)), np.zeros(len(held)), rollout.robot.supply
    for works in (part.each for part in parts):
        np.add.at(drawn, works.columns, works.drawn)
        np.add.at(net, works.columns, works.net)
    count = rollout.trajectory.segment_durations.shape[1]
    at_rest = Works(np.array([count - 1]), np.array([2.0]), held.sum(keepdims=True), np.zeros(1, dtype=int))
    link = link_of([*(part.together for part in parts), at_rest], (1, count), supply.storable)
    taken, given_up, stored = (float(amount[0]) for amount in (link.drawn, link.burnt, link.stored))
    if supply.recuperation == "none":
        taken, given_up = float(drawn.sum() + held.sum()), float((drawn - net).sum())
    fed_back = given_up if supply.recuperation == "full" else 0.0
    return {
        "energy": taken - fed_back,
        "drawn": frozen(drawn),
        "given_back": frozen(drawn - net),
        "burnt": given_up - fed_back,
        "fed_back": fed_back,
        "stored": stored,
    }


def _holding(rollout: Rollout, motoring: Motoring) -> Array:
    """What each motor loses while it holds the arm where the motion ends, 0 with a brake, shape (n_joints,) [W]."""
    end = rollout.trajectory.duration[:1]
    q = rollout.trajectory.evaluate(end[None])
    copper, inverter = motoring.lost(rollout.effort_in(q, np.zeros_like(q), np.zeros_like(q), end[None])[0, 0])
    braked = np.array([drive.brake for drive in motoring.motors.drives])
    return np.where(braked, 0.0, copper + inverter)


def _uses(motoring: Motoring, parts: list[Drawn]) -> dict[str, Array]:
    """What each motor's energy goes into on the motion, by name, shapes (n_joints,) [J]."""
    names = [name for name in USES if name != "held"]
    totals = {name: np.zeros(len(motoring.per_square)) for name in names}
    for part in parts:
        pieces = part.pieces
        powers = motoring.powers(pieces.velocity, pieces.effort, pieces.acceleration, part.ways)
        for name in names:
            values = np.broadcast_to(getattr(powers, name), pieces.velocity.shape)
            totals[name] += pieces.integrated(values).sum(axis=0)
    return {name: frozen(total) for name, total in totals.items()}


def _curves(rollout: Rollout, parts: list[Drawn]) -> tuple[Array, Array]:
    """Instants (K,) [s] and what each motor draws then, (K, n_joints) [W]."""
    begins, durations = rollout.trajectory.breaks[0], rollout.trajectory.segment_durations[0]
    times = [
        begins[part.pieces.segments, None]
        + durations[part.pieces.segments, None] * (part.pieces.begins[:, None] + part.pieces.widths[:, None] * SHARES)
        for part in parts
    ]
    joined = np.concatenate([each.reshape(-1) for each in times])
    order = np.argsort(joined, kind="stable")
    return joined[order], np.concatenate([part.power.reshape(-1, part.power.shape[2]) for part in parts])[order]


def _extremes(rollout: Rollout, parts: list[Drawn]) -> dict[str, float]:
    """Greatest and least power of all motors together, and when they are."""
    pieces = [part.pieces for part in parts]
    segments, begins, widths = (
        np.concatenate([getattr(one, name) for one in pieces]) for name in ("segments", "begins", "widths")
    )
    powers = np.concatenate([powers_of(summed(part.power)) for part in parts], axis=1)
    found = {}
    for name, sign in (("peak", 1.0), ("least", -1.0)):
        curves = sign * powers
        _, greatest = polynomials.extremes(curves, 1)
        piece = int(greatest[0].argmax())
        share, width = 0.5, 0.5
        for _ in range(_ZOOMS):
            shares = np.linspace(max(share - width, 0.0), min(share + width, 1.0), _LOOKED_AT)
            share = float(shares[polynomials.values(curves[:, piece : piece + 1], shares).argmax()])
            width /= 0.25 * _LOOKED_AT
        at = rollout.trajectory.segment_durations[0][segments[piece]] * (begins[piece] + share * widths[piece])
        found[f"{name}_power"] = sign * float(greatest[0, piece])
        found[f"{name}_time"] = float(rollout.trajectory.breaks[0][segments[piece]] + at)
    return found
