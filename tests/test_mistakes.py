"""Natural mistakes, each with the whole sentence that a user sees: typos, units, files, joints."""

import re

import pytest

from tests.helpers import trajevo
from trajevo import TrajevoError, load_robot

#: An arm with two joints; what follows changes one thing of these files at a time.
URDF = """\
<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
    <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="2" effort="60"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="30"/></joint>
  <joint name="mount" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.3 0 0"/></joint>
</robot>
"""
TASK = """\
robot = { name = "arm.urdf" }
points = [[0.0, 0.0], [0.5, 0.4], [0.2, 0.1]]
duration_bounds = [0.3, 4.0]
objectives = ["time", "energy"]
angle = "rad"
seed = 1

[limits]
acceleration = 10.0
jerk = 100.0

[payload]
mass = 1.0
com = [0.0, 0.0, 0.03]

[constraints]
effort_margin = 0.2

[algorithm]
population = 24
"""
LIMITS = "joint_limits:\n  shoulder: {max_velocity: 1.5}\n  elbow: {max_velocity: 1.5}\n"


@pytest.fixture
def folder(tmp_path):
    for name, text in {"task.toml": TASK, "arm.urdf": URDF, "joint_limits.yaml": LIMITS}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def said(folder, *arguments):
    """What the command says on standard error, on one line, with paths as they are from the folder on."""
    done = trajevo(*arguments, cwd=folder)
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr.removeprefix("error: ").rstrip("\n").replace(f"{folder}/", "")


