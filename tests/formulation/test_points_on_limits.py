"""Points on a joint's limit: the joint rests there, a search finds as much as without the limit, and it is told."""

import json

import numpy as np
import pytest

from tests.helpers import mostly_long, suited, trajevo
from trajevo import CartesianBox, Front, JointBox, ViaPointProblem, ViaPoints, certify, load_robot, optimise
from trajevo.formulation.moving_points import MovingPoints
from trajevo.solvers.gradient import refinement, sqp
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS, THROUGH_POINTS, price_of_rest

LIFT = """
<robot name="lift">
  <link name="base"/>
  <link name="carriage"><inertial><mass value="5"/>
    <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="0 0 1"/>
    <limit lower="LOWER" upper="0.8" velocity="0.3" effort="400"/></joint>
  <joint name="swing" type="revolute"><parent link="carriage"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="2" effort="40"/></joint>
</robot>
"""
#: The second point is at the lower stop of the lift.
POINTS = [[0.4, 0.0], [0.0, 0.6], [0.2, 1.0]]
SMALL = {"population": 24, "generations": 20, "progress": False}


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    """The problem of a lift with its lower stop at a given height."""
    folder = tmp_path_factory.mktemp("lift")

    def problem(stop=0.0, jerk=(20.0, 100.0), **given):
        file = folder / f"lift_{stop:g}.urdf"
        file.write_text(LIFT.replace("LOWER", f"{stop:g}"), encoding="utf-8")
        robot = load_robot(file, limits={"acceleration": [1.0, 8.0], "jerk": jerk})
        usual = {"points": POINTS, "objectives": ("time", "energy"), "duration_bounds": (0.05, 4.0)}
        return ViaPointProblem(robot=robot, **(usual | given))

    return problem


@pytest.fixture(scope="module")
def usual(lift):
    """The front of the first seed."""
    return optimise(lift(), seed=1, **SMALL)


@pytest.mark.parametrize("others", mostly_long([(2,), (2, 3)], (2,)), ids=str)
def test_every_seed_finds_the_same_least_time_and_a_wide_front(lift, usual, others):
    fronts = [usual, *(optimise(lift(), seed=seed, **SMALL) for seed in others)]
    free = optimise(lift(stop=-1.0), seed=1, **SMALL)
    least = [front.F[:, 0].min() for front in fronts]
    assert np.ptp(least) < 1e-8 * min(least)
    assert max(least) <= free.F[:, 0].min()
    assert max(least) == pytest.approx(3.51252, rel=1e-5), "4.1 to 4.3 s with the velocity at the stop left open"
    for front in fronts:
        assert np.ptp(front.F[:, 0]) >= np.ptp(free.F[:, 0])
        fastest = front.pick("0")
        assert certify(fastest).proven
        assert fastest.trajectory.extremes(0)[0][0, 0] >= -1e-12


RESTING = sorted(name for name in THROUGH_POINTS if price_of_rest(name) is not None)
PLACES = {
    "two in a row": [[0.4, 0.0], [0.0, 0.6], [0.0, 0.8], [0.2, 1.0]],
    "two apart": [[0.4, 0.0], [0.0, 0.6], [0.3, 0.3], [0.0, 0.8], [0.2, 1.0]],
    "ends too": [[0.0, 0.0], [0.0, 0.6], [0.2, 1.0], [0.0, 0.4]],
}
SEVERAL = pytest.mark.parametrize("place", mostly_long(PLACES, "two in a row"))


# To polish B-splines, whose variables are many, takes up to half a minute.
@pytest.mark.parametrize("interpolant", mostly_long(RESTING, "quintic_spline"))
@SEVERAL
def test_several_points_on_the_limit(lift, place, interpolant):
    given = {"points": PLACES[place], "objectives": ("time", "energy")}
    smooth = getattr(NAMED_INTERPOLANTS.find(interpolant), "continuous", 2) > 1  # others' jerk is infinite somewhere
    front = optimise(lift(jerk=(20.0, 100.0) if smooth else np.inf, **suited(interpolant, given)), seed=1, **SMALL)
    assert len(front) > 5, front.blocking
    assert certify(front.pick("0")).proven


