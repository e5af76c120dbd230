import re
import shutil

import numpy as np
import pytest

from trajevo import JointLimits, TrajevoError, load_robot
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.robot.locate import ROBOTS_FOLDER

SOURCE = ROBOTS_FOLDER / "pointing_mechanism"


@pytest.fixture
def folder(tmp_path):
    """A copy of the pointing mechanism that a test may break."""
    return shutil.copytree(SOURCE, tmp_path / "mine")


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


def test_limits_are_table_2_in_si():
    limits = load_robot("pointing_mechanism").limits
    np.testing.assert_allclose(limits.upper, np.radians([60, 70]))
    np.testing.assert_allclose(limits.lower, -np.radians([60, 70]))
    np.testing.assert_allclose(limits.velocity, np.radians([10, 10]))
    np.testing.assert_allclose(limits.acceleration, np.radians([15, 15]))
    np.testing.assert_allclose(limits.jerk, np.radians([80, 80]))
    assert np.isinf(limits.effort).all()


def test_a_folder_loads_like_a_name(folder):
    by_folder, by_name = load_robot(folder), load_robot("pointing_mechanism")
    np.testing.assert_array_equal(by_folder.limits.velocity, by_name.limits.velocity)
    assert by_folder.joint_names == by_name.joint_names == ("joint_1", "joint_2")


def test_unknown_robots_list_the_known():
    with pytest.raises(
        UnknownNameError,
        match="unknown robot 'pointing'; did you mean 'pointing_mechanism'",
    ):
        load_robot("pointing")


@pytest.mark.parametrize("name", [None, 3, b"pointing_mechanism", ["pointing_mechanism"]])
def test_what_is_neither_name_nor_path_is_refused(name):
    with pytest.raises(InvalidInputError, match=f"robot: expected a name or .*, got {re.escape(repr(name))}"):
        load_robot(name)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "velocity = { limit = 10.0,",
            "velocity = { limit = -10.0,",
            "joints.joint_1.velocity.limit: .*greater than 0, got -10",
        ),
        ("velocity = { limit = 10.0,", "velocity = { limit = 0.0,", "joints.joint_1.velocity.limit: .*greater than 0"),
        ("velocity = { limit = 10.0,", "velocity = { limit = nan,", "joints.joint_1.velocity.limit"),
        ("velocity = { limit = 10.0,", 'velocity = { limit = "fast",', "joints.joint_1.velocity.limit: .*got 'fast'"),
        ("velocity = { limit = 10.0,", "velocity = { limit = true,", "joints.joint_1.velocity.limit: .*got True"),
        ("velocity = { limit = 10.0,", 'velocity = { limit = "10",', "joints.joint_1.velocity.limit: .*got '10'"),
        ("lower = -60.0", 'lower = "-60.0"', "joints.joint_1.position.lower: .*got '-60.0'"),
        ("upper = 60.0", "upper = true", "joints.joint_1.position.upper: .*got True"),
        ('unit = "deg/s" }', 'unit = "m/s" }', "joint 'joint_1': velocity: unit 'm/s', expected .* to 'rad/s'"),
        ('unit = "deg/s" }', 'unit = "knots" }', "joint 'joint_1': velocity: unknown unit 'knots'"),
        ('unit = "N*m" }', 'unit = "N" }', "joint 'joint_1': effort: unit 'N', expected one that converts to 'N\\*m'"),
        (
            "lower = -60.0, upper = 60.0",
            "lower = 60.0, upper = -60.0",
            "joint 'joint_1': position: lower must be below upper, got 60 and -60 deg",
        ),
        ("lower = -60.0", "lower = nan", "joint 'joint_1': position: lower must be below upper, got nan and 60 deg"),
        ("upper = 70.0", "upper = nan", "joint 'joint_2': position: lower must be below upper, got -70 and nan deg"),
        ("upper = 70.0", "upper = -70.0", "joint 'joint_2': position: lower must be below upper, got -70 and -70 deg"),
        ("vector = [-9.80665,", "vector = [nan,", "gravity.vector: expected finite numbers, got .nan, 0.0, 0.0"),
        ("vector = [-9.80665,", "vector = [-inf,", "gravity.vector: expected finite numbers, got .-inf, 0.0, 0.0"),
        ("vector = [-9.80665,", 'vector = ["-9.8",', "gravity.vector.0: .*got '-9.8'"),
        ("vector = [-9.80665,", "vector = [false,", "gravity.vector.0: .*got False"),
        (
            'effort = { limit = inf, unit = "N*m" }',
            'effort = { limit = inf, unit = "N*m" }\ncoulomb_friction = { forward = 1.0, unit = "N*m" }',
            "joints.joint_1.coulomb_friction: .*expected either value, or forward and backward",
        ),
        (
            'effort = { limit = inf, unit = "N*m" }',
            'effort = { limit = inf, unit = "N*m" }\ncoulomb_friction = { value = -1.0, unit = "N*m" }',
            "joints.joint_1.coulomb_friction.value: .*greater than or equal to 0",
        ),
        ('jerk = { limit = 80.0, unit = "deg/s^3" }\n', "", "joints.joint_1.jerk: this key is missing$"),
        ("jerk = {", "jrek = {", "joints.joint_1"),
        (
            "[joints.joint_1]",
            "[joints.joint_9]",
            r"\[joints.joint_9\]: unknown joint 'joint_9'; known: ",
        ),
        ('tool = "tool"', 'tool = "gripper"', "unknown tool frame in .*'gripper'; known: .*platform"),
        ('urdf = "pointing_mechanism.urdf"', 'urdf = "none.urdf"', "no such URDF file"),
        ("format = 1", "format = 2", "format: .*got 2"),
        ("format = 1", "format = true", "format: .*got True"),
        ("format = 1", "format = ", "cannot be read as TOML"),
    ],
)
def test_a_broken_robot_toml_is_refused_with_file_and_place(folder, old, new, says):
    edit(folder / "robot.toml", old, new)
    with pytest.raises(TrajevoError, match=says) as caught:
        load_robot(folder)
    assert "\n" not in str(caught.value)
    assert str(folder) in str(caught.value)
    assert ".toml" in str(caught.value) or ".urdf" in str(caught.value)