#: What is written in the task, what is written instead, and what is said.
IN_THE_TASK = [
    (
        "duration_bounds",
        "duration_bound",
        "task.toml: line 3: duration_bound: unknown key; did you mean 'duration_bounds'?",
    ),
    (
        "[algorithm]",
        "[optimizer]",
        "task.toml: line 19: optimizer: unknown key; did you mean 'algorithm'?",
    ),
    (
        "[limits]",
        "[joint_limits]",
        "task.toml: line 8: joint_limits: unknown key; did you mean 'limits'?",
    ),
    (
        "effort_margin",
        "effort_margn",
        "task.toml: line 17: constraints.effort_margn: unknown key; known: cycles, deviation, deviation_of, "
        "dwell, effort_margin, effort_rate, held, least_singular_value, limits, longest_time, manipulability, "
        "overshoot, peak_power, tool_height, tool_speed, via_error; did you mean 'effort_margin'?",
    ),
    (
        "objectives",
        "objective",
        "task.toml: line 4: objective: unknown key; did you mean 'objectives'?",
    ),
    (
        "name =",
        "nam =",
        "task.toml: line 1: robot.nam: unknown key; known: allow_massless, base, dh, drives, friction, gravity, "
        "grip, joints, kind, limits, lock, name, packages, stand, supply, tool, tools, xacro; did you mean 'name'?",
    ),
    (
        '"arm.urdf"',
        '"amr.urdf"',
        "task.toml: line 1: robot: amr.urdf: no such URDF file; did you mean 'arm.urdf'?",
    ),
    (
        '"arm.urdf"',
        '"ur10e"',
        "task.toml: line 1: robot: unknown robot 'ur10e'; did you mean 'ur10'?",
    ),
    (
        '"arm.urdf"',
        '"arm.xacro"',
        "task.toml: line 1: robot: arm.xacro: no such file",
    ),
    (
        '"arm.urdf"',
        "arm.urdf",
        "task.toml: line 1, column 18: cannot be read as TOML: expected a number, true, false, a "
        "list in [ ], or text in quotes, got robot = { name = arm.urdf }",
    ),
    (
        '"energy"',
        '"enregy"',
        "task.toml: line 4: objectives: unknown objective 'enregy'; did you mean 'energy'?",
    ),
    (
        "population",
        "pop_size",
        "task.toml: line 20: algorithm.pop_size: unknown key; known: algorithm, cpu_time, "
        "crossover_index, crossover_probability, evaluations, generations, mutation_index, "
        "mutation_probability, offsprings, polish, polish_every, population, seed, starts, "
        "time_limit; did you mean 'population'?",
    ),
    (
        "seed = 1",
        'interpolant = "quintic"',
        "task.toml: line 6: interpolant: unknown interpolant 'quintic'; known: bspline, cubic, "
        "hermite, hybrid, improved_quartic_bspline, linear_blends, polynomial, quartic_cubic_quartic, "
        "quintic_spline, septic_spline; did you mean 'quintic_spline'?",
    ),
    (
        "seed = 1",
        'seed = "1"',
        "task.toml: line 6: seed: expected a whole number, got '1'",
    ),
    (
        "seed = 1",
        "seed = 1.0",
        "task.toml: line 6: seed: expected a whole number, got 1.0",
    ),
    (
        '"rad"',
        '"degrees"',
        "task.toml: line 5: angle: expected 'rad' or 'deg', got 'degrees'",
    ),
    (
        '"rad"',
        '"rad',
        "task.toml: line 5, column 13: cannot be read as TOML: a text is not closed by a "
        'quotation mark in its line, got angle = "rad',
    ),
    (
        "10.0",
        "1e400",
        "task.toml: line 9: expected a number up to 1.8e308, got 1e400; write inf for no limit",
    ),
    (
        "10.0",
        "10,0",
        "task.toml: line 9, column 18: cannot be read as TOML: expected a decimal point, not a "
        "comma, got acceleration = 10,0",
    ),
    (
        "10.0",
        '"10 rad/s"',
        "task.toml: line 9: limits.acceleration.shoulder: expected a number and a unit that "
        "converts to rad/s^2, such as '1.5 rad/s^2' or '1.5 deg/s^2', got '10 rad/s'",
    ),
    (
        "10.0",
        "{ elbo = 10.0 }",
        "task.toml: line 9: unknown joint in limits.acceleration 'elbo'; known: elbow, shoulder; did you mean 'elbow'?",
    ),
    (
        "10.0",
        "[10.0, 10.0, 10.0]",
        "task.toml: line 9: limits.acceleration: expected 1 or 2 values, got 3",
    ),
    (
        "10.0",
        "10.0\nvelocity = 180",
        'task.toml: line 10: limits.velocity.shoulder: 180 rad/s looks like deg/s: write "180 '
        'deg/s", or "180 rad/s" if it is meant',
    ),
    (
        "10.0",
        "10.0\nposition = [-180, 180]",
        'task.toml: line 10: limits.position.shoulder: -180 rad looks like deg: write "-180 '
        'deg", or "-180 rad" if it is meant',
    ),
    (
        "10.0",
        "10.0\nposition = [2.0, -2.0]",
        "task.toml: line 1: robot: arm.urdf: joint 'shoulder': position: lower must be below upper, got 2 and -2",
    ),
    (
        "jerk = 100.0",
        "",
        "task.toml: line 1: robot: arm.urdf: no jerk limit for shoulder, elbow, which a URDF "
        "cannot hold: give it in robot.toml (jerk = { limit = 10.0, unit = ... } of each joint), "
        'in task.toml ([limits] jerk = 10.0), or as an argument (limits={"jerk": 10.0}); inf '
        "means no limit",
    ),
    (
        "jerk = 100.0",
        "jerk = 100.0\njerk = 200.0",
        "task.toml: line 11, column 13: cannot be read as TOML: this key is given twice, got jerk = 200.0",
    ),
    (
        "[0.5, 0.4]",
        "[45.0, 30.0]",
        "task.toml: line 2: points: point 1 puts 'shoulder' at 45 rad, outside its range -3 to 3 "
        'rad, which looks like degrees: say so by angle = "deg" in a task, by [deg] in the '
        "header of a file, or convert them by np.radians in Python",
    ),
    (
        "[0.5, 0.4]",
        "[0.5]",
        "task.toml: line 2: points: point 1: expected 2 numbers, one for each of shoulder, elbow, got 1",
    ),
    (
        "[0.5, 0.4]",
        '[0.5, "0.4"]',
        "task.toml: line 2: points.1.1: expected a number, got '0.4'",
    ),
    (
        "[0.5, 0.4]",
        "[0.0, 0.0]",
        "task.toml: line 2: points: point 1 repeats point 0, [0.0, 0.0]; consecutive points must differ",
    ),
    (
        "[0.5, 0.4]",
        "{ position = [500.0, 0.0, 400.0] }",
        "task.toml: line 2: points: point 1: expected a pose that 'arm' reaches inside its "
        "position limits, got [500.0, 0.0, 400.0] m; the best of 34 tries misses it by 6.394e+05 "
        "mm; in mm it is reached: positions are in m, in files of points also in mm with [mm] in "
        "the header",
    ),
    (
        "[0.5, 0.4]",
        "{ position = [0.5, 0.0, 0.4], rpy = [180.0, 0.0, 0.0] }",
        "task.toml: line 2: points: point 1: rpy: expected angles within ±2π rad, got [180.0, "
        '0.0, 0.0], which looks like degrees: say so by angle = "deg" in a task, by [deg] in the '
        "header of a file, or convert them by np.radians in Python",
    ),
    (
        "[0.5, 0.4]",
        "{ position = [0.5, 0.0, 0.4], quaternion = [1.0, 0.0, 0.0, 1.0] }",
        "task.toml: line 2: points: point 1: quaternion: expected x, y, z, w of norm 1, got "
        "[1.0, 0.0, 0.0, 1.0] of norm 1.414",
    ),
    (
        "[0.5, 0.4]",
        "{ pos = [0.5, 0.0, 0.4] }",
        "task.toml: line 2: points.1.pos: unknown key; known: free, joints, position, quaternion, rotation_vector, rpy",
    ),
    (
        "[[0.0, 0.0], [0.5, 0.4], [0.2, 0.1]]",
        '"point.csv"',
        "task.toml: line 2: points: point.csv: no such file",
    ),
    (
        "mass = 1.0",
        "mass = 1500",
        'task.toml: line 13: payload.mass: 1500 kg looks like g: write "1500 g", or "1500 kg" if it is meant',
    ),
    (
        "0.03]",
        "30.0]",
        'task.toml: line 14: payload.com: 30 m looks like mm: write "30 mm", or "30 m" if it is meant',
    ),
    (
        "0.03]",
        "0.03]\ninertia = [[900, 0, 0], [0, 900, 0], [0, 0, 900]]",
        "task.toml: line 15: payload.inertia: 900 kg·m² for 1 kg is that of a body with a radius "
        "of gyration of 30 m and looks like kg·mm²: 1 kg·mm² is 1e-6 kg·m²",
    ),
    (
        "mass = 1.0",
        "",
        "task.toml: line 12: payload.mass: this key is missing",
    ),
    (
        "effort_margin = 0.2",
        "effort_margin = 20",
        "task.toml: line 17: constraints.effort_margin: expected a share from 0 to below 1, got "
        "20.0, which looks like percent: 0.2",
    ),
    (
        "effort_margin = 0.2",
        "tool_speed = 250.0",
        "task.toml: line 17: constraints.tool_speed: 250 m/s looks like mm/s: expected at most "
        "50 m/s, 0.25 if it is mm/s",
    ),
    (
        "effort_margin = 0.2",
        'limits = ["torque"]',
        "task.toml: line 16: constraints: unknown constraint 'torque'; known: acceleration, "
        "clearance, deviation, effort, effort_rate, jerk, least_singular_value, longest_time, manipulability, "
        "mean_velocity, overshoot, peak_power, position, rms_torque, tool_height, "
        "tool_speed, torque_at_speed, velocity, via_error, winding_temperature; did you mean 'effort'?",
    ),
    (
        "[payload]",
        "[scene]\nclearance = 20.0\n[payload]",
        "task.toml: line 12: scene: expected obstacles or a self_clearance, got neither",
    ),
    (
        "[payload]",
        "[[moving]]\npoint = 1\njoints = 10.0\n[payload]",
        "task.toml: line 12: moving: joints: a half width of 10 rad at point 1 covers the whole "
        "range of 'shoulder', which looks like degrees: say so by angle = \"deg\" in a task, by "
        "[deg] in the header of a file, or convert them by np.radians in Python",
    ),
    (
        '"arm.urdf" }',
        '"arm.urdf", tool = "tcp" }',
        "task.toml: line 1: robot: unknown tool frame in arm.urdf 'tcp'; known: base, elbow, "
        "lower, mount, shoulder, tip, upper; did you mean 'tip'?",
    ),
    (
        '"arm.urdf" }',
        '"arm.urdf", lock = { elbw = 0.5 } }',
        "task.toml: line 1: robot: unknown joint to lock in arm.urdf 'elbw'; known: elbow, "
        "shoulder; did you mean 'elbow'?",
    ),
    (
        '"arm.urdf" }',
        '"arm.urdf", lock = { elbow = 90 } }',
        "task.toml: line 1: robot: arm.urdf: lock: 'elbow': 90 rad is outside its range -2 to 2 "
        "rad and looks like deg: positions of locked joints are in rad, here 1.5708",
    ),
    (
        "[0.3, 4.0]",
        "[4.0, 0.3]",
        "task.toml: line 3: duration_bounds: expected 0 < lower < upper [s], got 4.0 and 0.3",
    ),
    (
        "[0.3, 4.0]",
        "0.3",
        "task.toml: line 3: duration_bounds: expected a list, got 0.3",
    ),
    (
        "[limits]",
        "[limits",
        "task.toml: line 8, column 8: cannot be read as TOML: expected ] after the table's name, got [limits",
    ),
]

