import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import impossible, limits_shown, small_problem
from tests.reference import TABLE_4_DURATIONS
from trajevo import TrajevoError, load_robot, optimise, plots
from trajevo.capacity.dlcc import dlcc, dlcc_iterative
from trajevo.capacity.payload_time import PayloadCurve
from trajevo.problems import HybridManipulator, PointingMechanism
from trajevo.problems.hybrid_kinematics import saddle_line
from trajevo.problems.hybrid_manipulator import paper_solution

SMALL = {"seed": 1, "generations": 8, "population": 20, "progress": False}


@pytest.fixture(scope="module")
def front():
    return optimise(PointingMechanism(), **SMALL, polish=False)


def test_front_draws_every_pair_with_units_and_the_mark(front):
    panels = plots.front(front, mark=front.knee())
    assert [(p.get_xlabel(), p.get_ylabel()) for p in panels] == [
        ("time [s]", "acceleration [deg/s²]"),
        ("time [s]", "jerk [deg/s³]"),
        ("acceleration [deg/s²]", "jerk [deg/s³]"),
    ]
    points = panels[0].collections[0].get_offsets()
    np.testing.assert_allclose(points, np.column_stack([front.F[:, 0], np.degrees(front.F[:, 1])]))
    marked = panels[0].lines[0].get_xydata()[0]
    np.testing.assert_allclose(marked, [front.knee().F["time"], np.degrees(front.knee().F["acceleration"])])


def test_angle_decides_the_unit(front):
    assert plots.front(front, angle="rad")[0].get_ylabel() == "acceleration [rad/s²]"
    assert plots.profiles(front.knee(), angle="rad")[1].get_ylabel() == "velocity [rad/s]"
    with pytest.raises(TrajevoError, match="unknown angle unit 'gon'"):
        plots.front(front, angle="gon")


def test_given_axes_are_used(front):
    axes = plt.subplots(1, 3)[1]
    assert plots.front(front, axes=axes)[2] is axes[2]
    one = plt.subplots()[1]
    assert plots.hypervolume(front, ax=one) is one
    assert plots.parallel_coordinates(front, ax=one) is one
    space = plt.figure().add_subplot(projection="3d")
    assert plots.front_3d(front, ax=space) is space
    with pytest.raises(TrajevoError, match="axes: expected 3, got 2"):
        plots.front(front, axes=axes[:2])


def test_profiles_stay_inside_their_limit_lines(front):
    panels = plots.profiles(front.knee())
    for panel, limit in zip(panels[1:], (10.0, 15.0, 80.0), strict=True):
        curves = [line.get_ydata() for line in panel.lines if len(line.get_ydata()) > 2]
        assert len(curves) == 2
        assert all(np.abs(curve).max() <= limit for curve in curves)
        assert limits_shown(panel) == {limit, -limit}
    dots = [line for line in panels[0].lines if line.get_marker() == "o"]
    assert [len(line.get_xdata()) for line in dots] == [5, 5]
    via = np.degrees(front.problem.interpolant.points.positions)
    for joint, line in enumerate(dots):
        np.testing.assert_allclose(line.get_ydata(), via[:, joint], atol=1e-9)
        np.testing.assert_allclose(line.get_xdata(), np.concatenate([[0.0], np.cumsum(front.knee().x)]))


def test_the_tool_path_marks_the_via_points(front):
    via, _ = front.problem.robot.tool_poses(front.problem.interpolant.points.positions)
    ax = plots.tool_path(front.knee())
    marked = next(line for line in ax.lines if line.get_label() == "via points")
    np.testing.assert_allclose(np.array(marked.get_data_3d()).T, via[1:-1], atol=1e-9)


def test_metres_and_radians_are_shown_as_shares_of_their_limits():
    problem = HybridManipulator()
    panels = plots.profiles(problem.rollout(paper_solution()))
    peaks = problem.decode(paper_solution()).peak(1)[0] / problem.robot.limits.velocity
    drawn = [np.abs(line.get_ydata()).max() for line in panels[1].lines if len(line.get_ydata()) > 2]
    np.testing.assert_allclose(drawn, peaks, rtol=1e-3)
    assert panels[1].get_ylabel() == "velocity / limit"


