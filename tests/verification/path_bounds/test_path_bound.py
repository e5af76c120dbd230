"""No time law along a path is faster: closed forms of straight lines, reachability, and every motion that is found."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog

from trajevo import GeometricPath, load_robot, path_bound
from trajevo.errors import InvalidInputError
from trajevo.problems import PointingMechanism, TimeJerkReparameterisation
from trajevo.verification.path_bounds.bound import PathQuestion, relaxation_of
from trajevo.verification.path_bounds.pointwise import least
from trajevo.verification.path_bounds.program import rounds
from trajevo.verification.path_bounds.relaxation import Multipliers

#: Length of a straight line [m].
LENGTH = 0.2


def line(**limits):
    """A straight line along one of two axes, at constant speed in u."""
    points = np.column_stack([np.linspace(0.0, LENGTH, 7), np.zeros(7)])
    path = GeometricPath.through(points, parameters="uniform", knots="uniform")
    given = {"velocity": 10.0, "acceleration": 1e3, "jerk": "inf"} | limits
    return TimeJerkReparameterisation(path=path, longest_time=30.0, **given)


def below(bound, exact, share):
    assert exact * (1.0 - share) < bound.least <= exact * (1.0 + 1e-9), (bound.least / exact, bound)


def test_least_time_of_a_line_under_acceleration():
    below(path_bound(line(acceleration=2.0), stations=60), 2.0 * np.sqrt(LENGTH / 2.0), 1e-2)


def test_least_time_of_a_line_under_velocity_too():
    below(path_bound(line(acceleration=2.0, velocity=0.3), stations=60), LENGTH / 0.3 + 0.3 / 2.0, 1e-2)


def test_least_time_of_a_line_under_jerk():
    """Bang-bang jerk in four phases, in closed form; relaxation and 60 stations lose 0.35 %, as measured."""
    below(path_bound(line(jerk=30.0), stations=60), 4.0 * np.cbrt(LENGTH / (2.0 * 30.0)), 1e-2)


def test_time_and_squared_jerk_of_a_line():
    """The least integral of the squared jerk in a time is 720 d² / T⁵, by the quintic."""
    weight = 1e-4
    time = (5.0 * weight * 720.0 * LENGTH**2) ** (1.0 / 6.0)
    below(path_bound(line(), square_jerk=weight, stations=60), 1.2 * time, 1e-2)


def test_time_and_squared_effort_of_a_line():
    """The least integral of the squared force of a mass is 12 m² d² / T³, by the cubic."""
    problem, weight = line(), 1e-4
    one = np.array([[1.0, 0.0]])
    mass = problem.dynamics.effort(0.0 * one, 0.0 * one, one)[0, 0]
    cost = weight * 12.0 * mass**2 * LENGTH**2
    time = (3.0 * cost) ** 0.25
    below(path_bound(problem, square_effort=weight, stations=60), time + cost / time**3, 3e-2)


@pytest.mark.parametrize(("path", "best"), [("gemini", 1.6297), ("s", 2.1810)])
def test_below_all_that_is_found_and_above_what_jerk_free_laws_need(path, best):
    """The best are of 200 control points, docs/papers/paing2021.md; jerk-free times by a pass forward and back."""
    problem = TimeJerkReparameterisation(path=path)
    bound = path_bound(problem, stations=60)
    free = path_bound(TimeJerkReparameterisation(path=path, jerk="inf"), stations=60)
    exact = reachable(problem)
    assert exact * 0.98 < free.least <= exact * (1.0 + 1e-3)
    assert max(free.least, 0.98 * best) < bound.least < best


def test_rises_with_stations():
    problem = TimeJerkReparameterisation()
    found = [path_bound(problem, stations=count).least for count in (15, 30, 60)]
    assert found == sorted(found)


def test_a_torque_limited_arm():
    """Below the fastest motion that the programs of the problem find, and near it."""
    points = np.radians([[0, 45, 0, 0, 45, 0], [20, 40, -10, 10, 40, 15], [45, 50, -15, 20, 30, 30]])
    points = np.concatenate(
        [points, np.radians([[60, 60, -20, 15, 20, 20], [50, 70, -10, 0, 30, 10], [30, 60, 0, -10, 40, 0]])]
    )
    problem = TimeJerkReparameterisation(path=points, robot="puma560", effort=True, jerk="inf", longest_time=20.0)
    bound = path_bound(problem, stations=40)
    found = problem.least_time().cost
    assert 0.9 * found < bound.least < found
    assert "effort" in bound.limited


def test_a_ur5_under_torque_limits_against_reachability():
    """Against controllable sets on dense stations (Pham and Pham 2018), each by a linear program of SciPy."""
    problem = ur5_path()
    bound, reached = path_bound(problem, stations=40), controllable(problem)
    assert {"velocity", "acceleration", "effort"} <= set(bound.limited)
    assert 0.97 * reached < bound.least < reached * (1.0 + 2e-3)


def ur5_path():
    """Six joints under torque limits, at accelerations that hardly bind."""
    points = np.radians(
        [
            [0, -90, 60, -60, -90, 0],
            [25, -75, 80, -80, -80, 20],
            [50, -60, 95, -100, -70, 40],
            [80, -70, 75, -90, -85, 30],
            [100, -90, 50, -60, -90, 0],
            [110, -100, 60, -50, -95, -20],
        ]
    )
    robot = load_robot("ur5", tool="tool0", limits={"acceleration": 100.0, "jerk": np.inf})
    return TimeJerkReparameterisation(path=points, robot=robot, effort=True, longest_time=20.0)


def controllable(problem, count=201):
    """Least time by the greatest squared speeds from which the end can be reached, then as fast as these allow."""
    s = np.linspace(0.0, 1.0, count)
    h, q, slope, bend = s[1], *(problem.path(s, order) for order in range(3))
    robot, none = problem.robot, np.zeros_like(q)
    model, data = robot.model, robot.model.createData()
    held = np.array([pin.rnea(model, data, *row) for row in zip(q, none, none, strict=True)])
    by_a = np.array([pin.rnea(model, data, *row) for row in zip(q, none, slope, strict=True)]) - held
    by_b = np.array([pin.rnea(model, data, *row) for row in zip(q, slope, bend, strict=True)]) - held
    limits, reach = robot.limits, 2.0 * h
    A = np.concatenate([by_a, -by_a, slope, -slope], axis=1)
    B = np.concatenate([by_b, -by_b, bend, -bend], axis=1)
    free = np.broadcast_to(limits.acceleration, q.shape)
    C = np.concatenate([limits.effort - held, limits.effort + held, free, free], axis=1)
    with np.errstate(divide="ignore"):
        most = ((limits.velocity / np.abs(slope)) ** 2).min(axis=1)
    b = np.zeros(count)
    for k in range(count - 2, -1, -1):  # next squared speed b + 2 h a from 0 to what is controllable there
        rows = np.column_stack([A[k], B[k]]), [[reach, 1.0], [-reach, -1.0]]
        limit = np.concatenate([C[k], [b[k + 1], 0.0]])
        b[k] = linprog([0.0, -1.0], np.concatenate(rows), limit, bounds=[(None, None), (0.0, most[k])]).x[1]
    b[0] = 0.0
    for k in range(count - 1):
        with np.errstate(divide="ignore", invalid="ignore"):
            a = np.where(A[k] > 0.0, (C[k] - B[k] * b[k]) / A[k], np.inf).min()
        b[k + 1] = min(b[k + 1], b[k] + reach * a)
    speed = np.sqrt(b)
    return float((2.0 * h / (speed[1:] + speed[:-1])).sum())


def test_any_multipliers_prove_a_bound():
    """Random ones, of any sign and size, stay below the known least; the zero ones prove that time is not negative."""
    relaxation = relaxation_of(PathQuestion.of(TimeJerkReparameterisation()), 20, 1.6, 0.0, 0.0)
    best = max((found for found in rounds(relaxation, 4)), key=lambda found: found.proven)
    generator = np.random.default_rng(1)
    for size in np.geomspace(1e-3, 1.0, 12):
        given = best.multipliers
        noisy = [part * (1.0 + size * generator.normal(size=part.shape)) for part in vars(given).values()]
        noisy[-1] = np.abs(noisy[-1])
        assert relaxation.proven(Multipliers(*noisy)) * 1.6 < 1.6297
    nothing = Multipliers(*(0.0 * part for part in vars(best.multipliers).values()))
    assert 0.0 <= relaxation.proven(nothing) < best.proven


def test_least_over_speeds_is_a_lower_bound():
    generator = np.random.default_rng(2)
    a, fastest = generator.uniform(0.0, 2.0, 400), generator.uniform(0.1, 5.0, 400)
    b, c = generator.normal(size=400), generator.normal(size=400)
    value, speed = least(a, b, c, fastest)
    z = fastest[:, None] * np.linspace(1e-4, 1.0, 20_001)
    dense = (a[:, None] / z + b[:, None] * z + c[:, None] * z**2).min(axis=1)
    assert (value <= dense + 1e-12).all()
    convex = c >= 0.0
    assert np.abs(value - dense)[convex].max() < 1e-3
    assert ((speed > 0.0) & (speed <= fastest)).all()


def reachable(problem, count=4001):
    """Least time without limits of jerk, by passes forward and back over squared speeds at dense stations."""
    s = np.linspace(0.0, 1.0, count)
    h, slope, bend = s[1], problem.path(s, 1), problem.path(s, 2)
    limits = problem.robot.limits
    most = ((limits.velocity / np.maximum(np.abs(slope), 1e-12)) ** 2).min(axis=1)

    def interval(k, b):
        middle, reach = -bend[k] * b / slope[k], limits.acceleration / np.abs(slope[k])
        return (middle - reach).max(), (middle + reach).min()

    # The greatest squared speed at which an acceleration along the path exists.
    for k in range(count):
        low, high = 0.0, most[k]
        if np.diff(interval(k, high))[0] < 0.0:
            for _ in range(50):
                b = 0.5 * (low + high)
                low, high = (b, high) if np.diff(interval(k, b))[0] >= 0.0 else (low, b)
            most[k] = low
    b = most.copy()
    b[0] = b[-1] = 0.0
    for k in range(count - 1, 0, -1):
        b[k - 1] = min(b[k - 1], b[k] - 2.0 * h * interval(k, b[k])[0])
    for k in range(count - 1):
        b[k + 1] = min(b[k + 1], b[k] + 2.0 * h * interval(k, b[k])[1])
    speed = np.sqrt(np.maximum(b, 0.0))
    return float((2.0 * h / (speed[1:] + speed[:-1])).sum())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"stations": 5}, "stations: expected a whole number from 10 to 5000, got 5"),
        ({"stations": 20.0}, "stations: expected a whole number"),
        ({"square_jerk": -1.0}, "square_jerk: expected a number from 0 on, got -1.0"),
        ({"square_effort": float("nan")}, "square_effort: expected a number from 0 on, got nan"),
    ],
)
def test_bad_input(options, said):
    with pytest.raises(InvalidInputError, match=said):
        path_bound(TimeJerkReparameterisation(), **options)


def test_other_problems_are_refused():
    with pytest.raises(InvalidInputError, match="problem: expected one along a fixed path"):
        path_bound(PointingMechanism())