#: A file of points, and what is said.
IN_THE_POINTS = [
    (
        "shoulder;elbow\n0;0\n",
        "task.toml: line 2: points: points.csv: line 1: expected a column header with a unit "
        "such as 'shoulder [rad]' or 'shoulder [deg]', got 'shoulder'",
    ),
    (
        "shoulder [rad], elbw [rad]\n0, 0\n",
        "task.toml: line 2: points: points.csv: line 1: unknown column 'elbw [rad]'; known: "
        "elbow, shoulder; did you mean 'elbow'?",
    ),
    (
        "shoulder [rad], elbow [rad], time [s]\n0, 0, 0\n",
        "task.toml: line 2: points: points.csv: line 1: unknown column 'time [s]'; known: elbow, shoulder",
    ),
    (
        "0.0, 0.0\n0.5, 0.4\n",
        "task.toml: line 2: points: points.csv: line 1: expected a header with the name and unit "
        "of every column, such as 'shoulder [rad], elbow [rad]', got 0.0, 0.0",
    ),
    (
        "shoulder [rad], elbow [rad]\n0,0,0,1\n",
        "task.toml: line 2: points: points.csv: line 2: expected 2 numbers, separated by commas "
        "as in the header and with decimal points, got 4: 0, 0, 0, 1; with decimal commas, "
        "separate the columns by semicolons, also in the header",
    ),
    (
        "shoulder [dge], elbow [deg]\n0, 0\n",
        "task.toml: line 2: points: points.csv: line 1: expected a column header with a unit "
        "such as 'shoulder [deg]' or 'shoulder [mm]', got 'shoulder [dge]'; unknown unit 'dge'; "
        "did you mean 'deg'?",
    ),
    (
        "shoulder [rad], elbow [rad]\n0, 0\n45, 30\n",
        "task.toml: line 2: points: points.csv: point 1 puts 'shoulder' at 45 rad, outside its "
        'range -3 to 3 rad, which looks like degrees: say so by angle = "deg" in a task, by '
        "[deg] in the header of a file, or convert them by np.radians in Python",
    ),
    (
        "x [m], y [m], z [m], a [deg], b [deg], c [deg]\n0, 0, 0, 0, 0, 0\n",
        "task.toml: line 2: points: points.csv: line 1: unknown column 'a [deg]'; known: pitch, "
        "qw, qx, qy, qz, roll, rx, ry, rz, x, y, yaw, z",
    ),
    (
        "x [m], y [m], z [m], qx, qy, qz, qw\n0.5, 0, 0.4, 1, 0, 0, 1\n",
        "task.toml: line 2: points: points.csv: point 0: quaternion: expected x, y, z, w of norm "
        "1, got [1.0, 0.0, 0.0, 1.0] of norm 1.414",
    ),
    (
        "shoulder [rad], elbow [rad]\n0, \n",
        "task.toml: line 2: points: points.csv: line 2, column 'elbow': expected a finite number, got an empty cell",
    ),
]

