import dataclasses

import numpy as np
import pytest

from tests.reference import SUN2020
from trajevo import JointLimits, TrajevoError, ViaPoints, load_robot
from trajevo.trajectory.interpolants import stop_and_go

ROBOT = load_robot("pointing_mechanism")
PATH = ViaPoints(np.radians(SUN2020["joint_angles"]))


@pytest.mark.parametrize("profile", ["trapezoid", "double_s", "septic"])
def test_total_time_on_the_papers_path(profile):
    assert stop_and_go(PATH, ROBOT.limits, profile=profile).duration[0] == pytest.approx(
        SUN2020["stop_and_go"][profile], rel=1e-7
    )


@pytest.mark.parametrize("profile", ["trapezoid", "double_s", "septic"])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 30.0])
def test_stops_at_every_point_under_the_limits_and_uses_one_fully(profile, scale):
    rng = np.random.default_rng(0)
    path = ViaPoints(scale * rng.normal(size=(6, 4)))
    v, a, j = (rng.uniform(0.5, 2.0, 4) for _ in range(3))
    limits = JointLimits(np.full(4, -np.inf), np.full(4, np.inf), v, a, j, np.full(4, np.inf))
    batch = stop_and_go(path, limits, profile=profile)
    checked = [(1, v), (2, a)] if profile == "trapezoid" else [(1, v), (2, a), (3, j)]
    ratios = np.stack([batch.peak(order)[0] / limit for order, limit in checked])
    assert ratios.max() == pytest.approx(1.0, abs=1e-9)
    stops = np.abs(batch.evaluate(batch.breaks[0], 1)[0]).max(axis=1) < 1e-7
    np.testing.assert_allclose(batch.evaluate(batch.breaks[0])[0, stops], path.positions, atol=1e-9 * scale)
    assert np.abs(batch.jump(0)).max() < 1e-9 * scale
    assert np.abs(batch.jump(1)).max() < 1e-8


def test_a_still_joint_and_a_short_hop_work():
    path = ViaPoints(np.array([[0.0, 1.0], [1e-6, 1.0]]))
    for profile in ("trapezoid", "double_s", "septic"):
        batch = stop_and_go(path, ROBOT.limits, profile=profile)
        np.testing.assert_array_equal(batch.peak(1)[0, 1], 0.0)


def test_bad_input_is_refused():
    with pytest.raises(TrajevoError, match="'scurve'; known: double_s, septic, trapezoid"):
        stop_and_go(PATH, ROBOT.limits, profile="scurve")
    with pytest.raises(TrajevoError, match="expected 3 joints as in the points, got 2"):
        stop_and_go(ViaPoints(np.eye(3)), ROBOT.limits, profile="septic")
    free = dataclasses.replace(ROBOT.limits, acceleration=np.full(2, np.inf))
    for profile in ("trapezoid", "double_s"):
        with pytest.raises(TrajevoError, match="finite acceleration limit"):
            stop_and_go(PATH, free, profile=profile)
    nothing = dataclasses.replace(free, velocity=np.full(2, np.inf), jerk=np.full(2, np.inf))
    with pytest.raises(TrajevoError, match="needs a finite"):
        stop_and_go(PATH, nothing, profile="septic")
