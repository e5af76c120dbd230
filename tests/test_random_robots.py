"""What is claimed of the motions of random robots holds: no exception, no NaN, no claim that samples break."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import mostly_long
from tests.random_robots import random_task
from trajevo import Front, Payload, TrajevoError, ViaPointProblem, certify, dlcc, export, optimise, slowdown_for, verify
from trajevo.base import jit
from trajevo.dynamics.rollout import Rollout

#: How many problems a long run solves, those of an ordinary run, and how many of the first have solutions.
MANY, OFTEN, SOLVED = 300, (1,), 6

SMALL = {"population": 12, "generations": 5, "progress": False}

#: Every so many robots have their dynamics compiled, which takes many times as long as the rest.
COMPILED = 25

#: Every so many fronts are polished.
POLISHED = 3

#: Shares of every segment at which motions are sampled, and share of a bound that rounding may add to a sample.
DENSE, ROUNDING = np.linspace(0.0, 1.0, 401), 1e-9


@pytest.mark.parametrize("seed", mostly_long(range(MANY), *OFTEN))
def test_claims_about_random_robots_hold(seed, tmp_path, monkeypatch):
    if seed % COMPILED != COMPILED - 1:
        monkeypatch.setattr(jit, "can_compile", lambda: False)
    found = check(seed, tmp_path)
    assert found == "proven" or seed >= SOLVED, "the first problems have solutions, or nothing would be checked"


def check(seed: int, folder: Path) -> str:
    """Solve the problem of a seed and check every claim about the front's knee; what became of it, in a word."""
    problem = ViaPointProblem(**random_task(seed, folder))
    again = ViaPointProblem(**json.loads(json.dumps(problem.settings)))
    assert again.settings == problem.settings
    front = optimise(problem, seed=seed, polish=seed % POLISHED == 0, **SMALL)
    front.save(folder / "front.json")
    saved = Front.load(folder / "front.json")
    np.testing.assert_array_equal(saved.F, front.F)
    np.testing.assert_array_equal(saved.X, front.X)
    if not len(front):
        assert front.blocking
        with pytest.raises(TrajevoError, match="empty"):
            front.knee()
        return "empty"
    assert np.isfinite(front.F).all()
    assert np.isfinite(front.G).all()
    assert (front.G <= 0.0).all()
    np.testing.assert_array_equal(again.evaluate(front.X, return_values_of=["F"]), front.F)
    best = saved.knee()
    certified = check_certificate(best)
    found = verify(best)
    assert not found.doubts, found.verdict
    assert not [row for row in found.exceeded if row.limit in kept_everywhere(problem)], found.verdict
    check_capacity(best)
    check_slowdown(best)
    export(best, folder / "motion.csv", format="csv")
    values = np.loadtxt(
        [line for line in (folder / "motion.csv").read_text().splitlines() if line[:1] in "-0123456789"], delimiter=","
    )
    assert np.isfinite(values).all()
    return "proven" if certified else "not proven"


def check_certificate(best) -> bool:
    """Every proven bound is confirmed by dense samples, and what the problem keeps is not broken."""
    certificate = certify(best)
    assert not [row for row in certificate.rows if np.isnan([row.bound, row.exhibited, row.share, row.gap]).any()]
    dense = dense_samples(best.rollout)
    for row in certificate.rows:
        joint = None if row.joint is None else best.rollout.robot.joint_names.index(row.joint)
        if row.quantity == "position":
            share = best.rollout.robot.limits.range_used(dense["position"])[:, joint].max()
            assert share <= row.share + ROUNDING
        elif joint is not None:
            assert np.abs(dense[row.quantity][:, joint]).max() <= row.bound * (1.0 + ROUNDING) + 1e-12, row.name
    kept = kept_everywhere(best.front.problem)
    assert not [row for row in certificate.violated if row.quantity in kept], str(certificate)
    return certificate.proven


def kept_everywhere(problem: ViaPointProblem) -> set[str]:
    """Quantities that a problem keeps at every instant, not at samples alone."""
    quantities = {constraint.quantity for constraint in problem.constraints}
    return quantities - ({"effort"} if problem.settings["limits"] == "sampled" else set())


def dense_samples(rollout: Rollout) -> dict[str, np.ndarray]:
    """Position, velocity, acceleration, jerk, effort and power at many instants, each (T, n_joints)."""
    trajectory = rollout.trajectory
    q, v, a, j = (trajectory.at_shares(DENSE, order)[0] for order in range(4))
    still = np.abs(v).max(axis=0) <= rollout.standing[0]
    v, a = np.where(still, 0.0, v), np.where(still, 0.0, a)
    effort = rollout.dynamics.effort(q, v, a)
    return {"position": q, "velocity": v, "acceleration": a, "jerk": j, "effort": effort, "power": effort * v}


def check_capacity(best) -> None:
    """With the largest payload no effort limit is broken at any dense sample."""
    capacity = dlcc(best)
    assert not np.isnan(capacity.mass)
    if not np.isfinite(capacity.mass) or not capacity.feasible:
        return
    rollout = best.rollout
    payload = rollout.dynamics.payload.with_mass(capacity.mass)
    carrying = replace(rollout.dynamics, payload=payload)
    effort = carrying.effort(*(rollout.trajectory.at_shares(DENSE, order)[0] for order in range(3)))
    share = (np.abs(effort) / rollout.robot.limits.effort).max()
    assert share <= 1.0 + (ROUNDING if getattr(capacity, "method", "sampled") == "guaranteed" else 0.01), share


def check_slowdown(best) -> None:
    """A motion scaled for a payload keeps the effort limits with it, or the reason why there is none is told."""
    payload = Payload(best.rollout.dynamics.payload.mass + 0.1)
    try:
        scaled = slowdown_for(best, payload)
    except TrajevoError:  # what cannot be carried is refused in a sentence of its own
        return
    assert np.isfinite(scaled.factor)
    assert scaled.factor > 0.0
    assert np.nanmax(scaled.utilisation) <= 1.0 + 1e-6