#: What is written in MoveIt's joint limits, what is written instead, and what is said.
IN_THE_LIMITS = [
    (
        "elbow:",
        "elbw:",
        "joint_limits.yaml: line 3: unknown joint 'elbw'; known: elbow, shoulder; did you mean 'elbow'?",
    ),
    (
        "max_velocity: 1.5}",
        "max_speed: 1.5}",
        "joint_limits.yaml: line 2: shoulder: unknown key 'max_speed'; known: angle_wraparound, "
        "has_acceleration_limits, has_deceleration_limits, has_effort_limits, has_jerk_limits, "
        "has_position_limits, has_velocity_limits, max_acceleration, max_deceleration, "
        "max_effort, max_jerk, max_position, max_velocity, min_position; did you mean "
        "'max_velocity'?",
    ),
    (
        "max_velocity: 1.5}",
        "max_velocity: 86.0}",
        "joint_limits.yaml: line 2: shoulder: max_velocity: 86 rad/s looks like degrees: write "
        "!degrees 86, or !radians 86 if it is meant",
    ),
    (
        "max_velocity: 1.5}",
        "max_velocity: 1:30}",
        "joint_limits.yaml: line 2: expected a decimal number, got '1:30', which different "
        "programs read as different numbers",
    ),
    (
        "elbow:",
        "shoulder:",
        "joint_limits.yaml: line 3: 'shoulder' is given twice, first in line 2",
    ),
    (
        "joint_limits",
        "joint_limts",
        "joint_limits.yaml: expected a mapping 'joint_limits' from joints to limits, got the keys 'joint_limts'",
    ),
]

