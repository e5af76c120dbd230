"""No effort, energy or capacity out of a model whose links have no mass, unless that is meant."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from tests.helpers import trajevo
from trajevo import Front, Robot, ViaPointProblem, dlcc, load_robot, optimise
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.formulation.objectives import OBJECTIVES
from trajevo.robot.examine import examine
from trajevo.robot.joints import Friction, JointLimits
from trajevo.robot.locate import list_robots
from trajevo.robot.masses import LEAST_MASS
from trajevo.robot.payload import Payload
from trajevo.robot.transmission import Direct

HEAVY = {
    "l1": '<mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/>',
    "l2": '<mass value="1"/><inertia ixx="0.005" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>',
}
ZERO = '<mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>'
UNIT = '<mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
TINY = '<mass value="1e-9"/><inertia ixx="1e-9" ixy="0" ixz="0" iyy="1e-9" iyz="0" izz="1.5e-9"/>'
POINTS = [[0.0, 0.0], [0.5, 0.4], [0.2, 0.1]]
LIMITS = {"acceleration": 10.0, "jerk": 100.0}
NEED_MASSES = sorted(name for name, objective in OBJECTIVES.items() if "masses" in objective.needs)


def urdf(folder, l1="", l2="", *, tcp=""):
    def link(name, content):
        inertial = f'<inertial><origin xyz="0.15 0 0"/>{content}</inertial>' if content else ""
        return f'<link name="{name}">{inertial}</link>'

    file = folder / "two.urdf"
    file.write_text(
        f"""<robot name="two"><link name="base"/>{link("l1", l1)}{link("l2", l2)}{link("tcp", tcp)}
