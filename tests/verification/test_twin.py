"""Claims against MuJoCo, a second engine: efforts, peaks, capacities and energies of motions read back from files."""

import csv
import json
import tomllib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

from tests.helpers import mostly_long
from trajevo import Solution, ViaPointProblem, ViaPoints, certify, dlcc, export, load_robot, optimise
from trajevo.base import jit
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.kinematics import ToolKinematics
from trajevo.robot.locate import list_robots
from trajevo.robot.payload import Payload
from trajevo.robot.robot import Robot
from trajevo.trajectory.interpolants import THROUGH_POINTS
from trajevo.verification.newton_euler import NewtonEuler

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'trajevo[twin]'")

from tests.twin import Twin

GRAVITY = (0.0, 0.0, -9.81)

#: Nothing but positions and efforts is limited, so that efforts are what least times stand on.
FREE = {"velocity": np.inf, "acceleration": np.inf, "jerk": np.inf}
FINGERS = {"panda_finger_joint1": 0.01, "panda_finger_joint2": 0.02}

#: Robots, how they are loaded, and the mass [kg] that they carry off their tool's axis.
ROBOTS = {
    "ur5": ({"tool": "tool0", "limits": FREE, "gravity": GRAVITY}, 4.0),
    "panda": ({"tool": "panda_hand_tcp", "lock": FINGERS, "limits": FREE, "gravity": GRAVITY}, 2.0),
    "z1": ({"limits": FREE, "gravity": GRAVITY}, 1.0),
    "puma560": ({"limits": FREE}, 2.0),
}

#: How much of what trajevo computes may differ from MuJoCo: efforts [N·m or N], positions [m] or rotations.
EFFORT, POSE = 1e-9, 1e-12

#: Instants at which motions are looked at; fewer for a first look. A tenth of them is written to files.
DENSE, FEWER = 100_000, 20_000


