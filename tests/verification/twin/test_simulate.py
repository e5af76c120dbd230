"""What is told of a closed loop, of one motion and of a front, and what wrong arguments are told."""

import sys

import numpy as np
import pytest

from tests.verification.twin.robots import SLIDE, motion, one_joint, puma, puma_motion
from trajevo import Payload, Rollout, TrajevoError, ViaPointProblem, load_robot, optimise, simulate
from trajevo.errors import NoSolutionError, UnknownNameError

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")

BRIEF = {"rate": 250.0, "settle": 0.2}


def slide_motion(**limits):
    return motion(one_joint(SLIDE, **limits), [[0.0], [0.2]], [0.3])


@pytest.fixture(scope="module")
def front():
    points = [[0.0, 0.8, 0.0, 0.0, 0.8, 0.0], [0.2, 0.6, -0.1, 0.1, 0.7, 0.1]]
    problem = ViaPointProblem(
        robot=puma(),
        points=np.array(points),
        duration_bounds=(0.2, 0.6),
        objectives=("time", "energy", "jerk"),
        constraints=("effort",),
        payload=Payload(1.0),
    )
    return optimise(problem, seed=1, population=16, generations=6, polish=False, progress=False)[:5]


def test_numbers_are_those_of_the_curves():
    found = simulate(slide_motion(), controller="pd", tolerance=2e-4, **BRIEF)
    moving = found.t <= found.duration
    error = found.reference - found.q
    np.testing.assert_allclose(found.greatest_error, np.abs(error[moving]).max(axis=0))
    np.testing.assert_allclose(found.rms_error, np.sqrt((error[moving] ** 2).mean(axis=0)))
    np.testing.assert_allclose(found.tool_error, np.abs(error[:, 0]))
    outside = found.t[(found.tool_error > 2e-4) & (found.t >= found.duration)]
    assert found.duration < outside[-1] < found.t[-1]
    assert found.settling == pytest.approx(outside[-1] + 1.0 / 250.0 - found.duration)
    assert found.time == found.duration + found.settling
    assert f"{found.settling:.4f} s after" in str(found)


@pytest.mark.parametrize(("limit", "saturates"), [(30.0, False), (12.0, True)])
def test_efforts_end_at_the_limit(limit, saturates):
    found = simulate(slide_motion(effort=limit), **BRIEF)
    assert np.abs(found.effort).max() <= limit
    assert (found.saturation > 0.0) == saturates
    assert found.used[0] == pytest.approx(1.0) if saturates else found.used[0] < 1.0
    assert ("saturated" in str(found)) == saturates


def test_noise_and_encoders_are_those_of_the_seed():
    moved = slide_motion()
    given = BRIEF | {"noise": 1e-4, "resolution": 1e-5}
    first, again, other = (simulate(moved, seed=seed, **given) for seed in (1, 1, 2))
    exact = simulate(moved, **BRIEF)
    np.testing.assert_array_equal(first.q, again.q)
    assert np.abs(first.q - other.q).max() > 1e-6
    assert 1e-5 < np.abs(first.q - exact.q).max() < 5e-3


def test_gains_that_are_too_great_for_the_rate_run_away():
    with np.errstate(over="ignore"):
        found = simulate(slide_motion(), natural_frequency=2000.0, noise=1e-6, **BRIEF)
    assert not found.stable
    assert found.settling == found.energy == found.greatest_tool_error == np.inf
    assert "unstable, the loop runs away at" in str(found)
    assert "unstable" in found._repr_html_()


def test_a_row_of_a_front_comes_out_as_it_does_alone(front):
    given = BRIEF | {"noise": 1e-5, "delay": 0.001, "payload_error": 0.3}
    found = simulate(front, **given)
    assert len(found) == len(front)
    for row in (0, 2, len(front) - 1):
        alone = simulate(front[row], **given)
        for name in ("settling", "energy", "rms_tool_error", "greatest_error", "used", "saturation"):
            np.testing.assert_array_equal(getattr(found, name)[row], getattr(alone, name))


