"""Logs of joints: what is read, in which units, and what is refused."""

import numpy as np
import pytest

from trajevo import TrajevoError, export, load_robot, optimise
from trajevo.problems import ViaPointProblem
from trajevo.trajectory.joint_log import JointLog, read_joint_log

ROBOT = load_robot("ur5", limits={"acceleration": np.inf, "jerk": np.inf}, tool="tool0")


def written(tmp_path, headers, rows, name="log.csv"):
    file = tmp_path / name
    file.write_text("\n".join([", ".join(headers), *(", ".join(f"{x:.17g}" for x in row) for row in rows)]))
    return file


def headers(unit="deg", more=("effort [N*m]",)):
    positions = [f"{name} position [{unit}]" for name in ROBOT.joint_names]
    return ["time [ms]", *positions, *(f"{name} {one}" for one in more for name in ROBOT.joint_names)]


def test_a_table_is_read_in_si_and_in_any_order(tmp_path):
    rng = np.random.default_rng(1)
    rows = rng.uniform(-90.0, 90.0, (12, 13))
    rows[:, 0] = np.arange(12) * 4.0
    order = rng.permutation(13)
    log = read_joint_log(written(tmp_path, [headers()[k] for k in order], rows[:, order]), ROBOT)
    np.testing.assert_allclose(log.time, 0.004 * np.arange(12))
    np.testing.assert_allclose(log.position, np.radians(rows[:, 1:7]))
    np.testing.assert_array_equal(log.effort, rows[:, 7:])
    assert np.isnan(log.current).all()
    assert len(log) == 12


def test_currents_of_some_joints_and_columns_of_the_whole_robot(tmp_path):
    rows = np.random.default_rng(2).uniform(-1.0, 1.0, (9, 9))
    rows[:, 0] = np.arange(9)
    names = [*headers(more=())[:7], "elbow_joint current [A]", "supply [A]"]
    log = read_joint_log(written(tmp_path, names, rows), ROBOT, further={"supply": "A", "brake": "A"})
    np.testing.assert_array_equal(log.current[:, 2], rows[:, 7])
    assert np.isnan(np.delete(log.current, 2, axis=1)).all()
    assert list(log.further) == ["supply"]
    np.testing.assert_array_equal(log.further["supply"], rows[:, 8])


def test_a_quantity_before_the_name_of_its_joint_is_refused_with_what_is_near(tmp_path):
    rows = np.random.default_rng(4).uniform(-1.0, 1.0, (9, 13))
    rows[:, 0] = np.arange(9)
    joints = ROBOT.joint_names
    names = ["time [s]", *(f"{name} position [rad]" for name in joints), *(f"current_{name} [A]" for name in joints)]
    with pytest.raises(TrajevoError, match=rf"unknown column 'current_{joints[0]} \[A\]'; did you mean '{joints[0]} "):
        read_joint_log(written(tmp_path, names, rows), ROBOT)


def test_arrays_are_the_same_log_as_the_table(tmp_path):
    rows = np.random.default_rng(3).uniform(-1.0, 1.0, (10, 13))
    rows[:, 0] = np.arange(10)
    table = read_joint_log(written(tmp_path, headers("rad"), rows), ROBOT)
    given = {"time": table.time, "position": table.position, "effort": table.effort}
    log = JointLog.of(given, ROBOT)
    for name in ("time", "position", "effort", "current"):
        np.testing.assert_array_equal(getattr(log, name), getattr(table, name))
    assert JointLog.of(log, ROBOT) is log
    assert not log.position.flags.writeable


def test_an_exported_motion_is_read_back(tmp_path):
    problem = ViaPointProblem(
        robot=ROBOT, points=[[0.0] * 6, [0.5] * 6, [1.0, 0.0] * 3], objectives=["time"], constraints=["velocity"]
    )
    solution = optimise(problem, population=8, generations=2, polish=False, seed=1).pick("0")
    export(solution, tmp_path / "motion.csv", format="csv", angle="deg")
    log = read_joint_log(tmp_path / "motion.csv", ROBOT)
    rollout = solution.rollout
    np.testing.assert_allclose(log.position, rollout.trajectory.evaluate(log.time, 0)[0], atol=1e-12)
    assert np.isfinite(log.effort).all()


@pytest.mark.parametrize(
    ("names", "rows", "said"),
    [
        ([*headers()[:-1], "elbow_joint torqe [N*m]"], 13, "elbow_joint torque"),
        (headers()[1:], 12, "time \\[s\\]"),
        (["time", *headers()[1:]], 13, "unit such as"),
        (["time [s]", "shoulder_pan_joint position [N]", *headers()[2:]], 13, "unit such as"),
        ([*headers(), "elbow_joint torque [N*m]"], 14, "two"),
    ],
)
def test_other_columns_are_refused_by_name(tmp_path, names, rows, said):
    table = np.arange(10.0 * rows).reshape(10, rows)
    with pytest.raises(TrajevoError, match=said):
        read_joint_log(written(tmp_path, names, table), ROBOT)


def test_instants_that_do_not_ascend_and_short_logs_are_refused():
    time, position = np.arange(9.0), np.zeros((9, 6))
    with pytest.raises(TrajevoError, match="at least 8 instants, got 5"):
        JointLog.of({"time": time[:5], "position": position[:5]}, ROBOT)
    with pytest.raises(TrajevoError, match="instants that ascend, got 3 s after 3 s"):
        JointLog.of({"time": [0, 1, 2, 3, 3, 4, 5, 6, 7], "position": position}, ROBOT)
    with pytest.raises(TrajevoError, match="expected a file, or a mapping"):
        JointLog.of(3.0, ROBOT)
    with pytest.raises(TrajevoError, match="torques too"):
        JointLog.of({"time": time, "position": position, "torques": position}, ROBOT)
    with pytest.raises(TrajevoError, match="shape \\(9, 6\\)"):
        JointLog.of({"time": time, "position": position.T}, ROBOT)