@dataclass(frozen=True, eq=False)
class Moved:
    """A robot's least-time motion with a payload, in files, and the same robot in MuJoCo."""

    robot: Robot
    payload: Payload
    solution: Solution
    table: dict
    file: dict
    count: int

    @classmethod
    def of(cls, name, count, folder):
        solution = least_time(name)
        told = json.loads(export(solution, folder / "motion.json", format="json").read_text())
        return cls(loaded(name), carried(name), solution, replay_of(solution, folder, count // 10), told, count)

    @cached_property
    def states(self):
        """Instants (T,) and positions, velocities, accelerations (T, n_joints) of the polynomials in the file."""
        return states(self.file["trajectory"], self.count)

    @cached_property
    def effort(self):
        """Effort at these instants by MuJoCo, (T, n_joints)."""
        return self.effort_with(self.payload)

    @property
    def energy(self):
        """∫ Σ |effort x velocity| dt by MuJoCo [J]."""
        t, _, v, _ = self.states
        return np.trapezoid(np.abs(self.effort * v).sum(axis=1), t)

    def effort_with(self, payload):
        t, q, v, a = self.states
        return Twin.of(self.robot, payload).effort(q, v, a) + dry_friction(self.robot, t, q, v)


def states(told, count):
    """Evenly spread instants and the states there, by the coefficients that a JSON file tells."""
    (key,) = (key for key in told if key.startswith("coefficients"))
    breaks, coefficients = np.array(told["breaks [s]"]), np.array(told[key])
    t = np.linspace(0.0, breaks[-1], count)
    segment = np.clip(np.searchsorted(breaks, t, side="right") - 1, 0, len(breaks) - 2)
    since = (t - breaks[segment])[:, None]
    rates = []
    for order in range(3):
        powers = np.polynomial.polynomial.polyder(coefficients, order, axis=-1)[segment]
        rates.append(np.polynomial.polynomial.polyval(since, np.moveaxis(powers, -1, 0), tensor=False))
    return t, *rates


def moving(t, q, v):
    """Velocities without those that rounding makes of a joint that stands."""
    standing = 1e-9 * (np.abs(v).max(axis=0) + np.abs(q).max(axis=0) / t[-1])
    return np.where(np.abs(v) <= standing, 0.0, v)


def dry_friction(robot, t, q, v):
    """Dry friction by its sign, forward and backward; a joint that stands has none."""
    v = moving(t, q, v)
    return np.where(v > 0.0, robot.friction.coulomb, -robot.friction.coulomb_backward) * (v != 0.0)


def carried(name):
    """A payload off the tool's axis whose inertia has no axis of the tool for its own."""
    mass = ROBOTS[name][1]
    inertia = mass * np.array([[0.005, 0.0003, 0.0], [0.0003, 0.0075, -0.0005], [0.0, -0.0005, 0.006]])
    return Payload(mass, (0.02, -0.03, 0.05), tuple(map(tuple, inertia.tolist())))


def loaded(name):
    return load_robot(name, **ROBOTS[name][0])


def middle_and_half(robot):
    lower, upper = np.clip(robot.limits.lower, -2.0, 2.0), np.clip(robot.limits.upper, -2.0, 2.0)
    return 0.5 * (lower + upper), 0.5 * (upper - lower)


def random_states(robot, count, seed=0):
    rng, (middle, half) = np.random.default_rng(seed), middle_and_half(robot)
    q, v, a = rng.uniform(-1.0, 1.0, (3, count, robot.dof))
    return middle + half * q, 5.0 * v, 5.0 * a


def least_time(name):
    """The quickest motion of a small search through four points under the effort limits."""
    robot, payload = loaded(name), carried(name)
    middle, half = middle_and_half(robot)
    problem = ViaPointProblem(
        robot=robot,
        points=middle + half * np.random.default_rng(5).uniform(-0.6, 0.6, (4, robot.dof)),
        duration_bounds=(0.05, 5.0),
        objectives=("time", "energy"),
        constraints=("position", "effort"),
        payload=payload,
    )
    return optimise(problem, seed=1, population=20, generations=10, polish=False, progress=False).least("time")


def replay_of(solution, folder, count):
    """The replay for MuJoCo of so many rows, by name of the column."""
    step = float(solution.trajectory.duration[0]) / (count - 1)
    file = export(solution, folder / "motion.csv", format="mujoco", step=step)
    header, *rows = csv.reader(line for line in file.read_text().splitlines() if not line.startswith("#"))
    table = np.array(rows, dtype=float)
    assert len(table) == count
    return {kind: table[:, [k for k, key in enumerate(header) if key.endswith(f"_{kind}")]] for kind in KINDS} | {
        "time": table[:, 0]
    }


KINDS = ("qpos", "qvel", "qacc", "force")


@pytest.fixture(
    scope="module",
    params=mostly_long([("puma560", FEWER), *((name, DENSE) for name in ROBOTS)], ("puma560", FEWER)),
    ids=str,
)
def moved(request, tmp_path_factory):
    name, count = request.param
    return Moved.of(name, count, tmp_path_factory.mktemp(name))


def rows_of(certificate, quantity):
    return np.array([row.bound for row in certificate.rows if row.quantity == quantity])


def test_efforts_along_an_exported_motion(moved):
    t, q, v, a, told = (moved.table[key] for key in ("time", *KINDS))
    effort = Twin.of(moved.robot, moved.payload).effort(q, v, a) + dry_friction(moved.robot, t, q, v)
    np.testing.assert_allclose(told, effort, rtol=0.0, atol=EFFORT)
    assert (np.abs(effort) / moved.robot.limits.effort).max() > 0.9  # efforts are what the least time stands on


def test_efforts_among_the_samples_of_an_exported_motion(moved):
    samples = moved.file["samples"]
    q, v, a, told = (
        np.array([samples[f"{name} {quantity}"] for name in moved.robot.joint_names]).T
        for quantity in ("position [rad]", "velocity [rad/s]", "acceleration [rad/s^2]", "effort [N*m]")
    )
    effort = Twin.of(moved.robot, moved.payload).effort(q, v, a)
    effort += dry_friction(moved.robot, np.array(samples["time [s]"]), q, v)
    np.testing.assert_allclose(told, effort, rtol=0.0, atol=EFFORT)


def test_the_tool_is_where_mujoco_has_it(moved):
    q, v = moved.table["qpos"][::10], moved.table["qvel"][::10]
    twin, kinematics = Twin.of(moved.robot), ToolKinematics.of(moved.robot)
    positions, rotations = twin.tool_poses(q)
    for found in (moved.robot.tool_poses(q), kinematics.pose(q)):
        np.testing.assert_allclose(found[0], positions, rtol=0.0, atol=POSE)
        np.testing.assert_allclose(found[1], rotations, rtol=0.0, atol=POSE)
    speed = np.linalg.norm(kinematics.twist(q, v)[..., :3], axis=-1)
    np.testing.assert_allclose(speed, twin.tool_speed(q, v), rtol=0.0, atol=POSE)


def test_no_peak_passes_what_is_certified(moved):
    certificate = certify(moved.solution)
    assert certificate.proven
    _, q, v, _ = moved.states
    peaks = {
        "effort": np.abs(moved.effort).max(axis=0),
        "power": np.abs(moved.effort * v).max(axis=0),
        "tool speed": Twin.of(moved.robot).tool_speed(q[::10], v[::10]).max(),
    }
    for quantity, peak in peaks.items():
        bound = rows_of(certificate, quantity)
        assert (peak <= bound).all()
        assert (peak.max() > 0.99 * bound.max()).all()
    (row,) = (row for row in moved.file["certificate"]["rows"] if row["quantity"] == "effort")
    joint = moved.robot.joint_names.index(row["joint"])
    assert 0.99 * row["bound"] < peaks["effort"][joint] <= row["bound"]


def test_the_guaranteed_mass_breaks_no_limit_and_a_little_more_than_the_upper_bound_does(moved):
    found, limit = dlcc(moved.solution), moved.robot.limits.effort
    assert found.mass <= found.upper <= found.mass * (1.0 + 1e-4)
    assert found.mass >= (1.0 - 1e-4) * moved.payload.mass  # for which the motion was made
    kept, broken = (
        np.abs(moved.effort_with(moved.payload.with_mass(mass))).max(axis=0) / limit
        for mass in (found.mass, 1.0002 * found.upper)
    )
    assert kept.max() <= 1.0
    assert kept.max() > 1.0 - 2e-4
    assert broken.max() > 1.0
    assert moved.robot.joint_names[int(broken.argmax())] == found.joint


def test_energy_is_mujocos(moved):
    energy, told = moved.solution.F["energy"], moved.solution.known_to["energy"]
    assert energy == pytest.approx(moved.energy, rel=1e-4)
    assert told <= 1e-4 * energy


@pytest.mark.thinned(3)
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.80665), (3.0, -4.0, 8.0)], ids=["as usual", "hung askew"])
def test_efforts_of_random_states(name, gravity):
    """Without a payload, with a body and with a bare weight, whose effort is that of a body at rest."""
    usual = gravity[0] == 0.0 and name != "puma560"  # robot.toml of the PUMA has its own
    robot = load_robot(name, **ROBOTS[name][0] | {"gravity": None if usual else gravity})
    payload, (q, v, a) = carried(name), random_states(robot, 500)
    bare, heavy = (Twin.of(robot, load, gravity=gravity) for load in (None, payload))
    still = np.zeros_like(v)
    rubbing = np.where(v > 0.0, robot.friction.coulomb, -robot.friction.coulomb_backward)
    weight = Payload(payload.mass, payload.com, model="weight_only")
    for load, expected in (
        (Payload(0.0), bare.effort(q, v, a)),
        (payload, heavy.effort(q, v, a)),
        (weight, bare.effort(q, v, a) + heavy.effort(q, still, still) - bare.effort(q, still, still)),
    ):
        found = Dynamics(robot, load).effort(q, v, a)
        np.testing.assert_allclose(found, expected + rubbing, rtol=0.0, atol=EFFORT)