def test_dry_friction_is_one_value_or_one_for_each_direction(folder):
    line = 'effort = { limit = inf, unit = "N*m" }'
    edit(folder / "robot.toml", line, line + '\ncoulomb_friction = { forward = 1.0, backward = 2.0, unit = "N*m" }')
    friction = load_robot(folder).friction
    np.testing.assert_array_equal(friction.coulomb[0], 1.0)
    np.testing.assert_array_equal(friction.coulomb_backward[0], 2.0)


def test_integers_will_do_for_numbers(folder):
    edit(folder / "robot.toml", "velocity = { limit = 10.0,", "velocity = { limit = 10,")
    edit(folder / "robot.toml", "lower = -60.0, upper = 60.0", "lower = -60, upper = inf")
    edit(folder / "robot.toml", "[-9.80665, 0.0, 0.0]", "[-10, 0, 0]")
    robot = load_robot(folder)
    np.testing.assert_allclose(robot.limits.velocity, np.radians([10, 10]))
    np.testing.assert_allclose(robot.limits.lower, np.radians([-60, -70]))
    assert np.isinf(robot.limits.upper[0])
    np.testing.assert_allclose(robot.model.gravity.linear, [-10.0, 0.0, 0.0])


MASS = '<mass value="2.0"/>'
TENSOR = 'ixx="0.004" ixy="0" ixz="0" iyy="0.017" iyz="0" izz="0.017"'
AXIS = '<axis xyz="0 0 1"/>'


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('type="revolute"', 'type="floating"', "joint 'joint_1' is a .*; expected revolute or prismatic"),
        ('type="revolute"', 'type="planar"', "joint 'joint_1' is a .*; expected revolute or prismatic"),
        ("</robot>", "", "cannot be read as XML: no element found"),
        ('encoding="', 'encoding="none-', "cannot be read as XML: unknown encoding"),
        ('<link name="frame">', '<link name="platform">', "link 'platform': expected a unique name, got 2 links"),
        (MASS, '<mass value="-2.0"/>', "link 'frame': mass: expected a number from 0 on .kg., got -2.0"),
        (MASS, '<mass value="nan"/>', "link 'frame': mass: expected a finite number as value, got 'nan'"),
        (MASS, '<mass value="inf"/>', "link 'frame': mass: expected a finite number as value, got 'inf'"),
        (MASS, '<mass value="1e999"/>', "link 'frame': mass: expected a finite number as value, got '1e999'"),
        (MASS, '<mass value="2.0 "/>', "link 'frame': mass: expected a finite number as value, got '2.0 '"),
        (MASS, '<mass value="2_0"/>', "link 'frame': mass: expected a finite number as value, got '2_0'"),
        (MASS, "<mass/>", "link 'frame': mass: expected a finite number as value, got none"),
        (MASS, "", "link 'frame': <inertial> has no <mass>"),
        (MASS, '<mass value="0"/>', "link 'frame': inertia: expected zeros for a link of mass 0, got .*0.004"),
        (f"<inertia {TENSOR}/>", "", "link 'frame': <inertial> has no <inertia>"),
        ('ixx="0.004"', 'ixx="nan"', "link 'frame': inertia: expected a finite number as ixx, got 'nan'"),
        ('ixx="0.004"', "", "link 'frame': inertia: expected a finite number as ixx, got none"),
        ('ixx="0.004"', 'ixx="-0.004"', "link 'frame': inertia: expected a positive definite tensor, got .*-0.004"),
        ('ixx="0.002"', 'ixx="0"', "link 'platform': inertia: expected a positive definite tensor, got .*0.0,"),
        ('ixy="0"', 'ixy="0.01"', "link 'frame': inertia: expected a positive definite tensor"),
        ('ixx="0.004"', 'ixx="0.04"', "link 'frame': inertia: .*triangle inequality.*0.04"),
        ('<origin xyz="0.15 0 0"', '<origin xyz="nan 0 0"', "link 'frame': inertial: origin: .*xyz, got 'nan 0 0'"),
        ('<origin xyz="0.15 0 0"', '<origin xyz="0.15 0"', "link 'frame': inertial: origin: .*xyz, got '0.15 0'"),
        ('<origin xyz="0.3 0 0"', '<origin xyz="0.3 0 inf"', "joint 'joint_2': origin: .*xyz, got '0.3 0 inf'"),
        ('rpy="-1.5707963267948966 0 0"', 'rpy="half 0 0"', "joint 'joint_2': origin: .*rpy, got 'half 0 0'"),
        (AXIS, '<axis xyz="0 0 0"/>', "joint 'joint_1': axis: expected a direction, got the zero vector '0 0 0'"),
        (AXIS, '<axis xyz="0 0 1e-200"/>', "joint 'joint_1': axis: expected a direction, got .*'0 0 1e-200'"),
        (AXIS, '<axis xyz="0 0 nan"/>', "joint 'joint_1': axis: expected three finite numbers as xyz, got '0 0 nan'"),
        (AXIS, "<axis/>", "joint 'joint_1': axis: expected three finite numbers as xyz, got None"),
        (
            AXIS,
            f'{AXIS}<mimic joint="joint_3"/>',
            "joint 'joint_1': mimic: expected a joint of the file, got 'joint_3'",
        ),
    ],
)
def test_a_urdf_that_cannot_be_planned_for_is_refused_with_file_and_place(folder, old, new, says):
    urdf = folder / "pointing_mechanism.urdf"
    edit(urdf, '<?xml version="1.0"?>', '<?xml version="1.0" encoding="utf-8"?>')
    edit(urdf, old, new)
    with pytest.raises(InvalidInputError, match=f"{re.escape(str(urdf))}: {says}") as caught:
        load_robot(folder)
    assert "\n" not in str(caught.value)


