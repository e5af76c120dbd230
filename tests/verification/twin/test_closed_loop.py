"""Closed loops against what is known of them: another reader of robots, linear systems by SciPy, energy, friction."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.verification.twin.robots import ROD, SLIDE, motion, one_joint, puma, puma_motion
from trajevo import Payload, Rollout, load_robot, simulate
from trajevo.robot.payload import carrying
from trajevo.verification.twin.plant import Plant

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")

from tests.twin import Twin  # noqa: E402

PAYLOAD = Payload(1.5, (0.02, -0.03, 0.05), ((0.008, 0.0004, 0.0), (0.0004, 0.011, -0.0007), (0.0, -0.0007, 0.009)))


def stepped(plant, q, v, efforts):
    """Positions and velocities, (steps + 1, 2, n_joints), of one copy under efforts (steps, n_joints)."""
    states = plant.at(q[None], v[None])
    found = [(plant.positions(states)[0], plant.velocities(states)[0])]
    for effort in efforts:
        states = plant.moved(states, effort[None, None], np.array([0]))
        found.append((plant.positions(states)[0], plant.velocities(states)[0]))
    return np.array(found)


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_the_plant_moves_as_the_robot_that_mujoco_reads_itself(name):
    """The model of `tests/twin.py` is read from the URDF by MuJoCo; without dry friction both move alike."""
    given = {"limits": {"acceleration": 10.0, "jerk": 100.0}, "tool": "tool0"} if name == "ur5" else {}
    robot = load_robot(name, friction={"coulomb": 0.0, "viscous": 0.7, "armature": 0.2}, **given)
    step, rng = 1e-3, np.random.default_rng(3)
    q, v = rng.uniform(-1.0, 1.0, (2, robot.dof))
    efforts = rng.uniform(-20.0, 20.0, (40, robot.dof))
    ours = stepped(Plant(robot, [carrying(robot, PAYLOAD)], step), q, v, efforts)
    twin = Twin.of(robot, PAYLOAD, gravity=tuple(robot.model.gravity.linear))
    twin.model.opt.timestep, twin.model.opt.integrator = step, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(twin.model)
    data.qpos[twin.columns], data.qvel[twin.columns] = q, v
    for effort, (position, velocity) in zip(efforts, ours[1:], strict=True):
        data.qfrc_applied[twin.columns] = effort
        mujoco.mj_step(twin.model, data)
        np.testing.assert_allclose(position, data.qpos[twin.columns], atol=1e-9)
        np.testing.assert_allclose(velocity, data.qvel[twin.columns], atol=1e-8)


def test_a_falling_rod_keeps_its_energy():
    robot = one_joint(ROD)
    found = stepped(Plant(robot, [robot.model], 1e-3), np.zeros(1), np.zeros(1), np.zeros((1500, 1)))[:, :, 0]
    inertia = 0.08 + 1.5 * 0.4**2
    energy = 0.5 * inertia * found[:, 1] ** 2 - 1.5 * 9.81 * 0.4 * np.sin(found[:, 0])
    assert np.abs(found[:, 1]).max() > 5.0
    assert np.abs(energy).max() < 1e-7


def test_dry_friction_stops_a_slide_as_on_paper_and_holds_it():
    """Forward it loses 3 N / 2 kg, backward 1 N / 2 kg; then it stands, and a force below either does not move it."""
    robot = one_joint(SLIDE)
    friction = replace(robot.friction, coulomb=np.array([3.0]), coulomb_backward=np.array([1.0]))
    robot = replace(robot, friction=friction)
    step = 2.5e-4
    for speed, deceleration in ((0.3, 1.5), (-0.1, 0.5)):
        plant = Plant(robot, [robot.model], step)
        stops = abs(speed) / deceleration
        count = round(1.5 * stops / step)
        found = stepped(plant, np.zeros(1), np.array([speed]), np.zeros((count, 1)))[:, :, 0]
        t = step * np.arange(count + 1)
        expected = np.sign(speed) * np.maximum(abs(speed) - deceleration * t, 0.0)
        np.testing.assert_allclose(found[:, 1], expected, atol=2e-3)
        assert found[-1, 0] == pytest.approx(0.5 * speed * stops, abs=1e-3)
    for force in (2.9, -0.9):
        held = stepped(Plant(robot, [robot.model], step), np.zeros(1), np.zeros(1), np.full((800, 1), force))
        assert np.abs(held[:, 1]).max() < 1e-3


def linear_loop(rollout, *, rate, frequency, damping, delay_samples, viscous, mass, settle):
    """The slide under a sampled PD with held forces, integrated by SciPy between the samples."""
    trajectory, period = rollout.trajectory, 1.0 / rate
    end = float(trajectory.duration[0])
    count = int(np.floor((end + settle) * rate * (1 + 1e-12))) + 1
    t = np.arange(count) * period
    q, v, _ = (trajectory.evaluate(np.minimum(t, end)[None], order)[0, :, 0] for order in range(3))
    v = np.where(t < end, v, 0.0)
    state, last, forces, found = np.array([q[0], v[0]]), 0.0, [viscous * v[0]] * delay_samples, []
    for k in range(count):
        found.append(state[0])
        error = q[k] - state[0]
        slope = (error - last) / period if k else 0.0
        asked = mass * (2.0 * damping * frequency * slope + frequency**2 * error) + viscous * (v[k] - slope)
        forces.append(asked)
        force, last = forces[k], error
        solved = solve_ivp(
            lambda _, y, force=force: [y[1], (force - viscous * y[1]) / mass],
            (0.0, period),
            state,
            rtol=1e-11,
            atol=1e-13,
        )
        state = solved.y[:, -1]
    return np.array(found)


@pytest.mark.parametrize("late", [0, 2])
def test_a_slide_under_pd_is_scipys_solution(late):
    robot = one_joint(SLIDE, friction={"viscous": 4.0, "coulomb": 0.0, "armature": 0.5})
    moved = motion(robot, [[0.0], [0.3], [0.1]], [0.2, 0.2])
    given = {"rate": 500.0, "natural_frequency": 40.0, "damping_ratio": 0.8, "settle": 0.1}
    found = simulate(moved, controller="pd", delay=late / 500.0, **given)
    ours = linear_loop(
        moved, rate=500.0, frequency=40.0, damping=0.8, delay_samples=late, viscous=4.0, mass=2.5, settle=0.1
    )
    assert found.greatest_error[0] > 1e-3
    np.testing.assert_allclose(found.q[:, 0], ours, atol=1e-9)


def test_computed_torque_tracks_with_an_error_of_the_order_of_the_period():
    moved = puma_motion(PAYLOAD, 0.6, friction={"coulomb": 0.0, "viscous": 1.0})
    errors = [simulate(moved, rate=rate, settle=0.0).rms_tool_error for rate in (250.0, 500.0, 1000.0)]
    assert errors[-1] < 1e-4
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.02)


def test_efforts_are_those_of_the_planned_motion_in_ideal_conditions():
    moved = puma_motion(PAYLOAD, 0.6)
    trajectory, apart = moved.trajectory, []
    for rate in (500.0, 2000.0):
        found = simulate(moved, rate=rate, settle=0.0)
        t = found.t[:-1][None]
        planned = moved.effort_in(*(trajectory.evaluate(t, order) for order in range(3)))[0]
        inside = (np.abs(trajectory.evaluate(t, 1)[0]) > 0.05).all(axis=1)  # dry friction jumps where a joint turns
        apart.append(np.abs(found.effort[:-1] - planned)[inside].max() / np.abs(planned).max())
    assert apart[0] < 0.06
    assert apart[1] < 0.5 * apart[0]


@pytest.mark.parametrize("controller", ["computed_torque", "pd"])
def test_a_wrong_payload_leaves_the_error_that_its_weight_makes(controller):
    """At rest M kp e, or D kp e, bears the weight that the controller does not know."""
    payload = Payload(2.0, (0.1, 0.0, 0.1))
    robot = puma(friction={"coulomb": 0.0, "viscous": 2.0, "armature": 0.5})
    moved = motion(robot, [[0.0, 0.8, 0.0, 0.0, 0.8, 0.0], [0.1, 0.7, 0.1, 0.1, 0.7, 0.1]], [0.3], payload)
    given = {"controller": controller, "payload_error": -0.5, "natural_frequency": 45.0, "settle": 0.9}
    found = simulate(moved, **given, tolerance=1e-6)
    q, still = found.q[-1:], np.zeros((1, 6))
    believed = moved.dynamics.__class__(robot, payload.with_mass(1.0))
    if controller == "pd":
        start = found.reference[:1]
        inertia = [
            (believed.effort(start, still, unit[None]) - believed.effort(start, still, still))[0, k]
            for k, unit in enumerate(np.eye(6))
        ]
        corrected = np.array(inertia) * 2025.0 * found.error[-1]
    else:
        asked = (2025.0 * found.error[-1])[None]
        corrected = (believed.effort(q, still, asked) - believed.effort(q, still, still))[0]
    missing = (moved.dynamics.effort(q, still, still) - believed.effort(q, still, still))[0]
    assert np.abs(missing).max() > 1.0
    np.testing.assert_allclose(corrected, missing, atol=1e-6)
    assert found.settling == np.inf
    assert found.rest_error > 3e-4


def test_masses_of_motions_are_those_of_their_payloads():
    """A rollout whose motions carry masses of their own moves as one with that payload."""
    light, heavy = (puma_motion(PAYLOAD.with_mass(mass), 0.1) for mass in (0.5, 3.0))
    for other, mass in ((light, 0.5), (heavy, 3.0)):
        moved = Rollout(light.dynamics, light.trajectory, masses=np.array([mass]))
        found, expected = (simulate(each, payload_error=0.2, settle=0.0) for each in (moved, other))
        np.testing.assert_allclose(found.q, expected.q, atol=1e-10)
        np.testing.assert_allclose(found.effort, expected.effort, atol=1e-6)
