"""Friction and damping of ``<dynamics>``: used unless others are given, told, and part of energies."""

import numpy as np
import pytest

from tests.helpers import UNDRAWN, refused, trajevo
from trajevo import Dynamics, ViaPointProblem, certify, load_robot, optimise, verify
from trajevo.robot.examine import examine

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
URDF = """\
<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
    <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="2" effort="60"/>
    <dynamics damping="2.0" friction="3.0"/></joint>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-2" upper="2" velocity="2" effort="90"/><dynamics damping="4.5"/></joint>
</robot>
"""
TOLD = "friction 3 N·m and damping 2 N·m·s/rad of 'shoulder', damping 4.5 N·s/m of 'slide'"
USED, LEFT = "friction of <dynamics> used", "efforts leave out what <dynamics> of the URDF says"
#: How much an objective may differ from a sum over dense instants, as for all robots.
APART = 1e-4
POINTS = [[-0.4, 0.1], [0.5, 0.3], [0.2, -0.2]]


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("friction", "viscous", "coulomb", "notes"),
    [
        (None, [2.0, 4.5], [3.0, 0.0], [f"{USED}: {TOLD}"]),
        ("urdf", [2.0, 4.5], [3.0, 0.0], [f"{USED}: {TOLD}"]),
        ("none", [0.0, 0.0], [0.0, 0.0], [f"{LEFT}: {TOLD}"]),
        (
            {"viscous": 1.5},
            [1.5, 1.5],
            [3.0, 0.0],
            [
                f"{USED}: friction 3 N·m of 'shoulder'",
                f"{LEFT}: damping 2 N·m·s/rad of 'shoulder', damping 4.5 N·s/m of 'slide'",
            ],
        ),
        (
            {"viscous": [0.5, "0.25 N*s/m"], "coulomb": {"slide": "0.5 N"}},
            [0.5, 0.25],
            [3.0, 0.5],
            [
                f"{USED}: friction 3 N·m of 'shoulder'",
                f"{LEFT}: damping 2 N·m·s/rad of 'shoulder', damping 4.5 N·s/m of 'slide'",
            ],
        ),
    ],
)
def test_friction_is_the_file_s_none_or_what_is_given(file, friction, viscous, coulomb, notes):
    robot = load_robot(file, limits=LIMITS, friction=friction)
    np.testing.assert_array_equal(robot.friction.viscous, viscous)
    np.testing.assert_array_equal(robot.friction.coulomb, coulomb)
    np.testing.assert_array_equal(robot.friction.coulomb_backward, coulomb)
    assert list(robot.friction_notes) == notes
    assert list(robot.mass_notes) == notes
    again = load_robot(**robot.settings)
    np.testing.assert_array_equal(again.friction.viscous, viscous)


@pytest.mark.parametrize(
    ("friction", "says"),
    [
        ("toml", "unknown friction 'toml'; known: file, none, urdf"),
        (2.0, "friction: expected 'file', 'none' or a mapping of viscous, coulomb, armature, got 2.0"),
        ({"dry": 1.0}, "unknown kind of friction 'dry'"),
        ({"viscous": {"sholder": 1.0}}, "unknown joint in friction.viscous 'sholder'; .*did you mean 'shoulder'"),
        ({"viscous": [1.0, 2.0, 3.0]}, "friction.viscous: expected 1 or 2 values, got 3"),
        ({"coulomb": -1.0}, r"friction.coulomb: expected numbers from 0 on, got \[-1.0, -1.0\]"),
        ({"coulomb": "inf"}, "friction.coulomb: expected numbers from 0 on"),
        ({"coulomb": {"slide": "1 N*m"}}, "friction.coulomb.slide: expected a number and a unit that converts to N,"),
    ],
)
def test_friction_that_cannot_be_used_is_refused(file, friction, says):
    refused(lambda: load_robot(file, limits=LIMITS, friction=friction), says)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('damping="4.5"', 'damping="-4.5"', "joint 'slide': dynamics: damping: expected a number from 0 on, got -4.5"),
        ('friction="3.0"', 'friction="3 Nm"', "'shoulder': dynamics: expected a finite number as friction, got '3 Nm'"),
    ],
)
def test_friction_of_a_file_that_cannot_be_read_is_refused(file, old, new, says):
    file.write_text(URDF.replace(old, new), encoding="utf-8")
    refused(lambda: load_robot(file, limits=LIMITS), says)
    assert examine(file).errors


