"""Interpolants side by side under equal limits."""

from dataclasses import replace

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import POINTS, mostly_long
from trajevo import TrajevoError, load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.plots.rivals import plot_rivals
from trajevo.problems import PickAndPlace, TimeJerkReparameterisation
from trajevo.solvers.rivals import FREE, RIVALS, STOPPING, compare_rivals, rivals_of, rivals_table

mpl.use("Agg")

#: Least times of the reference under the limits of robots/puma560 with 2.5 kg [s].
LEAST_TIMES = {
    "polynomial": 4.4737,
    "quintic_spline": 4.4024,
    "septic_spline": 4.9942,
    "double_s": 4.7509,
    "trapezoid": 3.4937,
    "rest_to_rest": 6.6560,
    # By SciPy's differential evolution over the shares of the time, stretched to the limits.
    "quartic_cubic_quartic": 4.300364,
    # Peak constants times what each joint turns: velocity and acceleration, or jerk, bind; see the profiles' own tests.
    "cycloidal": 6.0703,
    "harmonic": 4.4201,
    "trigonometric": 7.2379,
}


@pytest.fixture(scope="module")
def rivals():
    return {rival.name: rival for rival in rivals_of(PickAndPlace())}


def test_all_rivals_are_there_and_in_the_table(rivals):
    assert tuple(rivals) == RIVALS
    headers, rows = rivals_table(rivals.values())
    assert rows[0][0] == "trapezoid, stops"
    assert all(len(row) == len(headers) for row in rows)
    assert [float(row[1]) for row in rows] == sorted(float(row[1]) for row in rows)


@pytest.mark.parametrize("name", LEAST_TIMES)
def test_least_times_are_the_references(rivals, name):
    assert rivals[name].time == pytest.approx(LEAST_TIMES[name], rel=1e-3)


def test_with_ranges_the_septic_is_slower():
    (septic,) = compare_rivals(
        PickAndPlace().dynamics, PickAndPlace().interpolant.points, names=["polynomial"], keep_range=True
    )
    assert septic.time == pytest.approx(4.5334, rel=1e-3)
    assert septic.overshoot == pytest.approx(2.348, rel=1e-3)


def test_every_free_rival_keeps_the_limits_and_touches_one(rivals):
    for name in FREE:
        assert rivals[name].within, name
        trajectory, limits = rivals[name].rollout.trajectory, rivals[name].rollout.robot.limits
        used = [
            (np.abs(trajectory.sample(5001).v[0]).max(axis=0) / limits.velocity).max(),
            (np.abs(trajectory.sample(5001).a[0]).max(axis=0) / limits.acceleration).max(),
            rivals[name].peak_jerk,
            rivals[name].effort,
        ]
        assert max(used) == pytest.approx(1.0, abs=1e-3)


def test_effort_limits_slow_down_what_carries_too_much(rivals):
    heavy = PickAndPlace(payload=13.0)
    (slower,) = compare_rivals(heavy.dynamics, heavy.interpolant.points, names=["quintic_spline"])
    assert slower.within
    assert slower.effort == pytest.approx(1.0, abs=1e-5)
    assert slower.time > rivals["quintic_spline"].time * 1.01


@pytest.mark.parametrize("count", mostly_long([4_001, 20_001], 4_001))
def test_what_is_measured_is_what_the_motion_does(rivals, count):
    for rival in rivals.values():
        trajectory = rival.rollout.trajectory
        motion = trajectory.sample(count)
        points = PickAndPlace().interpolant.points.positions
        beyond = np.maximum(motion.q[0].max(axis=0) - points.max(axis=0), points.min(axis=0) - motion.q[0].min(axis=0))
        assert rival.overshoot == pytest.approx(max(beyond.max(), 0.0), abs=1e-4)
        if np.isfinite(rival.peak_jerk):
            assert rival.peak_jerk == pytest.approx(
                (np.abs(motion.j[0]).max(axis=0) / rival.rollout.robot.limits.jerk).max(), rel=5e-3
            )
        dynamics = rival.rollout.dynamics
        power = dynamics.effort(motion.q, motion.v, motion.a)[0] * motion.v[0]
        assert rival.energy == pytest.approx(np.trapezoid(np.abs(power).sum(axis=1), motion.t[0]), rel=5e-3)