@SEVERAL
def test_several_points_on_the_limit_without_polish(lift, place):
    front = optimise(lift(points=PLACES[place], interpolant="bspline"), seed=1, polish=False, **SMALL)
    assert len(front) > 5, front.blocking
    assert certify(front.pick("0")).proven


@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 0.0], [0.3, 0.6], [0.2, 1.0]],
        pytest.param([[0.4, 0.0], [0.3, 0.6], [0.8, 1.0]], marks=pytest.mark.long),
    ],
)
def test_ends_on_a_limit_are_no_trap_and_need_no_note(lift, points):
    problem = lift(points=points)
    assert problem.notes == ()
    found = optimise(problem, seed=1, **SMALL)
    free = optimise(lift(stop=-1.0, points=points), seed=1, **SMALL)
    assert found.F[:, 0].min() == pytest.approx(free.F[:, 0].min(), rel=1e-8)


def test_the_margins_of_gradient_solvers_are_kept_where_a_joint_touches_its_limit(lift):
    problem = lift().in_terms()
    G = problem.evaluate(np.array([[2.5, 2.5]]), return_values_of=["F", "G"])[1]
    assert G.max() < -max(refinement._MARGIN, sqp.MARGIN)


def test_a_joint_that_stays_on_its_limit(lift):
    front = optimise(lift(points=[[0.0, 0.0], [0.0, 0.6], [0.0, 1.0]]), seed=1, **SMALL)
    assert len(front), front.blocking
    np.testing.assert_array_equal(front.rollouts.trajectory.extremes(0)[0][:, 0], 0.0)


def test_a_point_a_little_off_its_limit_counts_as_on_it(lift):
    near = [[0.4, 0.0], [1e-6, 0.6], [0.2, 1.0]]
    assert len(lift(points=near).notes) == 1
    assert lift(points=[[0.4, 0.0], [1e-3, 0.6], [0.2, 1.0]]).notes == ()


def test_the_note_names_point_joint_limit_and_price(lift):
    assert lift().notes == (
        "point 1 lies on the lower limit of 'lift', 0 m: the joint is at rest there, "
        "and its fourth derivative may jump there",
    )
    assert lift(stop=-1.0).notes == ()
    (both,) = lift(points=[[0.4, 0.0], [0.3, 2.0], [0.2, 1.0]]).notes
    assert both.startswith("point 1 lies on the upper limit of 'swing', 2 rad")


def test_interpolants_without_rests_say_so(lift):
    (note,) = lift(interpolant="polynomial").notes
    assert "'polynomial' cannot stop the joint there" in note
    assert note.endswith("move the point off its limit or choose another interpolant")
    (note,) = lift(interpolant="linear_blends").notes
    assert note.endswith("lines with blends miss the point and stay within the limit")
    assert len(optimise(lift(interpolant="linear_blends"), seed=1, **SMALL)) > 5


def test_without_position_limits_nothing_rests(lift):
    problem = lift(constraints=("velocity", "acceleration", "jerk"))
    assert problem.notes == ()
    assert problem.interpolant.at_rest == ()


def test_no_bit_changes_while_no_point_lies_on_a_limit(lift):
    problem = lift(stop=-1.0)
    x = np.array([[1.3, 2.1]])
    plain = THROUGH_POINTS["quintic_spline"](ViaPoints(np.array(POINTS)), duration_bounds=(0.05, 4.0))
    np.testing.assert_array_equal(problem.decode(x).coefficients, plain(x).coefficients)
    lower, upper = problem.decode(x).extremes(0)
    np.testing.assert_array_equal(
        problem.constraints[0].function(problem.rollout(x)),
        np.maximum(upper - [0.8, 2.0], [-1.0, -2.0] - lower) / [0.9, 2.0],
    )


