"""Payload against time: curves by optimisation against the reference, fronts, the largest payload of any motion."""

from dataclasses import replace

import numpy as np
import pytest

from tests.capacity.test_dlcc import with_effort
from tests.guo2016 import GUO2016, TABLE_7
from tests.helpers import mostly_long
from trajevo import optimise, plots
from trajevo.capacity import payload_time
from trajevo.capacity.dlcc import dlcc
from trajevo.capacity.payload_time import capacity_front, largest_payload, least_times, max_payload_problem
from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.motion_limits import time_limit
from trajevo.formulation.objectives import objectives_of
from trajevo.formulation.problem import TrajectoryProblem, Weights
from trajevo.problems import HybridManipulator, PointingMechanism, ViaPointProblem
from trajevo.robot.payload import Payload
from trajevo.solvers.gradient.normal_constraint import solve_nnc
from trajevo.solvers.gradient.weighted_sum import minimise_weighted


def assert_rising(problem, curve, masses):
    assert curve.payloads.tolist() == masses
    assert curve.payload_model == problem.dynamics.payload.model
    assert np.isfinite(curve.times).all()
    assert (np.diff(curve.times) >= 0.0).all()
    for mass, time, x in zip(curve.payloads, curve.times, curve.X, strict=True):
        F, G = problem.with_payload(problem.dynamics.payload.with_mass(float(mass))).evaluate(x[None])[:2]
        assert F[0, 0] == pytest.approx(time, rel=1e-9)
        assert G.max() <= 1e-6


def test_least_time_grows_with_the_payload():
    """With forces at the ends of the intervals alone, to be quick; a little faster than with those between."""
    problem = HybridManipulator(samples=2)
    curve = capacity_front(problem, [10.0, 0.0, 5.0], seed=1, starts=1)
    assert_rising(problem, curve, [0.0, 5.0, 10.0])
    assert curve.times[-1] == pytest.approx(GUO2016["least_time"]["rigid"], rel=0.01)
    assert curve.times[0] == pytest.approx(GUO2016["least_time"]["none"], rel=0.01)


def test_capacity_front_keeps_the_model():
    problem = HybridManipulator(payload_model="weight_only", samples=2)
    curve = capacity_front(problem, [10.0], seed=1, starts=1)
    assert_rising(problem, curve, [10.0])
    assert curve.times[0] == pytest.approx(GUO2016["least_time"]["weight_only"], rel=0.01)


@pytest.mark.parametrize("bad", [[], [float("nan")], "ten", [[1.0, 2.0]], [-1.0], [50.0]], ids=str)
def test_bad_payloads_of_a_curve_are_refused(bad):
    with pytest.raises(InvalidInputError, match="payload"):
        capacity_front(HybridManipulator(), bad, seed=1)


@pytest.mark.parametrize(
    ("model", "masses", "starts"),
    [
        ("rigid", [0.0, 10.0], 1),
        *(pytest.param(model, [0.0, 5.0, 10.0], 4, marks=pytest.mark.long) for model in ("rigid", "weight_only")),
    ],
)
def test_payload_time_curve(model, masses, starts):
    problem = HybridManipulator(payload_model=model)
    curve = capacity_front(problem, masses, seed=3, starts=starts)
    assert_rising(problem, curve, masses)
    assert curve.times[0] == pytest.approx(GUO2016["least_time"]["none"], rel=1e-3)
    assert curve.times[-1] == pytest.approx(GUO2016["least_time"][model], rel=1e-3)


#: Section 5 of the reference, weight only: time [s] -> largest payload [kg]; at 2.5 s with everything at 12 instants.
KNOWN = {3.0: 12.009, 4.0: 12.331, 6.19: 12.452}
STATIC_BOUND = 12.510810648896424
#: The least time [s] of payloads [kg] on the curve.
TIMES = {10.86: 2.50048, 12.0: 2.98904, 12.32: 3.92144, 12.44: 5.70362}
SOME = ([3.0], [10.86, 12.0])
WIDE = {"payload_model": "weight_only", "payload_bounds": (0.0, 13.0), "duration_bounds": (0.002, 3.0)}


