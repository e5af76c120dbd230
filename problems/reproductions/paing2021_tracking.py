"""Tracking errors of Paing et al. 2021, Figure 15, by what the paper prints of its drive and controller."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.reproduction.paper import Desk, NumberTable, PrintedNumber, Shown
from trajevo.robot.payload import Payload
from trajevo.verification.twin.simulate import simulate
from trajevo.verification.twin.simulation import Simulation

from .paing2021_fronts import front

#: Gains 10000 1/s² and 200 1/s are a natural frequency of 100 rad/s and a damping ratio of 1; section VI.E.
CONTROL: dict[str, Any] = {
    "controller": "pd",
    "natural_frequency": 100.0,
    "damping_ratio": 1.0,
    "rate": 5000.0,
    "resolution": 76.29e-9,
    "settle": 0.0,
}

#: Sampling rate of a short look [Hz].
_SHORT = 1000.0

#: Dry friction that nothing compensates, as an acceleration of the masses that it holds [m/s²].
_DRY = (0.03, 0.1, 0.3)

#: By how much the proposed motion is faster in the paper [1], and what a heavier table carries [kg].
_FASTER, _HEAVIER = 0.03, 30.0

#: From m to micrometres.
_MICRO = 1e6

_PRINTED = (("17.62", "25.52"), ("17.37", "25.66"))

_WHY = (
    "friction, flexibility and noise of the drive are not printed; without them the error is the acceleration over the "
    "gain, and the proposed motion accelerates more where it is faster"
)

_CASE = "as printed"


def tracking(desk: Desk) -> Shown:
    """Figure 15: mean tracking errors of both motions, simulated with the printed gains, sampling and encoder."""
    if importlib.util.find_spec("mujoco") is None:
        missing = "the simulation needs the package mujoco: pip install 'trajevo[twin]'"
        return Shown(numbers=list(_numbers(None, missing)), table=NumberTable(("case",), [("none",)]), said=[missing])
    motions = {"proposed": front(desk, "s").utopia().rollout, "linear": front(desk, "s, linear").utopia().rollout}
    control = CONTROL | ({"rate": _SHORT} if desk.short else {})
    found = {}
    for name, varied in _cases(motions, short=desk.short):
        played: dict[str, Any] = {each: simulate(rollout, **control) for each, rollout in varied.items()}
        found[name] = played["proposed"], played["linear"]
    rows = [(name, *_less(*pair).ravel().tolist(), *_means(pair)) for name, pair in found.items()]
    titles = [f"{what} less, {axis} [%]" for what in ("mean", "spread") for axis in "xy"]
    titles += [f"mean {which}, {axis} [um]" for which in ("proposed", "linear") for axis in "xy"]
    return Shown(
        numbers=list(_numbers(_less(*found[_CASE]), _WHY)),
        table=NumberTable(("case", *titles), rows),
        figure=_figure(found[_CASE]),
        said=list(_said(found, motions)),
    )


def _numbers(less: Array | None, why: str) -> Iterator[PrintedNumber]:
    for k, (what, printed) in enumerate(zip(("mean", "spread"), _PRINTED, strict=True)):
        for axis, (name, text) in enumerate(zip("xy", printed, strict=True)):
            ours = None if less is None else float(less[k, axis])
            yield PrintedNumber(
                of=f"{what} of |tracking error| less than the linear one, {name}",
                unit="%",
                printed=text,
                ours=ours,
                differs=True,
                why=why,
            )


def _cases(motions: Mapping[str, Rollout], *, short: bool) -> Iterator[tuple[str, dict[str, Rollout]]]:
    """The motions on the drive as it is printed, and with what is not printed assumed one after the other."""
    yield _CASE, dict(motions)
    if short:
        return
    faster, linear = (float(motions[name].trajectory.duration[0]) for name in ("proposed", "linear"))
    robot = motions["linear"].robot
    slowed = motions["linear"].trajectory.slowed(faster / (1.0 - _FASTER) / linear)
    yield (
        f"linear motion {100.0 * _FASTER:g} % slower, as printed",
        {**motions, "linear": Rollout(Dynamics(robot), slowed)},
    )
    yield (
        f"{_HEAVIER:g} kg more on the table",
        {name: Rollout(Dynamics(robot, Payload(_HEAVIER)), rollout.trajectory) for name, rollout in motions.items()},
    )
    masses = np.array([sum(body.mass for body in list(robot.model.inertias)[k:]) for k in (1, 2)])
    for acceleration in _DRY:
        friction = replace(robot.friction, coulomb=acceleration * masses, coulomb_backward=None)
        rubbing = replace(robot, friction=friction)
        yield (
            f"dry friction of {acceleration:g} m/s^2 times the mass",
            {name: Rollout(Dynamics(rubbing), rollout.trajectory) for name, rollout in motions.items()},
        )


def _less(ours: Simulation, theirs: Simulation) -> Array:
    """How much less mean and spread of |error| are in x and y, shape (2, 2) [%]."""
    spreads = [np.stack([one.mean_error, np.abs(one.error).std(axis=0)]) for one in (ours, theirs)]
    less: Array = 100.0 * (1.0 - spreads[0] / spreads[1])
    return less


def _means(pair: tuple[Simulation, Simulation]) -> list[float]:
    return [_MICRO * value for one in pair for value in one.mean_error.tolist()]


def _said(found: Mapping[str, tuple[Simulation, Simulation]], motions: Mapping[str, Rollout]) -> Iterator[str]:
    """What the errors follow, measured."""
    proposed, linear = found[_CASE]
    asked = []
    for name in ("proposed", "linear"):
        trajectory = motions[name].trajectory
        asked.append(
            np.abs(trajectory.evaluate(np.linspace(0.0, float(trajectory.duration[0]), 5001), 2)[0]).mean(axis=0)
        )
    more = 100.0 * (asked[0] / asked[1] - 1.0)
    less = _less(proposed, linear)[0]
    yield (
        "Simulated with the printed gains of 10000 1/s^2 and 200 1/s, positions in steps of 76.29 nm and their "
        f"differences as velocities, the mean error changes by {-less[0]:+.1f} % in x and {-less[1]:+.1f} % in y from "
        f"the linear to the proposed motion, as does the mean acceleration: {more[0]:+.1f} % and {more[1]:+.1f} %. The "
        "gains are per mass, so masses do not matter. Rigid axes, no noise and no dry friction are assumptions; the "
        "table has others."
    )


def _figure(pair: tuple[Simulation, Simulation]) -> Any:
    """Errors of both motions over time, x on the left and y on the right."""
    from trajevo.plots.paper import curve, key, panels

    with panels(None, 2, width="page", columns=2, height=42.0, share=True) as made:
        for axis, ax in enumerate(made):
            for number, (name, one) in enumerate(zip(("proposed", "linear reparameterisation"), pair, strict=True)):
                ax.plot(one.t, _MICRO * one.error[:, axis], label=name, **curve(number))
            ax.set(xlabel="time [s]", ylabel=f"tracking error, {'xy'[axis]} [µm]")
        key(made[0])
    return made[0].figure