def test_a_urdf_without_a_movable_joint_is_refused(folder):
    urdf = folder / "pointing_mechanism.urdf"
    urdf.write_text(urdf.read_text().replace('type="revolute"', 'type="fixed"'))
    with pytest.raises(InvalidInputError, match=r"\.urdf: expected at least one movable joint, got 3 fixed ones"):
        load_robot(folder)


@pytest.mark.parametrize(
    "inertial",
    [
        "",
        '<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>',
    ],
)
def test_a_massless_carrier_is_allowed(folder, inertial):
    urdf = folder / "pointing_mechanism.urdf"
    urdf.write_text(re.sub("<inertial>.*?</inertial>", inertial, urdf.read_text(), count=1, flags=re.DOTALL))
    assert [body.mass for body in load_robot(folder).model.inertias] == [0.0, 0.0, 1.0]


def test_a_thin_plate_of_rounded_numbers_is_allowed(folder):
    edit(folder / "pointing_mechanism.urdf", TENSOR, TENSOR.replace('izz="0.017"', 'izz="0.021000001"'))
    np.testing.assert_allclose(np.diag(load_robot(folder).model.inertias[1].inertia), [0.004, 0.017, 0.021000001])


def test_pinocchio_reads_what_was_checked(folder):
    """A tab between two numbers is a space to XML, but makes Pinocchio's own reader drop the inertia."""
    edit(folder / "pointing_mechanism.urdf", 'xyz="0.15 0 0"', 'xyz="0.15\t0 0"')
    assert load_robot(folder).model.inertias[1].mass == 2.0


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("span = { value = 420.0", "span = { value = 0.0", "transmission.span: expected a positive length, got 0"),
        ("span = { value = 420.0", "span = { value = inf", "transmission.span.value: .*finite number"),
        ("span = { value = 420.0", 'span = { value = "420"', "transmission.span.value: .*got '420'"),
        ('unit = "mm" }\n\n[joints', 'unit = "deg" }\n\n[joints', "transmission.span: unit 'deg', expected"),
        (
            'slide = "slide"',
            'slide = "joint_4"',
            "transmission.slide: expected a joint of the URDF in m, got 'joint_4'",
        ),
        ('swivel = "swivel"', 'swivel = "turn"', "transmission.swivel: expected a joint .* in rad, got 'turn'"),
        ('["screw_1", "screw_2"]', '["screw_1", "screw_1"]', "transmission.screws: expected new names, got .*screw_1"),
        ('["screw_1", "screw_2"]', '["screw_1", "screw_3"]', "transmission.screws: expected new names, got .*screw_3"),
        ('["screw_1", "screw_2"]', '["screw_1"]', "transmission.screws"),
    ],
)
def test_a_broken_transmission_is_refused_with_file_and_place(tmp_path, old, new, says):
    folder = shutil.copytree(ROBOTS_FOLDER / "hybrid_manipulator", tmp_path / "mine")
    edit(folder / "robot.toml", old, new)
    with pytest.raises(InvalidInputError, match=f"{re.escape(str(folder / 'robot.toml'))}: line .*{says}"):
        load_robot(folder)