@pytest.mark.parametrize(("instants", "payloads"), mostly_long([SOME, (list(KNOWN), list(TIMES))], SOME, several=True))
def test_the_payload_time_curve_of_the_reference(instants, payloads):
    """At 2.5 s 10.8543 kg, 0.15 % below the 10.870 kg that limits at 12 instants alone allow, see the next test."""
    problem, masses = HybridManipulator(**WIDE), []
    for time, known in ((time, KNOWN[time]) for time in instants):
        found = largest_payload(problem, within=time, seed=1, starts=2)
        assert 0.999 * known < found.mass < known * 1.0001
        assert found.time == pytest.approx(time, rel=1e-4)
        assert found.at_rest == pytest.approx(STATIC_BOUND, rel=1e-12)
        assert dlcc(found.rollout).mass == pytest.approx(found.mass, rel=1e-3)
        masses.append(found.mass)
    fast = largest_payload(problem, within=2.5, seed=1, starts=2)
    assert fast.mass == pytest.approx(10.85425, abs=2e-5)
    assert (np.diff([fast.mass, *masses, STATIC_BOUND]) > 0.0).all()
    curve = capacity_front(problem, payloads, seed=1, starts=1)
    assert_rising(problem, curve, payloads)
    assert curve.times == pytest.approx([TIMES[mass] for mass in payloads], abs=2e-5)
    assert (curve.times <= [2.5005, *instants]).all()


def at_instants(values, limit):
    return (values * np.sign(values.real) / limit - 1.0).reshape(len(values), -1)


def test_the_10_86_kg_of_the_reference_at_2_5_s_break_a_velocity_limit_between_its_instants():
    """Velocity and force at 12 evenly spaced instants of every interval, as the reference had them, allow 10.870 kg."""
    problem, shares = HybridManipulator(**(WIDE | {"duration_bounds": (0.001, 6.0)})), np.linspace(0.0, 1.0, 12)
    robot = problem.robot

    def velocities(rollout):
        return at_instants(rollout.trajectory.at_shares(shares, 1), robot.limits.velocity)

    def forces(rollout):
        states = (rollout.trajectory.at_shares(shares, order) for order in range(3))
        return at_instants(rollout.effort_in(*states), robot.limits.effort)

    loaded = max_payload_problem(problem, objectives=())
    kept = [one for one in loaded.constraints if not one.names[0].startswith(("velocity", "effort"))]
    middle = loaded.rollout(0.5 * (loaded.xl + loaded.xu))
    sampled = [
        Constraint(tuple(f"{name} {k}" for k in range(function(middle).shape[1])), "test", function)
        for name, function in (("velocity at instants", velocities), ("force at instants", forces))
    ]
    coarse = TrajectoryProblem(
        dynamics=loaded.dynamics,
        interpolant=loaded.interpolant,
        objectives=loaded.objectives,
        constraints=(*kept, *sampled, time_limit(2.5)),
        payload_range=loaded.payload_range,
    )
    best = minimise_weighted(coarse, Weights((1.0,)), seed=1, starts=2)
    assert best.x[-1] == pytest.approx(10.870, abs=1e-3)
    broken = loaded.evaluate(best.x[None])[1]
    assert broken.max() > 5e-4


