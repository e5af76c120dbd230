"""Constraints of a motion's problem under a uniform scaling of time: in closed form, by search, and never kept."""

from dataclasses import replace

import numpy as np
import pytest

from tests.capacity.test_scaled_path import DURATIONS, KINEMATIC, UR5, ur5
from tests.helpers import refused
from trajevo import Payload, TrajectoryProblem, certify, optimise, plots
from trajevo.capacity.robust import robust_slowdown
from trajevo.capacity.scaled_constraints import ScaledConstraints, greatest_tool_speed
from trajevo.capacity.slowdown import slowdown_curve, slowdown_for
from trajevo.capacity.uncertainty import robust_problem
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.motion_limits import mean_velocity_limits
from trajevo.robot.kinematics import ToolKinematics
from trajevo.solvers.gradient.weighted_sum import WeightedOptimum


def optimum(problem, x=DURATIONS[0]) -> WeightedOptimum:
    return WeightedOptimum(problem, np.asarray(x), cost=1.0, F={}, G={}, costs=np.ones(1), seconds=0.0)


def with_constraint(*given, **changes) -> WeightedOptimum:
    """A motion of a problem that is put together by hand, with constraints of one's own."""
    own = ur5(**changes)
    problem = TrajectoryProblem(
        dynamics=own.dynamics,
        interpolant=own.interpolant,
        objectives=own.objectives,
        constraints=(*own.constraints, *given),
    )
    return optimum(problem)


def speed_of_tool(rollout: Rollout, samples=20_001):
    dense = rollout.trajectory.sample(samples)
    velocity = ToolKinematics.of(rollout.robot).twist(dense.q, dense.v)[0, :, :3]
    return np.linalg.norm(velocity, axis=-1), dense.t[0]


def test_the_greatest_speed_of_the_tool_is_bounded_closely_and_has_an_instant():
    rollout = ur5().rollout(DURATIONS)
    bound, instant = greatest_tool_speed(rollout)
    speed, t = speed_of_tool(rollout)
    assert speed.max() <= bound <= speed.max() * (1.0 + 1e-6)
    assert instant == pytest.approx(t[speed.argmax()], abs=1e-3)


@pytest.mark.parametrize("limits", ["sampled", "certified"])
def test_the_speed_of_the_tool_binds_in_closed_form(limits):
    motion = optimum(ur5(tool_speed=0.15, limits=limits))
    found = slowdown_for(motion, 1.0)
    speed, t = speed_of_tool(motion.rollout)
    assert found.factor == pytest.approx(speed.max() / 0.15, rel=1e-6)
    assert (found.limit, found.joint) == ("tool speed", "")
    assert found.time == pytest.approx(t[speed.argmax()] * found.factor, rel=1e-2)
    assert f"limited by the tool speed at {found.time:.4f} s; proven at every instant" in str(found)
    assert certify(found).proven
    assert certify(found, tool_speed=0.15).proven
    assert slowdown_for(motion.rollout, 1.0).factor < found.factor  # a mere rollout has no problem
    robust = robust_slowdown(motion, mass=(0.9, 1.1), com=[[0.0, 0.0, 0.02], [0.0, 0.0, 0.04]])
    assert robust.factor == pytest.approx(found.factor, rel=1e-9)
    curve = slowdown_curve(motion, [0.5, 1.0])
    assert curve.limits == ("tool speed", "tool speed")
    assert curve.factors == pytest.approx(found.factor, rel=1e-6)
    labels = [text.get_text() for text in plots.slowdown_curve(curve).get_legend().get_texts()]
    assert labels[0] == "tool speed"