def test_points_are_met_except_by_blends(rivals):
    for name, rival in rivals.items():
        if name == "linear_blends":
            assert 0.01 < rival.via_error < 1.0
        else:
            assert rival.via_error < 1e-9


def test_steps_of_the_acceleration_are_infinite_jerks(rivals):
    assert rivals["trapezoid"].peak_jerk == rivals["trapezoid"].end_jerk == rivals["trapezoid"].rms_jerk == np.inf
    assert rivals["harmonic"].peak_jerk == rivals["harmonic"].end_jerk == rivals["harmonic"].rms_jerk == np.inf
    for name in ("polynomial", "double_s", "cubic", "quartic_cubic_quartic", "cycloidal"):
        assert rivals[name].end_jerk > 10.0
    for name in ("septic_spline", "rest_to_rest", "trigonometric"):
        assert rivals[name].end_jerk < 1e-6


def test_profiles_that_stop_do_not_overshoot(rivals):
    for name in STOPPING:
        assert rivals[name].overshoot < 1e-9


def test_joints_apart_are_as_fast_as_lines_or_faster(rivals):
    from trajevo.trajectory.interpolants import stop_and_go

    points, limits = PickAndPlace().interpolant.points, load_robot("puma560").limits
    for _, profile in STOPPING.values():
        line, apart = (stop_and_go(points, limits, profile=profile, straight=way) for way in (True, False))
        assert apart.duration[0] <= line.duration[0] * (1.0 + 1e-9)
        for batch in (line, apart):
            np.testing.assert_allclose(batch.evaluate([0.0])[0, 0], points.positions[0], atol=1e-12)
            np.testing.assert_allclose(batch.evaluate(batch.duration)[0, 0], points.positions[-1], atol=1e-9)
            assert np.abs(batch.jump(0)).max() < 1e-9
            assert np.abs(batch.jump(1)).max() < 1e-9
            assert (batch.peak(1)[0] <= limits.velocity * (1.0 + 1e-9)).all()
            assert (batch.peak(2)[0] <= limits.acceleration * (1.0 + 1e-9)).all()
            if profile not in ("trapezoid", "harmonic"):
                assert (batch.peak(3)[0] <= limits.jerk * (1.0 + 1e-9)).all()


def test_the_picture_has_a_curve_for_every_rival_in_every_panel(rivals):
    panels = plot_rivals(rivals.values(), joint="joint_1")
    assert len(panels) == 4
    for panel in panels:
        assert len([line for line in panel.lines if line.get_gid() != "limit"]) == len(rivals)
    assert panels[0].get_title() == "joint_1"
    assert plot_rivals(rivals.values())[0].get_title() == "joint_5"
    plt.close("all")


def test_bad_input_gets_a_sentence(rivals):
    dynamics, points = PickAndPlace().dynamics, PickAndPlace().interpolant.points
    with pytest.raises(TrajevoError, match="unknown rival 'spline'; known: cubic"):
        compare_rivals(dynamics, points, names=["spline"])
    with pytest.raises(TrajevoError, match="rivals: expected at least one"):
        plot_rivals([])
    with pytest.raises(TrajevoError, match="unknown joint 'wrist'; known: joint_1"):
        plot_rivals(rivals.values(), joint="wrist")
    with pytest.raises(TrajevoError, match="axes: expected 4, got 1"):
        plot_rivals(rivals.values(), axes=[None])
    robot = load_robot("pointing_mechanism")
    endless = replace(robot, limits=replace(robot.limits, acceleration=np.full(2, np.inf)))
    with pytest.raises(TrajevoError, match=r"profile 'trapezoid': needs a finite acceleration limit"):
        compare_rivals(Dynamics(endless), POINTS, names=["trapezoid"])
    assert TimeJerkReparameterisation.compares_rivals is False