@pytest.mark.parametrize("samples", mostly_long([2, None], 2))
def test_a_problem_without_effort_limits_has_no_largest_payload(samples):
    hybrid = HybridManipulator() if samples is None else HybridManipulator(limits="sampled", samples=samples)
    with pytest.raises(InvalidInputError, match="payload_range: expected .* no effort limit bounds what"):
        largest_payload(PointingMechanism(), seed=1)
    weak = max_payload_problem(HybridManipulator())
    weak.dynamics = replace(weak.dynamics, robot=with_effort([500.0, 500.0, 300.0, 17.0, 17.0]))
    with pytest.raises(InvalidInputError, match="payload_range: expected .* 'hybrid_manipulator' cannot hold itself"):
        largest_payload(weak, seed=1)
    with pytest.raises(InvalidInputError, match=r"within: expected a positive time \[s\], got 0.0"):
        largest_payload(hybrid, within=0.0, seed=1)
    with pytest.raises(InvalidInputError, match="expected a feasible motion, none found from 1 starts"):
        largest_payload(hybrid, within=0.5, seed=1, starts=1)


UR5 = {
    "robot": {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 20.0, "jerk": 500.0}},
    "points": [
        [0.0, -1.2, 1.4, -1.7, -1.57, 0.0],
        [0.5, -1.0, 1.2, -1.8, -1.4, 0.4],
        [1.0, -0.9, 1.2, -1.9, -1.2, 0.8],
    ],
    "duration_bounds": (0.3, 4.0),
    "objectives": ("time",),
    "constraints": ("position", "velocity", "acceleration", "jerk", "effort"),
}


@pytest.mark.parametrize("limits", mostly_long(["sampled", "certified"], "sampled"))
def test_a_margin_is_kept_and_the_full_limits_are_told(limits):
    with_margin, whole = (ViaPointProblem(**UR5, limits=limits, effort_margin=margin) for margin in (0.2, 0.0))
    found, full = (largest_payload(problem, within=2.0, seed=1, starts=1) for problem in (with_margin, whole))
    assert found.at_full_limits.mass == pytest.approx(full.mass, rel=1e-5)
    assert full.at_full_limits is None
    assert found.at_rest < found.at_full_limits.at_rest == pytest.approx(full.at_rest, rel=1e-12)
    assert found.mass < min(found.at_rest, full.mass)
    fine = found.rollout.dynamics.sampled(6 if limits == "sampled" else 50)
    used = np.abs(replace(found.rollout, dynamics=fine).effort[0]) / whole.robot.limits.effort
    assert used.max() == pytest.approx(0.8, rel=1e-4)
    assert str(found).startswith("with your margin of 20 %: ")
    assert f"; at the robot's full limits: {found.at_full_limits}" in str(found)
    masses = [1.0, float(f"{0.98 * found.mass:.4g}")]
    curve, at_full = (capacity_front(problem, masses, seed=1, starts=1) for problem in (with_margin, whole))
    assert curve.effort_margin == pytest.approx(0.2)
    assert curve.at_full_limits.times == pytest.approx(at_full.times, rel=1e-5)
    assert curve.times[0] == pytest.approx(at_full.times[0], rel=1e-5)  # a light one is bound by other limits
    assert curve.times[1] > 1.05 * at_full.times[1]
    labels = [text.get_text() for text in plots.payload_curve(curve).get_legend().get_texts()]
    assert labels == ["with your margin of 20 %", "at the robot's full limits"]


def test_where_the_optimiser_missed_a_faster_motion_the_heavier_payloads_is_taken(monkeypatch):
    """The lighter payload's search is made to fail; its curve is mended by what the heavier one found."""
    problem = HybridManipulator(samples=2)
    shape = problem.dynamics.payload
    light, heavy = (problem.with_payload(shape.with_mass(mass)) for mass in (9.0, 10.0))
    search = payload_time.minimise_weighted

    def missing(given, weights, **options):
        found = search(given, weights, **options)
        missed = given is light and options.get("initial") is None
        return replace(found, cost=2.0 * found.cost, x=np.full_like(found.x, 0.9)) if missed else found

    monkeypatch.setattr(payload_time, "minimise_weighted", missing)
    times, X = least_times([light, heavy], seed=1, starts=1)
    expected = search(light, Weights((1.0, 0.0, 0.0, 0.0)), seed=1, initial=X[1][None])
    assert times[0] == pytest.approx(expected.cost, rel=1e-6)
    assert times[0] <= times[1]


