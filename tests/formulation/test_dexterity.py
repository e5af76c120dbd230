"""Peaks of acceleration, jerk and effort rate, and limits of effort rate and of the distance to singularities."""

import re

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import refused
from trajevo import Robot, ViaPointProblem, certify, check, load_robot, optimise
from trajevo.formulation.constraints.further.dexterity import Dexterity
from trajevo.formulation.problem import Weights
from trajevo.solvers.gradient.weighted_sum import minimise_weighted

UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}}
POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.0, 1.2, -1.7, -1.2, 0.3], [1.0, -1.4, 1.4, -1.4, -1.5, 0.0]]
PEAKS = ("peak_acceleration", "peak_jerk", "peak_effort_rate")
LIMITS = ("position", "velocity", "acceleration", "jerk", "effort")
X = np.array([[0.8, 1.3], [1.4, 0.7], [2.0, 2.0]])


def problem(**given):
    return ViaPointProblem(**({"robot": UR5, "points": POINTS, "constraints": ()} | given))


def planar(lengths):
    masses = np.ones(len(lengths))
    return Robot.planar(lengths, masses, 0.5 * np.array(lengths), 0.1 * masses)


def test_peaks_are_those_of_dense_samples():
    own = problem(objectives=PEAKS, payload=2.0)
    F = own.evaluate(X, return_values_of=["F"])
    assert [one.unit for one in own.objectives] == ["rad/s^2", "rad/s^3", "N*m/s"]
    for row, x in zip(F, X, strict=True):
        rollout = own.rollout(x)
        shares = np.linspace(0.0, 1.0, 4001)
        q, v, a, j = (rollout.trajectory.at_shares(shares, order)[0] for order in range(4))
        effort = own.dynamics.effort(q[None], v[None], a[None])[0].reshape(2, -1, 6)
        step = rollout.trajectory.segment_durations[0] / 4000.0
        rate = np.abs(np.gradient(effort, axis=1, edge_order=2) / step[:, None, None]).max()
        dense = [np.abs(a).max(), np.abs(j).max()]
        np.testing.assert_allclose(row[:2], dense, rtol=1e-5)
        assert (row[:2] >= np.array(dense) * (1.0 - 1e-12)).all()
        assert row[2] == pytest.approx(rate, rel=2e-3)


def test_peaks_have_exact_derivatives():
    own = problem(objectives=PEAKS)
    dF = own.evaluate_with_gradients(X)[1]
    assert own.gradients_by(X) == "complex step"
    for k in range(2):
        step = 1e-6 * np.eye(2)[k]
        ahead, behind = (own.evaluate(X + sign * step, return_values_of=["F"]) for sign in (1, -1))
        np.testing.assert_allclose(dF[:, :, k], (ahead - behind) / 2e-6, rtol=1e-4, atol=1e-4 * np.abs(dF).max())


def test_manipulability_of_a_planar_arm_is_the_closed_form():
    arm = planar([0.5, 0.4])
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 2))
    found = Dexterity.of(arm)
    np.testing.assert_allclose(found.manipulability(q), 0.2 * np.abs(np.sin(q[:, 1])), atol=1e-12)
    assert found.directions.shape == (2, 6)


def test_measures_are_those_of_pinocchios_jacobian():
    robot = load_robot(**UR5)
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (30, 6))
    data, frame = robot.model.createData(), robot.model.getFrameId("tool0")
    sizes = []
    for row in q:
        J = pin.computeFrameJacobian(robot.model, data, row, frame, pin.LOCAL_WORLD_ALIGNED)
        sizes.append(np.linalg.svd(J, compute_uv=False))
    found = Dexterity.of(robot)
    np.testing.assert_allclose(found.manipulability(q), np.prod(sizes, axis=1), rtol=1e-8)
    np.testing.assert_allclose(found.least_singular_value(q), np.array(sizes)[:, -1], rtol=1e-8)


@pytest.mark.parametrize("name", ["manipulability", "least_singular_value"])
def test_derivatives_of_measures(name):
    measure = getattr(Dexterity.of(load_robot(**UR5)), name)
    q = np.random.default_rng(2).uniform(-2.0, 2.0, (10, 6))
    for step in np.eye(6):
        exact = measure(q + 1e-20j * step).imag / 1e-20
        rough = (measure(q + 1e-6 * step) - measure(q - 1e-6 * step)) / 2e-6
        np.testing.assert_allclose(exact, rough, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize(
    ("given", "names"),
    [
        ({"manipulability": 0.03}, ["manipulability"]),
        ({"least_singular_value": 0.1}, ["least singular value"]),
        ({"effort_rate": 400.0}, [f"effort rate of {name}" for name in load_robot(**UR5).joint_names]),
    ],
)
def test_limits_are_kept_at_samples_and_certificates_say_so(given, names):
    own = problem(objectives=("time", "jerk"), constraints=LIMITS, **given)
    front = optimise(own, seed=1, generations=12, population=24, progress=False, polish=False)
    assert len(front), front.blocking
    found = certify(front.pick("0"))
    assert [one.name for one in found.uncovered] == names
    assert not found.violated
    assert not found.proven
    assert "checked at samples only" in str(found)


def test_a_limit_of_the_effort_rate_costs_time():
    """Without gravity and friction, efforts grow with 1/T² and their rates with 1/T³."""
    arm = planar([0.5, 0.4])
    rows = [[0.2, 0.5], [1.0, 0.9]]

    def least_time(most):
        own = ViaPointProblem(
            robot=arm, points=rows, objectives=("time",), constraints=(), effort_rate=most, duration_bounds=(0.05, 9.0)
        )
        return minimise_weighted(own, Weights((1.0,)), seed=0, starts=2).F["time"]

    assert least_time(8.0) == pytest.approx(2.0 * least_time(64.0), rel=1e-5)


def test_points_too_near_to_singular_postures_are_told_before_a_search():
    stretched = [*POINTS[:2], [1.0, -1.4, 0.02, -1.4, -1.5, 0.0]]
    for given, kind in (({"manipulability": 0.02}, "manipulability"), ({"least_singular_value": 0.05}, "singular")):
        found = check(problem(points=stretched, **given))
        (finding,) = found.impossible
        assert re.search(rf"point 2 has a .*{kind}.* of 0.0[25] wanted; remedy: another posture there", str(finding))
        assert not check(problem(**given)).impossible


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"manipulability": -1.0}, r"manipulability: expected a positive number \[1\], got -1.0"),
        ({"effort_rate": "fast"}, "effort_rate: expected a positive number"),
        ({"constraints": ["manipulability"]}, "'manipulability' is switched on by giving 'manipulability'"),
    ],
)
def test_bad_limits_are_refused(given, says):
    refused(lambda: problem(**given), says)