def test_settings_make_an_equal_problem(usual, tmp_path):
    front = usual
    again = ViaPointProblem(**json.loads(json.dumps(front.problem.settings)))
    np.testing.assert_array_equal(again.evaluate(front.X, return_values_of=["F"]), front.F)
    front.save(tmp_path / "front.json")
    assert Front.load(tmp_path / "front.json").problem.notes == front.problem.notes


@pytest.mark.parametrize("generations", mostly_long([6, 20], 6))
def test_a_point_that_may_move_away_from_the_limit_does_not_rest(lift, generations):
    for box in (JointBox(1, [0.05, 0.0]), CartesianBox(1, [0.0, 0.0, 0.05], keep_orientation=False)):
        problem = lift(moving=[box])
        assert problem.notes == ()
        front = optimise(problem, seed=1, **SMALL | {"generations": generations})
        assert len(front) > 5, front.blocking
        assert certify(front.pick("0")).proven


def test_a_point_that_moves_along_the_limit_rests(lift, usual):
    problem = lift(moving=[JointBox(1, [0.0, 0.2])])
    assert len(problem.notes) == 1
    front = optimise(problem, seed=1, **SMALL)
    assert len(front) > 5, front.blocking
    assert front.F[:, 0].min() <= usual.F[:, 0].min() * (1.0 + 1e-6)


@pytest.mark.parametrize("interpolant", sorted(name for name in THROUGH_POINTS if price_of_rest(name) is not None))
def test_moved_points_are_those_of_the_interpolant_itself(interpolant, lift):
    robot = lift(stop=-1.0).robot
    points = ViaPoints(np.array([[0.4, 0.0], [0.1, 0.6], [0.3, 0.1], [0.2, 1.0]]))
    bounds, rests = (0.05, 4.0), ((1, 1), (2, 0))
    moving = MovingPoints(
        interpolant,
        points,
        (JointBox(1, [0.1, 0.1]), JointBox(2, [0.1, 0.1])),
        robot=robot,
        duration_bounds=bounds,
        at_rest=rests,
    )
    times = len(moving.variables) - 4
    x = np.hstack([np.random.default_rng(0).uniform(0.5, 2.0, (1, times)), [[0.05, -0.03, 0.02, 0.07]]])
    moved = points.positions.copy()
    moved[1:3] += x[0, times:].reshape(2, 2)
    plain = THROUGH_POINTS[interpolant](ViaPoints(moved), duration_bounds=bounds, at_rest=rests)
    expected = plain(x[:, :times]).coefficients
    np.testing.assert_allclose(moving(x).coefficients, expected, atol=1e-10 * np.abs(expected).max())


def test_a_tool_at_its_least_height_is_told(lift):
    (note,) = lift(stop=-1.0, points=[[0.4, 0.0], [0.1, 0.6], [0.2, 1.0]], tool_height=0.1).notes
    assert note.startswith("point 1 has the tool at its least height, 0.1 m")
    assert lift(stop=-1.0, tool_height=-0.2).notes == ()


def test_solve_prints_the_note(lift, tmp_path):
    lift()
    urdf = lift().robot.urdf
    task = tmp_path / "task.toml"
    task.write_text(
        f"""robot = "{urdf}"
points = {POINTS}
duration_bounds = [0.05, 4.0]
objectives = ["time", "energy"]

[limits]
acceleration = [1.0, 8.0]
jerk = [20.0, 100.0]

[algorithm]
population = 12
generations = 2
""",
        encoding="utf-8",
    )
    ran = trajevo("solve", task, "--out", tmp_path / "run", "--quiet", "--report", "none", "--no-pictures")
    assert ran.returncode == 0, ran.stderr
    assert "note: point 1 lies on the lower limit of 'lift', 0 m: the joint is at rest there" in ran.stderr