def test_fronts_of_time_and_payload_and_energy():
    for names in (["time"], ["time", "energy"]):
        problem = max_payload_problem(HybridManipulator(**WIDE), objectives=names)
        assert problem.objective_names == (*names, "unused_payload")
        assert len(problem.reference_point) == len(names) + 1
        front = optimise(problem, seed=1, generations=40, population=40, progress=False, polish=False)
        assert len(front) > 5
        assert (front.X[:, -1] <= STATIC_BOUND + 1e-9).all()
        own = HybridManipulator(**(WIDE | {"objectives": [*names, "unused_payload"]}))
        assert np.array_equal(own.evaluate(front.X)[0], front.F)
        assert own.reference_point.tolist() == problem.reference_point.tolist()
    with pytest.raises(UnknownNameError, match="unknown objective 'power'"):
        max_payload_problem(HybridManipulator(), objectives=["power"])


@pytest.mark.long
def test_normal_constraints_find_the_front_of_time_and_payload():
    problem = HybridManipulator(**(WIDE | {"objectives": ["time", "unused_payload"]}))
    front = solve_nnc(problem, seed=1, points=4)
    assert len(front) == 4
    order = np.argsort(front.F[:, 0])
    assert (np.diff(front.F[order, 1]) < 0.0).all()
    for row in order[1:-1]:
        best = largest_payload(HybridManipulator(**WIDE), within=float(front.F[row, 0]), seed=1, starts=1)
        assert STATIC_BOUND - front.F[row, 1] == pytest.approx(best.mass, rel=1e-3)


def test_the_payload_as_an_objective_of_the_registered_problem():
    problem = HybridManipulator(objectives=["time", "unused_payload"])
    assert problem.payload_range == (0.0, 10.0)  # eq. (123)
    assert HybridManipulator(**problem.settings).payload_range == (0.0, 10.0)
    assert HybridManipulator(objectives=["jerk", "time"]).objective_names == ("jerk", "time")
    assert HybridManipulator(objectives=["jerk", "time"]).reference_point.tolist() == [100.0, 10.0]
    with pytest.raises(UnknownNameError, match="unknown objective 'speed'; known: .*unused_payload"):
        HybridManipulator(objectives=["speed"])
    with pytest.raises(InvalidInputError, match="objectives: expected 'all', 'cost' or a list of names, got 3"):
        HybridManipulator(objectives=3)


def test_the_payload_as_an_objective_of_any_robot():
    given = {
        "robot": {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 20.0, "jerk": 500.0}},
        "points": [
            [0.0, -1.2, 1.4, -1.7, -1.57, 0.0],
            [0.5, -1.0, 1.2, -1.8, -1.4, 0.4],
            [1.0, -0.9, 1.2, -1.9, -1.2, 0.8],
        ],
        "duration_bounds": (0.3, 4.0),
        "objectives": ("time", "unused_payload"),
    }
    limits = ("position", "velocity", "acceleration", "jerk", "effort")
    problem = ViaPointProblem(**given, constraints=limits, payload=Payload(1.0, (0.0, 0.0, 0.1)))
    assert problem.variables[-1].unit == "kg"
    assert problem.dynamics.payload.com == (0.0, 0.0, 0.1)
    again = ViaPointProblem(**problem.settings)
    assert again.payload_range == problem.payload_range
    front = optimise(problem, seed=1, generations=15, population=20, progress=False, polish=False)
    assert len(front)
    for index in (0, len(front) - 1):
        assert dlcc(front.pick(index), samples=6).mass >= front.X[index, -1] - 1e-9
    assert ViaPointProblem(**given, constraints=limits, payload_range=(1.0, 5.0)).payload_range == (1.0, 5.0)
    with pytest.raises(InvalidInputError, match="objectives: 'unused_payload' needs 'effort' among the constraints"):
        ViaPointProblem(**given)
    for name in ("objectives", "constraints"):
        with pytest.raises(InvalidInputError, match=f"{name}: expected a list of names, got 3"):
            ViaPointProblem(**(given | {"constraints": limits, name: 3}))
    with pytest.raises(InvalidInputError, match="payload_range: expected 'unused_payload' among the objectives"):
        ViaPointProblem(**(given | {"objectives": ("time", "jerk")}), payload_range=(0.0, 5.0))
    with pytest.raises(InvalidInputError, match="objectives: unused_payload needs the payload's mass as a variable"):
        objectives_of(["unused_payload"], problem.robot, reference="test")


