"""The payload by the power of the supply is that of a bisection which looks at the power of all motors everywhere."""

import numpy as np
import pytest

from tests.capacity.test_drive_capacity import ARM
from trajevo import Dynamics, Payload, QuinticSpline, Rollout, ViaPointProblem, ViaPoints, full_capacity, load_robot

COPPER = {"gear_ratio": 100.0, "torque_constant": 0.1, "winding_resistance": 0.8}
POINTS = [[-np.pi / 2, 0.0], [0.0, np.pi / 2]]


def moved(drive, supply=None, duration=0.9):
    robot = load_robot(ARM, drives={"shoulder": drive, "elbow": drive}, supply=supply)
    spline = QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.3, 5.0))
    x = np.array([[duration] + [0.0] * (len(spline.variables) - 1)])
    return Rollout(Dynamics(robot, Payload(1.0)), spline(x))


def greatest_power(motion, drive, mass):
    """By its formula at 100,000 instants."""
    t = np.linspace(0.0, float(motion.trajectory.duration[0]), 100_001)[None]
    q, v, a = (motion.trajectory.evaluate(t, order) for order in range(3))
    effort = Dynamics(motion.robot, Payload(mass)).effort(q, v, a)[0]
    driving, driven = drive.get("efficiency_driving", 1.0), drive.get("efficiency_driven", 1.0)
    torque = np.where(effort * v[0] > 0.0, effort / driving, effort * driven)
    resistance = drive["winding_resistance"] / (100.0 * 0.1) ** 2
    return (torque * v[0] + resistance * torque**2).sum(axis=1).max()


@pytest.mark.thinned(2)
@pytest.mark.parametrize(
    "drive",
    [COPPER | {"winding_resistance": 1e-12}, COPPER, COPPER | {"efficiency_driving": 0.75, "efficiency_driven": 0.5}],
    ids=["mechanical", "windings too", "gears too"],
)
@pytest.mark.parametrize("power", [220.0, 500.0])
def test_it_is_that_of_a_bisection(drive, power):
    motion = moved(drive, {"peak_power": power, "source": "made up"})
    found = next(one for one in full_capacity(motion).limits if one.cause == "peak_power")
    low, high = 0.99 * found.mass, 1.01 * found.mass
    assert greatest_power(motion, drive, low) <= power < greatest_power(motion, drive, high)
    for _ in range(18):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if greatest_power(motion, drive, middle) <= power else (low, middle)
    assert found.mass == pytest.approx(low, rel=1e-6)
    assert found.place == "all motors"
    assert 0.0 < found.time < 0.9


def test_a_supply_that_is_too_weak_for_the_arm_alone_leaves_nothing():
    found = full_capacity(moved(COPPER, {"peak_power": "5 W", "source": "made up"}))
    assert not found.feasible
    assert found.cause == "peak_power"
    assert "power of the supply by all motors" in str(found)


def test_what_is_not_known_is_said_and_a_limit_of_the_problem_comes_first():
    assert "power of the supply" in full_capacity(moved(COPPER)).not_covered
    robot = load_robot(ARM, drives={"shoulder": COPPER, "elbow": COPPER}, supply={"peak_power": 500.0})
    problem = ViaPointProblem(robot=robot, points=POINTS, payload=1.0, objectives=("time", "energy"), peak_power=300.0)
    rollout = problem.rollout(0.5 * (problem.xl + problem.xu)[None])
    by_supply = full_capacity(Rollout(rollout.dynamics, rollout.trajectory)).by("peak_power")
    weaker = load_robot(ARM, drives={"shoulder": COPPER, "elbow": COPPER}, supply={"peak_power": 300.0})
    expected = full_capacity(Rollout(Dynamics(weaker, Payload(1.0)), rollout.trajectory)).by("peak_power")
    assert expected < by_supply
