import matplotlib.pyplot as plt
import numpy as np
import pytest

from problems import PointingMechanism
from tests.helpers import impossible, small_problem
from tests.reference import TABLE_4_DURATIONS
from trajevo import TrajevoError, load_robot, optimise, plots

SMALL = {"seed": 1, "generations": 8, "population": 20, "progress": False}


@pytest.fixture(scope="module")
def front():
    return optimise(PointingMechanism(), **SMALL)


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


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
        dashed = {round(float(line.get_ydata()[0]), 9) for line in panel.lines if line.get_linestyle() == "--"}
        assert dashed == {limit, -limit}
    dots = [line for line in panels[0].lines if line.get_marker() == "o"]
    assert [len(line.get_xdata()) for line in dots] == [5, 5]


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
    empty = optimise(small_problem(constraints=(impossible(load_robot("pointing_mechanism"), 0.1),)), **SMALL)
    for draw in (plots.front, plots.front_3d, plots.parallel_coordinates):
        with pytest.raises(TrajevoError, match="the front is empty and cannot be drawn: .*patience"):
            draw(empty)
    with pytest.raises(TrajevoError, match="at least 3 objectives, the front has 2"):
        plots.front_3d(optimise(small_problem(), **SMALL))