def test_payload_as_a_variable_and_an_objective():
    base = HybridManipulator()
    problem = max_payload_problem(base, (0.0, 12.5))
    assert problem.n_var == base.n_var + 1
    assert problem.objective_names == (*base.objective_names, "unused_payload")
    assert (problem.variables[-1].name, problem.variables[-1].unit) == ("payload", "kg")
    assert problem.reference_point.tolist() == [*base.reference_point, 12.5]
    h = np.stack([TABLE_7, TABLE_7, TABLE_7])
    F, G = problem.evaluate(np.column_stack([h, [0.0, 4.0, 10.0]]))[:2]
    assert F[:, -1].tolist() == [12.5, 8.5, 2.5]
    for i, mass in enumerate((0.0, 4.0, 10.0)):
        own_F, own_G = HybridManipulator(payload=mass).evaluate(TABLE_7[None])[:2]
        np.testing.assert_allclose(F[i, :-1], own_F[0], rtol=1e-10)
        np.testing.assert_allclose(G[i], own_G[0], rtol=1e-9, atol=1e-12)


def test_front_of_the_greatest_payload():
    problem = max_payload_problem(HybridManipulator(), (0.0, 12.5))
    front = optimise(problem, seed=1, generations=30, population=40, progress=False, polish=False)
    assert len(front) > 5
    assert front.G.max() <= 0.0
    assert np.ptp(front.X[:, -1]) > 1.0
    for i in range(0, len(front), 5):
        assert dlcc(problem.rollout(front.X[i]), samples=6).mass >= front.X[i, -1] - 1e-9
        np.testing.assert_allclose(front.F[i, -1], 12.5 - front.X[i, -1])


def test_greatest_payload_within_a_time():
    """Section 5 of the reference: the payload alone as the cost reaches its static bound as the motion slows down."""
    problem = max_payload_problem(HybridManipulator(), (0.0, 12.6))
    weights = Weights((0.0, 0.0, 0.0, 0.0, 1.0))
    best = minimise_weighted(problem, weights, seed=1, starts=2)
    assert 12.4 < 12.6 - best.cost <= 12.5109


def test_a_payload_without_mass_gives_its_shape():
    problem = max_payload_problem(HybridManipulator(payload=0.0, payload_model="weight_only"), (0.0, 12.0))
    assert problem.dynamics.payload == Payload(1.0, model="weight_only")


def test_the_range_of_a_payload_that_is_not_given_ends_at_what_is_held_at_rest():
    low, high = max_payload_problem(HybridManipulator(payload_model="weight_only")).payload_range
    assert low == 0.0
    assert high == pytest.approx(12.510810648896424, rel=1e-9)  # (500 N - weight of links 2 to 4) / g
    with pytest.raises(InvalidInputError, match="payload_range: expected .* no effort limit bounds what"):
        max_payload_problem(PointingMechanism())


@pytest.mark.parametrize("bounds", [(-1.0, 5.0), (5.0, 5.0), (6.0, 5.0), (0.0, np.inf), (0.0, np.nan), (np.nan, 1.0)])
def test_bad_payload_ranges_are_refused(bounds):
    with pytest.raises(InvalidInputError, match="payload_range"):
        max_payload_problem(HybridManipulator(), bounds)