@pytest.mark.parametrize("name", list_robots())
def test_efforts_of_every_robot_of_our_own(name):
    """By the gravity of its own file, and through its transmission, which has a test of its own."""
    robot, payload = load_robot(name), carried("ur5")
    told = tomllib.loads((robot.source / "robot.toml").read_text())
    twin, (q, v, a) = Twin.of(robot, payload, gravity=told["gravity"]["vector"]), random_states(robot, 500)
    effort = robot.transmission.effort(q, twin.effort(*robot.transmission.motion(q, v, a)))
    rubbing = np.where(v > 0.0, robot.friction.coulomb, -robot.friction.coulomb_backward)
    np.testing.assert_allclose(Dynamics(robot, payload).effort(q, v, a), effort + rubbing, rtol=0.0, atol=EFFORT)


def random_urdf(rng):
    """A chain of 2 to 8 joints that turn or slide, its frames and axes turned anyhow, and the name of its tool."""

    def numbers(values):
        return " ".join(map(repr, np.asarray(values).tolist()))

    def place(size):
        return f'<origin xyz="{numbers(rng.uniform(-size, size, 3))}" rpy="{numbers(rng.uniform(-3.0, 3.0, 3))}"/>'

    parts, above = ['<link name="base"/>'], "base"
    for k in range(rng.integers(2, 9)):
        mass, spread = rng.uniform(0.1, 9.0), rng.normal(size=(9, 3)) * rng.uniform(0.02, 0.2, 3)
        tensor = mass / 9.0 * (np.sum(spread**2) * np.eye(3) - spread.T @ spread)  # of nine points
        entries = {key: tensor[at] for key, at in ENTRIES.items()}
        parts.append(
            f'<joint name="j{k}" type="{rng.choice(["revolute", "prismatic"])}"><parent link="{above}"/>'
            f'<child link="l{k}"/>{place(0.5)}<axis xyz="{numbers(rng.normal(size=3))}"/>'
            '<limit lower="-2" upper="2" velocity="9" effort="99"/></joint>'
            f'<link name="l{k}"><inertial>{place(0.2)}<mass value="{mass!r}"/><inertia '
            + " ".join(f'{key}="{float(entry)!r}"' for key, entry in entries.items())
            + f'/></inertial></link><link name="end{k}"/>'
            f'<joint name="f{k}" type="fixed"><parent link="l{k}"/><child link="end{k}"/>{place(0.3)}</joint>'
        )
        above = f"end{k}"
    return f'<robot name="random">{"".join(parts)}</robot>', above