def test_a_prismatic_joint_is_in_metres(folder):
    edit(folder / "pointing_mechanism.urdf", 'name="joint_1" type="revolute"', 'name="joint_1" type="prismatic"')
    text = (folder / "robot.toml").read_text()
    first, second = text.split("[joints.joint_2]")
    first = re.sub(r'unit = "deg', 'unit = "mm', first).replace('unit = "N*m"', 'unit = "N"')
    (folder / "robot.toml").write_text(first + "[joints.joint_2]" + second)
    robot = load_robot(folder)
    assert robot.joint_units == ("m", "rad")
    np.testing.assert_allclose(robot.limits.velocity, [0.01, np.radians(10)])


def test_limits_are_checked_and_read_only():
    good = {name: np.ones(2) for name in ("upper", "velocity", "acceleration", "jerk", "effort")} | {
        "lower": -np.ones(2)
    }
    limits = JointLimits(**good)
    with pytest.raises(ValueError, match="read-only"):
        limits.velocity[0] = 3.0
    for change, says in (
        ({"velocity": np.ones(3)}, r"limits.velocity: expected shape \(2,\), got \(3,\)"),
        ({"jerk": np.array([1.0, np.nan])}, "limits.jerk: .*NaN"),
        ({"effort": np.array([1.0, 0.0])}, "limits.effort: expected positive"),
        ({"lower": np.array([0.0, 1.0])}, "lower must be below upper"),
    ):
        with pytest.raises(TrajevoError, match=says):
            JointLimits(**(good | change))
