"""Robots to choose from, however they are listed, and the sentence about each mistake."""

import shutil

import pytest

from tests.helpers import refused
from tests.study.robots.test_choose import LIMITS, POSES, UR5, XARM7, Z1, task
from tests.test_mistakes import URDF
from trajevo import choose_robot, load_robot
from trajevo.study.robots.ability import abilities
from trajevo.study.robots.asked import asked_of
from trajevo.study.robots.catalogue import candidates_of

CATALOGUE = """\
format = 1

[[robot]]
name = "UR5 of the old cell"
path = "ur5"
tool = "tool0"
price = "9500.50 CHF"
mass = "18400 g"
reach = "850 mm"
limits = { acceleration = "800 deg/s^2", jerk = inf }

[[robot]]
name = "small arm"
path = "arm.urdf"
limits = { acceleration = [10.0, 12.0], jerk = 100.0 }
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "catalogue.toml").write_text(CATALOGUE, encoding="utf-8")
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    return tmp_path


def test_a_catalogue_is_a_folder_or_its_file(folder):
    for given in (folder, str(folder / "catalogue.toml")):
        old, small = candidates_of(given, folder=folder)
        assert (old.name, old.price, old.currency, old.reach) == ("UR5 of the old cell", 9500.5, "CHF", 0.85)
        assert old.mass == pytest.approx(18.4)
        limits = {"acceleration": "800 deg/s^2", "jerk": "inf"}
        assert old.robot == {"name": "ur5", "tool": "tool0", "limits": limits}
        assert (small.robot["name"], small.price, small.mass) == (str(folder / "arm.urdf"), None, None)
    (folder / "catalogue.toml").unlink()
    shutil.copytree(load_robot("puma560").source, folder / "puma")
    assert [one.name for one in candidates_of(str(folder), folder=folder)] == ["arm", "puma"]


def test_names_files_robots_and_tables_may_be_mixed(folder):
    loaded = load_robot("ur5", tool="tool0", limits={"acceleration": 8.0, "jerk": float("inf")})
    found = candidates_of([loaded, "xarm7", folder / "arm.urdf", {"name": "z", "path": "z1"}], folder=folder)
    assert [one.name for one in found] == ["ur5", "xarm7", "arm", "z"]
    assert found[0].robot == {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 8.0, "jerk": "inf"}}
    assert found[3].robot == {"name": "z1"}


def test_a_name_of_the_task_means_its_own_robot():
    asked = asked_of(task(), ["xarm7", "ur10"])
    assert [one.price for one in asked.candidates] == [11000.0, 32000.0]
    other = asked_of(task(objectives=["time"]), ["xarm7", {"name": "another", "path": "ur10", "tool": "tool0"}])
    assert [one.price for one in other.candidates] == [11000.0, None]


def test_a_catalogue_is_named_in_a_task_relative_to_it(folder):
    (folder / "arms").mkdir()
    for name in ("catalogue.toml", "arm.urdf"):
        shutil.move(folder / name, folder / "arms" / name)
    text = 'robots = "arms"\npoints = [{ position = [0.5, 0.0, 0.4] }, { position = [0.6, 0.0, 0.4] }]\n'
    (folder / "task.toml").write_text(f"{text}duration_bounds = [0.3, 2.0]\n", encoding="utf-8")
    asked = asked_of(folder / "task.toml")
    assert [one.name for one in asked.candidates] == ["UR5 of the old cell", "small arm"]
    found = abilities(asked)
    assert [bool(one.problem) for one in found] == [True, True]
    assert found[1].problem.robot.joint_names == ("shoulder", "elbow")


MISTAKES = {
    "an empty list": (task(robots=[]), "robots: expected at least one robot to choose from, got an empty list"),
    "an unknown robot": (
        task(robots=["ur6"], objectives=["time"]),
        "robots: ur6: unknown robot 'ur6'; did you mean 'ur5'",
    ),
    "one twice": (task(robots=[UR5, UR5]), "robots: the robot 'ur5' is given twice; give each a name of its own"),
    "capitals": (task(robots=[UR5, UR5 | {"name": "UR5", "path": "ur5"}]), "the robot 'ur5' is given twice"),
    "no limits": (
        task(robots=[UR5, XARM7], limits=None),
        "robots: ur5: its files have no acceleration and no jerk limits: give them as limits = "
        r"\{ acceleration = ..., jerk = ... \} of this robot, or for all robots in \[limits\]; inf means no limit",
    ),
    "a misspelt key": (task(robots=[UR5 | {"prise": 3}]), "robots.0.prise: unknown key; .*did you mean 'price'"),
    "a misspelt tool": (task(robots=[UR5 | {"tool": "tool9"}]), "robots: ur5: unknown tool frame"),
    "a price without a number": (
        task(robots=[UR5 | {"price": "cheap"}]),
        "ur5: price: expected an amount and its currency",
    ),
    "a negative price": (task(robots=[UR5 | {"price": -3.0}]), "ur5: price: expected an amount"),
    "a mass in metres": (task(robots=[UR5 | {"mass": "3 m"}]), "ur5: mass: .*kg"),
    "a reach in millimetres": (
        task(robots=[UR5 | {"reach": 850}]),
        "ur5: reach: 850 m looks like mm: expected at most 20 m, 0.85 if it is mm",
    ),
    "a mass in grams": (task(robots=[UR5 | {"mass": 18400}]), "ur5: mass: 18400 kg looks like g: .*, 18.4 if it is g"),
    "an objective of nothing": (
        task(objectives=["time", "prices"]),
        "unknown objective 'prices'; did you mean 'price'",
    ),
    "an objective of motions": (task(objectives=["enregy"]), "unknown objective 'enregy'; did you mean 'energy'"),
    "no text": (task(robots=""), "robots: expected a list of robots, or a folder with catalogue.toml, got ''"),
    "no mass at all": (task(robots=[UR5 | {"mass": 0.0}]), r"ur5: mass: expected a positive number \[kg\], got 0"),
    "a price of some": (
        task(robots=[UR5, {"name": "xarm7"}]),
        'objectives: expected a price of every robot, got none of xarm7; .*price = "24000 EUR"',
    ),
    "two currencies": (
        task(robots=[UR5, XARM7 | {"price": "9000 USD"}]),
        "objectives: price needs one currency for all robots, got EUR and USD",
    ),
    "a price alone": (task(objectives=["price"]), "objectives: expected one of the motion beside price, such as time"),
    "joints": (
        task(points=[POSES[0], [0.0] * 6, POSES[2]]),
        "points: point 1: joint positions belong to the joints of one robot; expected a tool pose",
    ),
    "joints in a table": (task(points=[{"joints": [0.0] * 6}, POSES[2]]), "points: point 0: joint positions belong"),
    "a box of joints": (task(moving=[{"point": 1, "joints": 0.1}]), "moving: point 1: joints belong .*expected tool"),
    "a velocity": (
        task(passing=[{"point": 1, "velocity": [0.1] * 6}]),
        "passing: point 1: velocities of joints belong to the joints of one robot",
    ),
    "limits of each joint": (
        task(limits={"acceleration": [10.0] * 6, "jerk": 100.0}),
        "limits.acceleration: limits of single joints belong to one robot; expected one for all joints",
    ),
    "limits by name": (
        task(limits={"velocity": {"shoulder_pan_joint": 1.0}}),
        "limits.velocity: limits of single joints",
    ),
    "one robot": (
        task(robots=None, robot={"name": "ur5"}),
        "robot: expected robots to choose from, got a task for one",
    ),
    "both": (task(robot={"name": "ur5"}), "robot: expected a robot, or robots to choose from, got both"),
    "no folder": (task(robots="arms"), r"robots: .*arms: no such folder.*one robot is written as a list, \['arms'\]"),
    "a mistake of the task": (task(duration_bounds=[2.0, 1.0]), "ur5: duration_bounds"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_in_one_sentence(name):
    given, says = MISTAKES[name]
    refused(lambda: choose_robot(given, progress=False), says)


def test_files_and_robots_that_are_no_robots(folder):
    refused(lambda: candidates_of("nothing", folder=folder), "robots: expected a list of robots, or a folder with")
    refused(lambda: candidates_of({"name": "ur5"}, folder=folder), "robots: expected a list of robots or the path of a")
    (folder / "empty").mkdir()
    refused(lambda: candidates_of("empty", folder=folder), "empty: expected catalogue.toml, folders with robot.toml")
    text = (folder / "catalogue.toml").read_text(encoding="utf-8").replace("mass =", "mas =")
    (folder / "catalogue.toml").write_text(text, encoding="utf-8")
    refused(lambda: candidates_of(folder, folder=folder), "catalogue.toml: line 8: robot.0.mas: unknown key; .*'mass'")
    refused(lambda: choose_robot(3), "task: expected a file, a name or the keys of a task, got int")


def test_a_file_of_joint_positions_is_refused_and_one_of_poses_is_not(folder):
    (folder / "joints.csv").write_text("a [rad], b [rad]\n0, 0\n1, 1\n", encoding="utf-8")
    (folder / "poses.csv").write_text("x [mm], y [mm], z [mm]\n300, 0, 400\n400, 0, 400\n", encoding="utf-8")
    refused(
        lambda: asked_of(task(points=str(folder / "joints.csv"))),
        "joints.csv: joint positions belong to the joints of one robot; expected tool poses, columns x, y, z",
    )
    far = asked_of(task(points=str(folder / "poses.csv"), robots=[UR5, Z1]))
    assert [one.stopped_by for one in abilities(far)] == ["", ""]


def test_a_task_for_several_robots_is_no_problem_of_its_own():
    from trajevo import load_task

    refused(lambda: load_task("which_robot"), r"which_robot.toml: line \d+: robots: expected one robot to plan for")


def test_units_that_differ_cannot_be_compared():
    gantry = {"name": "gantry", "joints": ["x", "y", "z"], "kind": "prismatic"}
    three = [{"position": [0.3, 0.0, 0.4]}, {"position": [0.4, 0.0, 0.4]}]
    given = task(points=three, payload=None, limits=LIMITS, robots=[UR5, gantry], objectives=["time", "jerk"])
    with pytest.raises(ValueError, match="gantry|jerk"):
        choose_robot(given, progress=False)