#: What is written in the URDF, what is written instead, and what is said.
IN_THE_URDF = [
    (
        'axis xyz="0 1 0"',
        'axis xyz="0 0 0"',
        "task.toml: line 1: robot: arm.urdf: joint 'shoulder': axis: expected a direction, got the zero vector '0 0 0'",
    ),
    (
        'lower="-3" upper="3"',
        'lower="3" upper="-3"',
        "task.toml: line 1: robot: arm.urdf: joint 'shoulder': position: lower must be below upper, got 3 and -3",
    ),
    (
        'child link="lower"',
        'child link="lowr"',
        "task.toml: line 1: robot: arm.urdf: joint 'elbow': child: expected a link of the file, "
        "got 'lowr'; did you mean 'lower'?",
    ),
    (
        'type="revolute"',
        'type="rotary"',
        "task.toml: line 1: robot: arm.urdf: joint 'shoulder': type: expected revolute, "
        "prismatic, continuous or fixed, got 'rotary'",
    ),
    (
        'velocity="2" ',
        "",
        "task.toml: line 1: robot: arm.urdf: joint 'shoulder': limit: expected a finite number as velocity, got none",
    ),
    (
        "</robot>",
        "</robt>",
        "task.toml: line 1: robot: arm.urdf: cannot be read as XML: mismatched tag: line 13, column 2",
    ),
    (
        'mass value="2"',
        'mass value="-2"',
        "task.toml: line 1: robot: arm.urdf: link 'upper': mass: expected a number from 0 on [kg], got -2.0",
    ),
    (
        'velocity="2"',
        'velocity="0"',
        "task.toml: line 1: robot: arm.urdf: joint 'shoulder': velocity: expected a positive "
        "limit, got 0: give it in robot.toml, in task.toml ([limits] velocity = ...), or as an "
        'argument (limits={"velocity": ...}); inf means no limit',
    ),
]