def test_load_plots_show_the_binding_joint_and_the_masses():
    rollout = HybridManipulator().rollout(paper_solution())
    ax = plots.effort_utilisation(rollout)
    assert [line.get_label() for line in ax.lines[:5]] == list(rollout.robot.joint_names)
    assert np.abs(ax.lines[2].get_ydata()).max() == pytest.approx(480.81 / 500.0, abs=2e-3)
    assert ax.get_title(loc="left").split("; ")[0] == "screw_3 binds at 11.88 kg"
    assert np.abs(
        plots.effort_utilisation(rollout, mass=dlcc(rollout).mass).lines[2].get_ydata()
    ).max() == pytest.approx(1.0)
    iterated = dlcc_iterative(rollout, step=1.0)
    ax = plots.dlcc_iteration(iterated)
    np.testing.assert_allclose(ax.lines[0].get_xdata(), np.arange(13.0))
    curve = PayloadCurve(np.array([0.0, 10.0]), np.array([2.3, 2.5]), np.zeros((2, 12)), "rigid")
    np.testing.assert_array_equal(plots.payload_curve(curve).lines[0].get_xdata(), [2.3, 2.5])
    ax = plots.tracking_error(np.array([0.0, 1.0, 2.0]), np.array([0.0, 3e-4, 1e-4]))
    assert ax.get_legend().get_texts()[0].get_text() == "greatest 0.3000 mm"
    path = plots.tool_path(rollout)
    plots.desired_path(saddle_line(np.arange(11)), ax=path)
    assert path.lines[-1].get_label() == "desired"


def test_load_plots_refuse_what_they_cannot_draw(front):
    with pytest.raises(TrajevoError, match="has no effort limits"):
        plots.effort_utilisation(front.knee())
    with pytest.raises(TrajevoError, match="pass that of dlcc_iterative"):
        plots.dlcc_iteration(dlcc(HybridManipulator().rollout(paper_solution())))
    with pytest.raises(TrajevoError, match="mark: expected a Solution"):
        plots.front(front, mark=[front.knee()])
    with pytest.raises(TrajevoError, match="mark 'a': expected shape"):
        plots.front(front, mark={"a": [1.0]})


def test_a_rollout_is_drawn_like_a_solution(front):
    problem = PointingMechanism(interpolant="printed")
    rollout = problem.rollout(TABLE_4_DURATIONS)
    panels = plots.profiles(rollout, angle="deg", via_times=problem.interpolant.via_times(TABLE_4_DURATIONS)[0])
    assert np.abs(panels[1].lines[0].get_ydata()).max() > 10.0
    assert plots.tool_path(rollout).get_zlabel() == "z [m]"


def test_several_points_can_be_marked(front):
    table_4 = front.problem.evaluate(TABLE_4_DURATIONS)[0][0]
    ax = plots.front_3d(front, mark={"knee": front.knee(), "Table 4": table_4})
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["knee", "Table 4"]
    plots.parallel_coordinates(front, mark={"Table 4": table_4})


def test_hypervolume_is_drawn_by_generation(front):
    np.testing.assert_array_equal(plots.hypervolume(front).lines[0].get_xdata(), np.arange(1, 9))


def test_what_cannot_be_drawn_is_refused():
    empty = optimise(
        small_problem(constraints=(impossible(load_robot("pointing_mechanism"), 0.1),)), **SMALL, polish=False
    )
    for draw in (plots.front, plots.front_3d, plots.parallel_coordinates):
        with pytest.raises(TrajevoError, match="the front is empty and cannot be drawn: .*patience"):
            draw(empty)
    with pytest.raises(TrajevoError, match="at least 3 objectives, the front has 2"):
        plots.front_3d(optimise(small_problem(), **SMALL, polish=False))
