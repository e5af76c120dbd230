"""Closed form, bisection and the paper's iteration agree on random motions and centres of mass of three robots."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tests.capacity.test_payload_effort import ROBOTS, random_motion
from tests.helpers import mostly_long
from trajevo import Payload
from trajevo.capacity.dlcc import dlcc_iterative, dlcc_sampled
from trajevo.capacity.payload_effort import payload_effort
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout

SAMPLES = 3
COMS = 20
MASSES = np.array([0.0, *np.geomspace(1e-3, 1e3, 60)])


def random_case(name, rng, number):
    """A robot that carries a point mass or a weight on a random motion; every third one is too weak somewhere."""
    robot, model = ROBOTS[name], ("rigid", "weight_only")[number % 2]
    trajectory = random_motion(robot, rng, speed=rng.uniform(0.05, 0.8))
    dynamics = Dynamics(robot, Payload(1.0, model=model), samples=SAMPLES)
    if number % 3 == 2:
        limits, joint = robot.limits.effort.copy(), rng.integers(robot.dof)
        limits[joint] = 0.97 * np.abs(Rollout(dynamics, trajectory).unloaded_effort[0, :, joint]).max()
        dynamics = replace(dynamics, robot=replace(robot, limits=replace(robot.limits, effort=limits)))
    return Rollout(dynamics, trajectory)


def used(unloaded, per_kilogram, limit, masses):
    """Greatest effort over limit, efforts (T, n) and (K, T, n) at masses (K, M): shape (K, M)."""
    effort = unloaded + masses[..., None, None] * per_kilogram[:, None]
    return np.abs(effort / limit).max(axis=(2, 3))


def bisected(unloaded, per_kilogram, limit, inside, outside):
    """Where feasibility ends between feasible masses and others, all (K,); the others where they are feasible too."""

    def feasible(masses):
        return used(unloaded, per_kilogram, limit, masses[:, None])[:, 0] <= 1.0

    reached, low, high = feasible(outside), inside.copy(), outside.copy()
    for _ in range(70):
        middle = 0.5 * (low + high)
        kept = feasible(middle)
        low, high = np.where(kept, middle, low), np.where(kept, high, middle)
    return np.where(reached, outside, low)


def more_never_mends(unloaded, per_kilogram, limit):
    """Where a payload loads the joint that is most beyond its limit further, every heavier one is infeasible too."""
    shares = np.abs((unloaded + MASSES[:, None, None, None] * per_kilogram) / limit).reshape(len(MASSES), COMS, -1)
    worst = shares.argmax(axis=2)
    same_way = (unloaded * per_kilogram).reshape(COMS, -1)[np.arange(COMS), worst] >= 0.0
    infeasible = shares.max(axis=2) > 1.0
    first = infeasible & same_way
    heavier = np.logical_or.accumulate(first, axis=0)
    return bool(infeasible[heavier].all())


def check(name, count, seed):
    """Count cases of every kind; all of them agree."""
    rng, kinds = np.random.default_rng(seed), Counter()
    for number in range(count // COMS):
        rollout = random_case(name, rng, number)
        limit, com = rollout.robot.limits.effort, rng.uniform(-1.0, 1.0, (COMS, 3))
        own = [replace(rollout.dynamics.payload, com=tuple(at)) for at in com]
        each = [Rollout(replace(rollout.dynamics, payload=payload), rollout.trajectory) for payload in own]
        closed = [dlcc_sampled(one, samples=SAMPLES) for one in each]
        unloaded, slopes = rollout.unloaded_effort[0], np.stack([one.effort_per_kilogram[0] for one in each])
        masses, least = np.array([one.mass for one in closed]), np.array([one.least for one in closed])
        some = ~np.isnan(least)
        assert (used(unloaded, slopes[~some], limit, np.tile(MASSES, (int((~some).sum()), 1))) > 1.0).all()
        inside = 0.5 * (masses + least)[some]
        for ends, outside in ((masses, 1e6), (least, 0.0)):
            found = bisected(unloaded, slopes[some], limit, inside, np.full(len(inside), outside))
            np.testing.assert_allclose(ends[some], found, rtol=1e-12, atol=1e-8)
        at_all = payload_effort(rollout, samples=SAMPLES).mass_range(com)
        np.testing.assert_allclose(at_all.upper[some], masses[some], rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(at_all.lower[some], least[some], rtol=1e-8, atol=1e-8)
        assert np.isnan(at_all.upper[~some]).all()
        assert more_never_mends(unloaded, slopes, limit)
        kinds += Counter(np.where(~some, "empty", np.where(least > 0.0, "counterweight", "from 0")).tolist())
        for one, capacity in zip(each, closed, strict=True):
            iterates_to(one, capacity)
    return kinds


def iterates_to(rollout, capacity):
    start = max(capacity.least, 0.0) if capacity.feasible else 0.0
    step = max((capacity.mass - start) / 7.3, 0.01)
    found = dlcc_iterative(rollout, start=start, step=step, samples=SAMPLES)
    if capacity.feasible:
        assert found.mass <= capacity.mass + 1e-9 < found.mass + step + 2e-9
        assert len(found.history) >= 2 or capacity.mass - start < 1e-8
    else:
        assert (found.mass, len(found.history)) == (0.0, 1)


@pytest.mark.parametrize("count", mostly_long([60, 120, 300], 60))
def test_hundreds(count):
    kinds = sum((check(name, count, seed) for seed, name in enumerate(ROBOTS)), Counter())
    assert kinds.total() == 3 * count
    fewest = 20 if count > 60 else 10
    assert min(kinds[kind] for kind in ("empty", "counterweight", "from 0")) > fewest, kinds


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed"), [(name, seed) for seed, name in enumerate(ROBOTS)])
def test_a_hundred_thousand(name, seed):
    kinds = check(name, 33_340, 100 + seed)
    assert kinds.total() == 33_340