<joint name="a" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="60"/></joint>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="30"/></joint>
<joint name="t" type="fixed"><parent link="l2"/><child link="tcp"/><origin xyz="0.3 0 0"/></joint></robot>""",
        encoding="utf-8",
    )
    return file


def rollout(robot, payload=0.0) -> Rollout:
    problem = ViaPointProblem(robot=robot, points=POINTS)
    moving = problem.rollout(0.5 * (problem.xl + problem.xu))
    return Rollout(Dynamics(moving.robot, Payload(payload)), moving.trajectory)


@pytest.mark.parametrize(
    ("inertials", "links", "says"),
    [
        ({}, ("l1", "l2", "tcp"), "l1, which 'a' moves; l2, tcp, which 'b' moves"),
        ({"l1": HEAVY["l1"]}, ("l2", "tcp"), "l2, tcp, which 'b' moves"),
        ({"l1": HEAVY["l1"], "l2": ZERO}, ("l2", "tcp"), "l2, tcp, which 'b' moves"),
        ({"l2": HEAVY["l2"]}, ("l1",), "l1, which 'a' moves"),
    ],
)
def test_links_without_mass_are_found_and_efforts_refused(tmp_path, inertials, links, says):
    robot = load_robot(urdf(tmp_path, **inertials), limits=LIMITS)
    assert robot.massless == links
    assert not robot.gives_effort
    found = rollout(robot)
    for compute in (lambda: found.effort, lambda: found.power, lambda: found.unloaded_effort, lambda: dlcc(found)):
        with pytest.raises(InvalidInputError, match=f"robot 'two': effort needs masses, .*: {says}; .*allow_massless"):
            compute()
    with pytest.raises(InvalidInputError, match=says):
        _ = rollout(robot, payload=1.0).effort


def test_a_link_fixed_to_a_heavy_one_needs_no_mass(tmp_path):
    assert load_robot(urdf(tmp_path, **HEAVY), limits=LIMITS).massless == ()
    on_tool = urdf(tmp_path, l1=HEAVY["l1"], tcp=HEAVY["l2"])
    assert load_robot(on_tool, limits=LIMITS).massless == ()
    locked = load_robot(urdf(tmp_path, l1=HEAVY["l1"]), lock={"b": 0.2}, limits=LIMITS)
    assert locked.massless == ()  # l2 is part of l1 then
    assert locked.gives_effort


def test_masses_that_are_meant_to_be_missing_are_left_out(tmp_path):
    file = urdf(tmp_path, l1=HEAVY["l1"])
    robot = load_robot(file, limits=LIMITS, allow_massless=True)
    assert robot.mass_notes == ("links l2, tcp: no mass in the model; efforts leave them out",)
    assert robot.settings["allow_massless"] is True
    found = rollout(robot)
    data = robot.model.createData()
    by_pinocchio = pin.rnea(robot.model, data, *(np.array(x[0, 3]) for x in (found.q, found.v, found.a)))
    np.testing.assert_allclose(found.effort[0, 3], by_pinocchio, atol=1e-12)
    assert dlcc(found).mass > dlcc(rollout(load_robot(urdf(tmp_path, **HEAVY), limits=LIMITS))).mass
    with pytest.raises(InvalidInputError, match="allow_massless: expected True or False, got 1"):
        load_robot(file, limits=LIMITS, allow_massless=1)


@pytest.mark.parametrize("objective", NEED_MASSES)
def test_objectives_that_need_masses_are_refused_at_once(tmp_path, objective):
    drive = {"gear_ratio": 100.0, "torque_constant": 0.1, "winding_resistance": 0.5, "continuous_torque": 50.0}
    drive |= {"thermal_resistance": 1.5, "thermal_time_constant": 900.0, "greatest_rise": 80.0}
    robot = {"name": urdf(tmp_path, l1=HEAVY["l1"]), "limits": LIMITS, "drives": {"a": drive, "b": drive}}
    unused = objective == "unused_payload"
    arguments = {
        "points": POINTS,
        "objectives": ("time", objective),
        "constraints": ("velocity", "effort") if unused else ("velocity",),
        "payload_range": (0.0, 1.0) if unused else None,
    }
    with pytest.raises(InvalidInputError, match="needs masses, .*: l2, tcp, which 'b' moves"):
        ViaPointProblem(robot=robot, **arguments)
    made = ViaPointProblem(robot=robot | {"allow_massless": True}, **arguments)
    assert np.isfinite(made.evaluate(0.5 * (made.xl + made.xu)[None])[0]).all()


def test_every_objective_of_effort_is_known_to_need_masses():
    assert set(NEED_MASSES) == {
        "energy", "electrical_energy", "square_power", "square_effort", "square_effort_rate", "effort_ratio",
        "peak_effort_rate", "unused_payload", "rms_torque_share", "winding_rise", "peak_power",
    }  # fmt: skip


def test_a_limit_of_effort_is_refused_and_one_that_is_infinite_is_none(tmp_path):
    file = urdf(tmp_path)
    limited = {"points": POINTS, "constraints": ("velocity", "effort")}
    with pytest.raises(InvalidInputError, match="a limit of effort needs masses"):
        ViaPointProblem(robot={"name": file, "limits": LIMITS}, **limited)
    free = ViaPointProblem(robot={"name": file, "limits": LIMITS | {"effort": np.inf}}, **limited)
    assert free.evaluate(free.xl[None])[1].shape == (1, 2)
    assert optimise(free, seed=1, generations=2, population=8, progress=False, polish=False).run.failures == 0


def test_kinematic_problems_need_no_masses(tmp_path):
    names = [name for name in OBJECTIVES if name not in NEED_MASSES]
    problem = ViaPointProblem(
        robot={"name": urdf(tmp_path, l1=HEAVY["l1"]), "limits": LIMITS},
        points=POINTS,
        objectives=names,
        constraints=("position", "velocity", "acceleration", "jerk", "mean_velocity"),
        tool_height=-2.0,
    )
    front = optimise(problem, seed=1, generations=4, population=12, progress=False, polish=False)
    assert len(front)
    assert not front.run.failures
    front.save(tmp_path / "front.json")
    back = Front.load(tmp_path / "front.json")
    assert back.knee().F == front.knee().F
    assert back.problem.robot.mass_notes == ("effort: not covered, links l2, tcp have no mass in the model",)
    with pytest.raises(InvalidInputError, match="needs masses"):
        dlcc(back.knee())


def test_robots_made_of_a_model_are_checked_too():
    model = pin.Model()
    model.name = "made"
    first = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "first")
    second = model.addJoint(first, pin.JointModelRY(), pin.SE3(np.eye(3), np.array([0.4, 0.0, 0.0])), "second")
    model.appendBodyToJoint(first, pin.Inertia(1.0, np.zeros(3), np.eye(3) * 0.01), pin.SE3.Identity())
    model.addFrame(pin.Frame("tool", second, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    ones = np.ones(2)
    robot = Robot(
        "made", model, Direct(), JointLimits(-ones, ones, ones, ones, ones, ones), Friction(*np.zeros((3, 2))),
        ("first", "second"), ("rad", "rad"), "tool", None, "", None,
    )  # fmt: skip
    assert robot.massless == ("body of second",)
    with pytest.raises(InvalidInputError, match="energy needs masses, .*: body of second, which 'second' moves"):
        robot.check_masses("energy")
    replace(robot, allow_massless=True).check_masses("energy")
    model.appendBodyToJoint(second, pin.Inertia(0.0, np.zeros(3), np.eye(3) * 0.01), pin.SE3.Identity())
    assert replace(robot).massless == ()  # a moment of inertia without mass is what the maker gave it


@pytest.mark.parametrize("name", list_robots())
def test_robots_that_come_with_trajevo_give_efforts(name):
    robot = load_robot(name)
    robot.check_masses("effort")
    assert bool(robot.massless) == (name in ("puma560", "hybrid_manipulator"))
    assert not any("placeholder" in note for note in robot.mass_notes)


# --- placeholders


@pytest.mark.parametrize(
    ("inertials", "says"),
    [
        ({"l1": UNIT, "l2": UNIT}, "links l1, l2, tcp: 1 kg with 1 kg·m² about every axis"),
        ({"l1": HEAVY["l1"], "l2": UNIT}, "links l2, tcp: 1 kg with 1 kg·m² about every axis"),
        ({"l1": HEAVY["l1"], "l2": TINY}, f"links l2, tcp: less than {LEAST_MASS:g} kg"),
        ({"l1": UNIT.replace('"1"', '"0.1"'), "l2": UNIT.replace('"1"', '"0.1"')}, "0.1 kg with 0.1 kg·m² about every"),
        (HEAVY, None),
    ],
)
def test_placeholders_are_told_and_not_refused(tmp_path, inertials, says):
    file = urdf(tmp_path, **inertials)
    robot = load_robot(file, limits=LIMITS)
    warned = [sentence for sentence in examine(file).warnings if "inertias look like placeholders" in sentence]
    assert robot.gives_effort
    assert np.isfinite(dlcc(rollout(robot)).mass)
    if says is None:
        assert not robot.mass_notes
        assert not warned
    else:
        assert says in robot.mass_notes[0]
        assert says in warned[0]
        assert warned[0].startswith(f"{file}: ")


@pytest.mark.parametrize("name", ["ur5", "ur10", "xarm7", "z1", "kinova", "bravo7_no_ee", "panda", "allegro_left_hand"])
def test_no_robot_of_a_maker_is_taken_for_placeholders(name):
    assert not [said for said in examine(name).warnings if "inertias look like" in said or "without mass" in said]


# --- command line


TASK = """format = 1
points = [[0, 0], [0.5, 0.4], [0.2, 0.1]]
duration_bounds = [0.3, 4.0]
objectives = ["time", "OBJECTIVE"]
[robot]
name = "two.urdf"
EXTRA
[limits]
acceleration = 10.0
jerk = 100.0
[constraints]
limits = ["position", "velocity", "acceleration", "jerk"]
[algorithm]
population = 12
generations = 4
"""


def solved(folder, objective, extra=""):
    task = folder / "task.toml"
    task.write_text(TASK.replace("OBJECTIVE", objective).replace("EXTRA", extra), encoding="utf-8")
    return trajevo("solve", task, "--out", folder / "run", "--report", "none", "--no-pictures", "--quiet")


def unwrapped(text):
    return " ".join(text.split())


def test_a_task_says_in_its_robot_table_that_missing_masses_are_meant(tmp_path):
    urdf(tmp_path, l1=HEAVY["l1"])
    refused = solved(tmp_path, "energy")
    assert refused.returncode == 2
    assert "energy needs masses, but these links have none in the model: l2, tcp, which 'b' moves" in refused.stderr
    done = solved(tmp_path, "energy", "allow_massless = true")
    note = "links l2, tcp: no mass in the model; efforts leave them out"
    assert done.returncode == 0, done.stderr
    assert note in unwrapped(done.stdout)
    assert note in unwrapped(trajevo("show", tmp_path / "run").stdout)
    assert f"note: {note}" in unwrapped(trajevo("capacity", tmp_path / "run").stdout)


def test_a_kinematic_task_tells_that_effort_is_not_covered(tmp_path):
    urdf(tmp_path)
    done = solved(tmp_path, "jerk")
    assert done.returncode == 0, done.stderr
    assert "effort: not covered, links l1, l2, tcp have no mass in the model" in unwrapped(done.stdout)
    capacity = trajevo("capacity", tmp_path / "run")
    assert capacity.returncode == 2
    assert "effort needs masses" in capacity.stderr


def test_check_robot_and_workspace_take_the_flag(tmp_path):
    file = urdf(tmp_path, l1=HEAVY["l1"])
    said = "joint 'b' moves a body without mass: l2, tcp; "
    assert f"{said}so efforts are refused, unless allow_massless is set" in trajevo("check-robot", file).stdout
    assert f"{said}as is meant: efforts leave them out" in trajevo("check-robot", file, "--allow-massless").stdout
    asked = ("workspace-capacity", file, "--position", "0.4", "0", "0.5", "--cells", "3", "--out", tmp_path / "x.png")
    assert "effort needs masses" in trajevo(*asked).stderr
    done = trajevo(*asked, "--allow-massless")
    assert done.returncode == 0, done.stderr
    assert "note: links l2, tcp: no mass in the model" in done.stdout


def test_robot_toml_says_that_missing_masses_are_meant():
    assert load_robot("puma560").allow_massless
    assert any("as is meant" in sentence for sentence in examine("puma560").warnings)
    with pytest.raises(InvalidInputError, match="link_1, which 'joint_1' moves"):
        load_robot("puma560", allow_massless=False).check_masses("effort")