ENTRIES = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


@pytest.mark.parametrize("seed", mostly_long(range(20), *range(6)))
def test_random_robots(seed, tmp_path, monkeypatch):
    monkeypatch.setattr(jit, "can_compile", lambda: False)  # no robot comes twice
    rng = np.random.default_rng(seed)
    text, tool = random_urdf(rng)
    (tmp_path / "random.urdf").write_text(text)
    robot = load_robot(tmp_path / "random.urdf", tool=tool, limits=FREE, gravity=GRAVITY)
    payload, states = carried("ur5"), random_states(robot, 100, seed)
    twin = Twin.of(robot, payload)
    for engine in (Dynamics, NewtonEuler):
        np.testing.assert_allclose(engine(robot, payload).effort(*states), twin.effort(*states), rtol=0.0, atol=EFFORT)
    for ours, theirs in zip(robot.tool_poses(states[0]), twin.tool_poses(states[0]), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=POSE)


@pytest.mark.long
@pytest.mark.parametrize("name", ROBOTS)
def test_no_peak_of_random_motions_passes_what_is_certified(name):
    """Motions of every interpolant through random points, with joints that stand and joints that turn back."""
    robot, payload, rng = loaded(name), carried(name), np.random.default_rng(7)
    twin, (middle, half) = Twin.of(robot, payload), middle_and_half(robot)
    for interpolant in [*THROUGH_POINTS.values()] * 5:
        points = middle + half * rng.uniform(-0.8, 0.8, (5, robot.dof))
        points[:, rng.integers(robot.dof)] = 0.1
        spline = interpolant(ViaPoints(points), duration_bounds=(0.1, 5.0))
        shares = rng.uniform(0.3, 0.9, len(spline.variables))
        drawn = [
            one.lower * (one.upper / one.lower) ** share
            if one.lower > 0.0
            else one.lower + share * (one.upper - one.lower)
            for one, share in zip(spline.variables, shares.tolist(), strict=True)
        ]
        trajectory = spline(np.array([drawn]))
        certificate = certify(Rollout(Dynamics(robot, payload), trajectory))
        t, q, v, a = states(trajectory.definition(0), DENSE)
        effort = twin.effort(q, v, a) + dry_friction(robot, t, q, v)
        for quantity, found in (("effort", effort), ("power", effort * moving(t, q, v))):
            peak, bound = np.abs(found).max(axis=0), rows_of(certificate, quantity)
            assert (peak <= bound * (1.0 + 1e-12) + 1e-12).all()
            assert peak.max() > 0.99 * bound.max()