#: A command, and what is said.
ON_THE_COMMAND_LINE = [
    (
        "check taks.toml",
        "taks.toml: no such file; did you mean 'task.toml'?",
    ),
    (
        "check task",
        "task: no such problem or task; did you mean the file 'task.toml'?",
    ),
    (
        "solve nope",
        "unknown problem or task 'nope'; known: hybrid, hybrid_manipulator, panda_six_points, "
        "pick-place, pick_and_place_cell, pointing, reparam, ur5_base, ur5_order, ur5_pick_and_place, ur5_postures, "
        "ur5_tilt, via-points, which_robot, xarm7_obstacle",
    ),
    (
        "solve pointng",
        "unknown problem or task 'pointng'; known: hybrid, hybrid_manipulator, panda_six_points, "
        "pick-place, pick_and_place_cell, pointing, reparam, ur5_base, ur5_order, ur5_pick_and_place, "
        "ur5_postures, ur5_tilt, via-points, which_robot, xarm7_obstacle; did you mean 'pointing'?",
    ),
    (
        "check-robot ram.urdf",
        "ram.urdf: no such URDF file; did you mean 'arm.urdf'?",
    ),
    (
        "check-robot .",
        "robot: .: a folder without robot.toml; give the path of its file, 'arm.urdf'",
    ),
    (
        "solve pointing --set interpolant=smoth",
        "unknown interpolant 'smoth'; known: printed, quintic, septic_spline, smooth; did you mean 'smooth'?",
    ),
    (
        "export run --format cvs",
        "unknown export format 'cvs'; known: csv, fanuc, feed, gcode, json, krl, moveit, "
        "mujoco, netcdf, rapid, ros2, urscript; did you mean 'csv'?",
    ),
    (
        "study run stduy.toml",
        "stduy.toml: no such file",
    ),
]


def changed(folder, name, old, new):
    text = (folder / name).read_text(encoding="utf-8")
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.parametrize(("old", "new", "sentence"), IN_THE_TASK)
def test_in_a_task(folder, old, new, sentence):
    changed(folder, "task.toml", old, new)
    assert said(folder, "check", "task.toml") == sentence


@pytest.mark.parametrize(("text", "sentence"), IN_THE_POINTS)
def test_in_a_file_of_points(folder, text, sentence):
    (folder / "points.csv").write_text(text)
    changed(folder, "task.toml", "[[0.0, 0.0], [0.5, 0.4], [0.2, 0.1]]", '"points.csv"')
    assert said(folder, "check", "task.toml") == sentence


@pytest.mark.parametrize(("old", "new", "sentence"), IN_THE_LIMITS)
def test_in_the_limits_of_moveit(folder, monkeypatch, old, new, sentence):
    changed(folder, "joint_limits.yaml", old, new)
    monkeypatch.chdir(folder)
    with pytest.raises(TrajevoError) as caught:
        load_robot("arm.urdf", limits="joint_limits.yaml")
    assert str(caught.value) == sentence


@pytest.mark.parametrize(("old", "new", "sentence"), IN_THE_URDF)
def test_in_a_urdf(folder, old, new, sentence):
    changed(folder, "arm.urdf", old, new)
    assert said(folder, "check", "task.toml") == sentence


@pytest.mark.parametrize(("command", "sentence"), ON_THE_COMMAND_LINE)
def test_on_the_command_line(folder, command, sentence):
    assert said(folder, *command.split()) == sentence


def test_the_files_that_mistakes_are_made_in_are_right(folder):
    assert trajevo("check", "task.toml", cwd=folder).returncode == 0
    assert (load_robot(folder / "arm.urdf", limits={"acceleration": 9.0, "jerk": 99.0}).joint_names) == (
        "shoulder",
        "elbow",
    )


def test_no_sentence_speaks_of_what_trajevo_is_made_of():
    tables = (IN_THE_TASK, IN_THE_POINTS, IN_THE_LIMITS, IN_THE_URDF, ON_THE_COMMAND_LINE)
    sentences = [row[-1] for table in tables for row in table]
    assert len(sentences) >= 80
    for sentence in sentences:
        assert not re.search(
            r"pydantic|pymoo|pinocchio|coal|tomllib|yaml\.|Input should|Field required|Traceback", sentence
        )