def test_a_front_is_ranked_by_what_is_achieved(front):
    found = simulate(front, controller="pd", natural_frequency=40.0, tolerance=5e-3, **(BRIEF | {"settle": 0.6}))
    assert found.replaced == ("time", "energy")
    assert (found.settling > 0.0).any()
    np.testing.assert_array_equal(found.F[:, 0], front.F[:, 0] + found.settling)
    np.testing.assert_array_equal(found.F[:, 2], np.where(np.isfinite(found.settling), front.F[:, 2], np.inf))
    better = (found.F[:, None] <= found.F).all(axis=2) & (found.F[:, None] < found.F).any(axis=2)
    np.testing.assert_array_equal(found.stands, np.isfinite(found.settling) & ~better.any(axis=0))
    picked = found.pick("least_time")
    assert picked.index == np.where(found.stands, found.F[:, 0], np.inf).argmin()
    assert "achieved in closed loop" in picked.reason
    assert found.pick(1).index == 1
    with pytest.raises(UnknownNameError, match="did you mean 'least_time'"):
        found.pick("least_tine")
    assert "Front in closed loop" in found._repr_html_()


def test_chosen_rows_of_a_front_keep_their_numbers(front):
    whole, some = simulate(front, **BRIEF), simulate(front, rows=[3, 1], **BRIEF)
    np.testing.assert_array_equal(some.rows, [1, 3])
    np.testing.assert_array_equal(some.F, whole.F[[1, 3]])
    assert some.pick("least_time").index == 1
    with pytest.raises(TrajevoError, match="rows: expected several rows of the front, got"):
        simulate(front, rows=[], **BRIEF)
    with pytest.raises(TrajevoError, match="rows: expected a front with them, got Solution"):
        simulate(front[0], rows=[0], **BRIEF)


def test_a_front_of_which_nothing_settles_has_no_choice(front):
    found = simulate(front[:2], payload_error=-1.0, natural_frequency=10.0, tolerance=1e-9, **BRIEF)
    assert not found.stands.any()
    assert "0 settle within" in str(found)
    with pytest.raises(NoSolutionError, match="no solution is within"):
        found.pick("knee")


WRONG = [
    ({"controller": "pid"}, "unknown controller 'pid'; known: computed_torque, pd"),
    ({"rate": 0.0}, "rate: expected a rate from 1 to 100000 Hz, got 0.0"),
    ({"rate": "fast"}, "rate: expected a rate"),
    ({"natural_frequency": 0.0}, "natural_frequency: expected numbers above 0, got 0.0"),
    ({"damping_ratio": [1.0, 1.0]}, "damping_ratio: expected one number or 1, one for each joint, got 2"),
    ({"noise": -1.0}, "noise: expected numbers from 0 on"),
    ({"resolution": np.nan}, "resolution: expected"),
    ({"delay": 0.00015}, "delay: expected whole integration steps of 0.001 s, got 0.00015 s"),
    ({"delay": -1.0}, "delay: expected a time from 0 to 10 s"),
    ({"payload_error": -1.5}, "payload_error: expected a share from -1 to 10"),
    ({"seed": 1.5}, "seed: expected a whole number from 0 on"),
    ({"tolerance": 0.0}, "tolerance: expected a distance"),
    ({"settle": -1.0}, "settle: expected a time"),
    ({"step": 0.1}, "step: expected a time above 1e-07 s, up to a period of 0.001 s"),
    ({"rate": 1e5, "settle": 1000.0}, "rate: expected at most 2000000 samples"),
]


@pytest.mark.parametrize(("given", "said"), WRONG)
def test_wrong_arguments_are_told_in_a_sentence(given, said):
    with pytest.raises(TrajevoError) as caught:
        simulate(slide_motion(), **given)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_not_simulated_is_told():
    with pytest.raises(TrajevoError, match="motion: expected a solution, an optimum or a rollout, got str"):
        simulate("fast")
    with pytest.raises(TrajevoError, match="payload.model: expected 'rigid', which alone is simulated"):
        simulate(puma_motion(Payload(1.0, model="weight_only")))
    hybrid = load_robot("hybrid_manipulator")
    coupled = motion(hybrid, [hybrid.limits.lower + 0.1, hybrid.limits.lower + 0.2], [1.0])
    with pytest.raises(TrajevoError, match="expected actuators that drive one joint each; MuJoCo couples joints only"):
        simulate(Rollout(coupled.dynamics, coupled.trajectory))


def test_without_mujoco_its_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(TrajevoError, match=r"needs the package mujoco, pip install 'trajevo\[twin\]' brings it"):
        simulate(slide_motion())