def test_energies_hold_friction_as_a_dense_sum_has_it(file):
    """The energy that friction takes is ∫ Σ (d v² + c |v|) dt, where the effort keeps the sign of the velocity; the
    whole is compared with a sum over 200,001 instants of the efforts without friction, to which it is added here."""
    robot, bare = (load_robot(file, limits=LIMITS, friction=each) for each in (None, "none"))
    made = {
        name: ViaPointProblem(robot=each, points=POINTS, objectives=("time", "energy", "square_power"))
        for name, each in (("with", robot), ("without", bare))
    }
    x = np.array([[0.8, 1.1], [2.0, 1.4]])
    F = made["with"].evaluate(x)[0]
    for row, times in enumerate(x):
        trajectory = made["with"].decode(times[None])
        t = np.linspace(0.0, float(trajectory.duration[0]), 200_001)
        q, v, a = (trajectory.evaluate(t, order)[0] for order in range(3))
        torque = Dynamics(bare).effort(q, v, a) + np.array([2.0, 4.5]) * v + np.array([3.0, 0.0]) * np.sign(v)
        power = torque * v
        step = t[1] - t[0]
        energy = (np.abs(power[1:]) + np.abs(power[:-1])).sum() * step / 2.0
        assert F[row, 1] == pytest.approx(energy, rel=APART)
        assert F[row, 2] == pytest.approx((power[1:] ** 2 + power[:-1] ** 2).sum() * step / 2.0, rel=APART)
    assert (np.abs(F[:, 1] / made["without"].evaluate(x)[0][:, 1] - 1.0) > 0.05).all()


def test_motions_with_friction_are_proven(file):
    robot = load_robot(file, limits=LIMITS)
    names = ("position", "velocity", "acceleration", "jerk", "effort")
    problem = ViaPointProblem(robot=robot, points=POINTS, objectives=("time", "energy"), constraints=names)
    knee = optimise(problem, generations=6, population=20, seed=1, progress=False, polish=False).knee()
    certificate = certify(knee)
    assert certificate.proven
    assert f"{USED}: {TOLD}" in certificate.notes
    assert verify(knee).passed


def test_what_robot_toml_says_comes_first(file, tmp_path):
    joint = (
        "[joints.{}]\nposition = {{ lower = -1.0, upper = 1.0, unit = '{u}' }}\n"
        "velocity = {{ limit = 2.0, unit = '{u}/s' }}\nacceleration = {{ limit = 8.0, unit = '{u}/s^2' }}\n"
        "jerk = {{ limit = 80.0, unit = '{u}/s^3' }}\neffort = {{ limit = 50.0, unit = '{e}' }}\n{}"
    )
    (tmp_path / "robot.toml").write_text(
        'format = 1\nname = "arm"\nurdf = "arm.urdf"\ntool = "lower"\nreference = "made"\n'
        'gravity = { vector = [0.0, 0.0, -9.80665], unit = "m/s^2" }\n'
        + joint.format("shoulder", "viscous_friction = { value = 7.0, unit = 'N*m*s/rad' }\n", u="rad", e="N*m")
        + joint.format("slide", "armature = { value = 0.5, unit = 'kg' }\n", u="m", e="N")
    )
    robot = load_robot(tmp_path)
    np.testing.assert_array_equal(robot.friction.viscous, [7.0, 4.5])
    np.testing.assert_array_equal(robot.friction.coulomb, [3.0, 0.0])
    np.testing.assert_array_equal(robot.friction.armature, [0.0, 0.5])
    assert robot.friction_notes == (
        f"{USED}: friction 3 N·m of 'shoulder', damping 4.5 N·s/m of 'slide'",
        f"{LEFT}: damping 2 N·m·s/rad of 'shoulder'",
    )
    np.testing.assert_array_equal(load_robot(tmp_path, friction="urdf").friction.viscous, [2.0, 4.5])
    none = load_robot(tmp_path, friction="none").friction
    assert not none.viscous.any()
    np.testing.assert_array_equal(none.armature, [0.0, 0.5])


def test_every_command_tells_it(file, tmp_path):
    task = (
        'robot = {{ name = "arm.urdf"{} }}\npoints = [[0.0, 0.0], [0.5, 0.4]]\nduration_bounds = [0.5, 4.0]\n'
        "[limits]\nacceleration = 10.0\njerk = 100.0\n"
    )
    (tmp_path / "task.toml").write_text(task.format(""))
    assert f"note: {USED}: {TOLD}" in trajevo("check-robot", file).stdout
    assert f"note: {USED}: {TOLD}" in trajevo("check", "task.toml", cwd=tmp_path).stdout
    solved = trajevo(
        "solve", "task.toml", "--generations", "2", "--population", "12", *UNDRAWN, "--out", "run", cwd=tmp_path
    )
    assert f"{USED}: {TOLD}" in solved.stdout + solved.stderr
    assert f"Friction of <dynamics> used: {TOLD}" in trajevo("certify", "run", cwd=tmp_path).stdout
    (tmp_path / "task.toml").write_text(task.format(', friction = "none"'))
    assert f"note: {LEFT}: {TOLD}" in trajevo("check", "task.toml", cwd=tmp_path).stdout
    (tmp_path / "task.toml").write_text(task.format(", friction = { viscous = { slide = 1.0 } }"))
    assert f"note: {LEFT}: damping 4.5 N·s/m of 'slide'" in trajevo("check", "task.toml", cwd=tmp_path).stdout


def test_a_joint_that_its_own_friction_holds_is_told(file):
    assert not [said for said in examine(file).warnings if "cannot move" in said]
    file.write_text(URDF.replace('effort="60"', 'effort="3"'), encoding="utf-8")
    (said,) = [said for said in examine(file).warnings if "cannot move" in said]
    assert "joint 'shoulder' cannot move: its friction by <dynamics>, 3, is not below its effort limit, 3" in said