def test_mean_velocities_bind_in_closed_form():
    fast = replace(UR5, limits=replace(UR5.limits, velocity=np.full(6, 0.25)))
    motion = optimum(ur5(robot=fast, constraints=["mean_velocity"]))
    scaling = {scaling.name: scaling for scaling in ScaledConstraints.of(motion).scalings}["mean velocity"]
    excess = mean_velocity_limits(fast).function(motion.rollout)[0, 0]
    assert scaling.share == pytest.approx(1.0 + excess, rel=1e-12)
    slower = replace(motion.rollout, trajectory=motion.trajectory.slowed(1.0 / scaling.greatest_speed))
    assert mean_velocity_limits(fast).function(slower)[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_the_longest_time_bounds_the_factor_from_above():
    duration, free = DURATIONS.sum(), slowdown_for(optimum(ur5()), 17.0)
    kept = slowdown_for(optimum(ur5(longest_time=3.0)), 17.0)
    assert kept.factor == pytest.approx(free.factor, rel=1e-12)
    assert kept.not_kept == ()
    assert kept.allowed[-1, 1] == pytest.approx(3.0 / duration, rel=2e-6)
    least = float(free.duration)
    late = slowdown_for(optimum(ur5(longest_time=0.9 * least)), 17.0)
    assert late.duration == pytest.approx(least, rel=1e-12)
    assert late.not_kept == ("longest time",)
    assert late.allowed.shape == (0, 2)
    assert str(late).endswith("not kept at this speed or any slower one tried: longest time")
    just = slowdown_for(optimum(ur5(longest_time=least)), 17.0)  # within the solvers' tolerance
    assert just.not_kept == ()
    curve = slowdown_curve(optimum(ur5(longest_time=0.9 * least)), [1.0, 17.0])
    assert curve.not_kept == ("", "longest time")
    labels = [text.get_text() for text in plots.slowdown_curve(curve).get_legend().get_texts()]
    assert "not kept: longest time" in labels


def smoothness(rollout: Rollout):
    """Root mean square of all accelerations over 1.5 rad/s², minus 1."""
    mean = (rollout.trajectory.integral_of_square(2) / rollout.trajectory.duration[:, None]).sum(axis=1, keepdims=True)
    return np.sqrt(mean) / 1.5 - 1.0


def test_a_constraint_of_ones_own_enlarges_the_factor_until_it_is_kept():
    motion = with_constraint(Constraint(("smoothness",), "mine", smoothness))
    found, free = slowdown_for(motion, 1.0), slowdown_for(optimum(ur5()), 1.0)
    now = 1.0 + smoothness(motion.rollout)[0, 0]
    assert found.factor == pytest.approx(np.sqrt(now), rel=1e-7)  # an acceleration: with the square of the speed
    assert found.factor > free.factor
    assert (found.limit, found.joint) == ("smoothness", "")
    assert np.isnan(found.time)
    assert found.proven
    assert smoothness(found.rollout)[0, 0] <= 1e-12
    assert found.not_kept == ()
    assert "limited by the smoothness; proven at every instant but for smoothness" in str(found)


def test_a_constraint_of_ones_own_binds_where_nothing_else_does():
    free = {name: np.full(6, np.inf) for name in ("velocity", "acceleration", "jerk", "effort")}
    robot = replace(UR5, limits=replace(UR5.limits, **free))
    motion = with_constraint(Constraint(("smoothness",), "mine", smoothness), robot=robot)
    found = slowdown_for(motion, 1.0)
    assert found.factor == pytest.approx(np.sqrt(1.0 + smoothness(motion.rollout)[0, 0]), rel=1e-7)
    assert found.limit == "smoothness"

    def patient(rollout):
        return np.full((len(rollout.trajectory), 1), -0.5)

    motion = with_constraint(Constraint(("patience",), "mine", patient), robot=robot)
    refused(lambda: slowdown_for(motion, 1.0), "'ur5' has none that this motion would reach")


def test_a_constraint_that_no_speed_keeps_is_named():
    def never(rollout):
        return np.full((len(rollout.trajectory), 1), 0.1)

    def unknown(rollout):
        return np.full((len(rollout.trajectory), 1), np.nan)

    free = slowdown_for(optimum(ur5()), 12.0)
    for function in (never, unknown):
        found = slowdown_for(with_constraint(Constraint(("patience",), "mine", function)), 12.0)
        assert found.factor == pytest.approx(free.factor, rel=1e-12)
        assert found.not_kept == ("patience",)
        assert (found.limit, found.joint) == (free.limit, free.joint)
        assert str(found).endswith("; not kept at this speed or any slower one tried: patience")


def test_a_constraint_that_only_fast_motions_keep_does_not_slow_them():
    def haste(rollout):
        return rollout.trajectory.duration[:, None] / 1.0 - 1.0

    found = slowdown_for(with_constraint(Constraint(("haste",), "mine", haste)), 1.0)
    assert found.duration < 1.0
    assert found.not_kept == ()
    slow = slowdown_for(with_constraint(Constraint(("haste",), "mine", haste)), 12.0)
    assert slow.duration > 1.0
    assert slow.not_kept == ("haste",)


def test_a_limit_that_the_path_itself_breaks_is_named():
    found = slowdown_for(optimum(ur5(overshoot=1e-4)), 1.0)
    assert found.not_kept == ("overshoot",)
    kept = slowdown_for(optimum(ur5(overshoot=0.5, tool_height=-2.0)), 1.0)
    assert kept.not_kept == ()
    assert kept.factor == found.factor
    assert kept.evaluated == ("tool height",)
    ball = {"name": "ball", "shape": "sphere", "radius": 0.1, "position": [0.4, 0.2, 0.4]}
    through = slowdown_for(optimum(ur5(scene={"clearance": 0.02, "obstacles": [ball]})), 1.0)
    assert through.not_kept == ("clearance to obstacles",)
    assert through.factor == found.factor
    assert str(kept).endswith("; proven at every instant but for tool height")


def test_effort_limits_for_every_payload_of_a_box_count():
    box = {"mass": (11.0, 13.0), "com": [[-0.05, -0.05, 0.0], [0.05, 0.05, 0.1]]}
    problem = robust_problem(ur5(constraints=[*KINEMATIC, "effort"]), **box)
    nominal = slowdown_for(optimum(ur5()), 12.0)
    found = slowdown_for(optimum(problem), 12.0)
    assert found.factor > nominal.factor
    assert found.limit.startswith("effort of ")
    (robust,) = [c for c in problem.constraints if c.quantity == "effort of every payload"]
    assert robust.function(found.rollout).max() <= 1e-12
    slightly_faster = replace(found.motion, trajectory=found.motion.trajectory.slowed(0.9999 * found.factor))
    assert robust.function(slightly_faster).max() > 0.0


def test_a_margin_of_these_limits_is_left_out_at_the_full_limits():
    box = {"mass": (7.0, 9.0), "com": [[-0.02, -0.02, 0.0], [0.02, 0.02, 0.06]]}
    with_margin, without = (robust_problem(ur5(effort_margin=margin), **box) for margin in (0.2, 0.0))
    found, full = slowdown_for(optimum(with_margin), 8.0), slowdown_for(optimum(without), 8.0)
    assert found.at_full_limits.factor == pytest.approx(full.factor, rel=1e-7)
    assert found.factor > full.factor


def test_solutions_of_a_front_keep_their_problems_limits():
    problem = ur5(tool_speed=0.6, effort_margin=0.2)
    front = optimise(problem, seed=1, generations=10, population=20, progress=False, polish=False)
    knee = front.knee()
    found = slowdown_for(knee, 1.0)
    assert found.limit == "tool speed"
    assert speed_of_tool(found.rollout)[0].max() == pytest.approx(0.6, rel=1e-6)
    assert found.factor <= 1.0
    heavy = slowdown_for(knee, Payload(14.0, (0.0, 0.0, 0.03)))
    assert heavy.limit == "effort"
    assert heavy.at_full_limits.factor < heavy.factor
