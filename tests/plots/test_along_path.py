import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import limits_shown
from trajevo import GeometricPath, TrajevoError, optimise, plots
from trajevo.problems import HybridManipulator, PointingMechanism, TimeJerkReparameterisation
from trajevo.problems.gemini_and_s import gemini_points
from trajevo.solvers.gradient.normal_constraint import solve_nnc

mpl.use("Agg")


@pytest.fixture(scope="module")
def front():
    return solve_nnc(TimeJerkReparameterisation(limits="hull"), points=5)


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


def test_the_path_is_drawn_in_mm_with_its_polygon_and_speed(front):
    ax = plots.path(front.knee(), points=gemini_points())
    polygon, points = ax.lines[0].get_xydata(), ax.lines[1].get_xydata()
    np.testing.assert_allclose(polygon, 1e3 * front.problem.path.control_points)
    np.testing.assert_allclose(points, 1e3 * gemini_points())
    (line,) = ax.collections
    speed = line.get_array()
    assert speed.min() < 1.0
    t = np.linspace(0.0, float(front.knee().trajectory.duration[0]), 1000)
    expected = 1e3 * np.linalg.norm(front.knee().trajectory.evaluate(t, 1)[0], axis=1)
    assert speed.max() == pytest.approx(expected.max(), rel=1e-3)
    assert ax.get_xlabel() == "x [mm]"
    drawn = np.array(line.get_segments())[:, 0]
    np.testing.assert_allclose(drawn, 1e3 * front.knee().trajectory.evaluate(t)[0][:-1], atol=1e-9)


def test_the_parameter_runs_from_0_to_1(front):
    ax = plots.parameter({"fast": front.least("time"), "smooth": front.least("jerk")})
    for line, solution in zip(ax.lines, (front.least("time"), front.least("jerk")), strict=True):
        t, u = line.get_data()
        assert t[-1] == pytest.approx(solution.F["time"])
        assert (u[0], u[-1]) == pytest.approx((0.0, 1.0))
        assert (np.diff(u) >= 0.0).all()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["fast", "smooth"]
    assert plots.parameter(front.knee()).get_legend() is None


def test_fronts_are_drawn_together_in_mm(front):
    best = front.utopia()
    ax = plots.fronts({"hull": front, "again": front}, mark={"ω*": best})
    np.testing.assert_allclose(ax.lines[0].get_xydata(), front.F * [1.0, 1e6])
    np.testing.assert_allclose(ax.lines[2].get_xydata()[0], [best.F["time"], 1e6 * best.F["jerk"]])
    assert ax.get_ylabel() == "jerk [mm²/s⁵]"
    assert ax.get_yscale() == "log"


def test_profiles_show_bands_in_mm_and_leave_far_ends_out(front):
    panels = plots.profiles(front.knee())
    assert [panel.get_ylabel() for panel in panels] == [
        "position [mm]",
        "velocity [mm/s]",
        "acceleration [mm/s²]",
        "jerk [mm/s³]",
    ]
    assert limits_shown(panels[1]) == {-150.0, 150.0}
    assert limits_shown(panels[0]) == {-500.0, 500.0}
    low, high = panels[0].get_ylim()  # the stroke of 500 mm would squash an airfoil of 100 mm
    assert -200.0 < low < high < 200.0


def test_axes_are_used_where_given(front):
    ax = plt.subplots()[1]
    assert plots.parameter(front.knee(), ax=ax) is ax
    assert plots.fronts({"a": front}, ax=ax) is ax
    assert plots.path(front.knee(), ax=ax) is ax


def test_what_cannot_be_drawn_is_refused(front):
    other = optimise(PointingMechanism(), seed=1, generations=2, population=20, progress=False, polish=False)
    with pytest.raises(TrajevoError, match="trajectory: expected runs along a path, got PolynomialBatch"):
        plots.path(other.knee())
    with pytest.raises(TrajevoError, match="fronts: expected fronts of two objectives"):
        plots.fronts({"three objectives": other})
    with pytest.raises(TrajevoError, match="fronts: expected fronts"):
        plots.fronts({})
    with pytest.raises(TrajevoError, match="motion: expected a solution"):
        plots.path(3)
    joints = HybridManipulator().interpolant.points.positions
    wide = TimeJerkReparameterisation(
        path=GeometricPath.through(joints), robot="hybrid_manipulator", longest_time=100.0
    )
    with pytest.raises(TrajevoError, match="a picture in the plane needs 2 axes, the path has 5"):
        plots.path(wide.rollout(np.full((1, wide.n_var), 0.5)))
