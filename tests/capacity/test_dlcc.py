"""Payload capacity at samples: the paper's motion, closed form against bisection and iteration, edge cases; fronts."""

from dataclasses import replace

import numpy as np
import pytest

from tests.guo2016 import GUO2016, TABLE_7, bisected_capacity
from tests.helpers import mostly_long
from trajevo import PolynomialBatch, load_robot, optimise
from trajevo.capacity.capacity import Capacity
from trajevo.capacity.dlcc import capacities, dlcc, dlcc_iterative, dlcc_sampled
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.errors import InvalidInputError
from trajevo.problems import HybridManipulator
from trajevo.robot.payload import LOAD_MODELS, Payload
from trajevo.solvers.gradient.weighted_sum import minimise_weighted

ROBOT = load_robot("hybrid_manipulator")
MODELS = tuple(LOAD_MODELS)
every_model = pytest.mark.parametrize("model", MODELS)


def table_7(model="rigid", robot=ROBOT):
    trajectory = HybridManipulator().decode(TABLE_7)
    return Rollout(Dynamics(robot, Payload(10.0, model=model)), trajectory)


def random_rollouts(count, model, seed=0, low=0.05, high=1.2):
    """Motions of all speeds: some break an effort limit without any payload."""
    rng = np.random.default_rng(seed)
    h = rng.uniform(low, high, (count, 12)) * rng.uniform(0.3, 1.0, (count, 1))
    dynamics = Dynamics(ROBOT, Payload(1.0, model=model))
    trajectories = HybridManipulator().decode(h)
    return [Rollout(dynamics, trajectories[i]) for i in range(count)]


def efforts(rollout, samples):
    own = rollout.dynamics
    fine = Rollout(Dynamics(own.robot, own.payload, samples=samples), rollout.trajectory)
    return fine.unloaded_effort[0], fine.effort_per_kilogram[0]


def with_effort(limits):
    return replace(ROBOT, limits=replace(ROBOT.limits, effort=np.asarray(limits, dtype=float)))


@every_model
def test_capacity_of_table_7(model):
    found = dlcc_sampled(table_7(model))
    assert found.mass == pytest.approx(GUO2016["dlcc_table7"][model], abs=1e-6)
    assert (found.joint, found.payload_model) == ("screw_3", model)
    assert found.time == pytest.approx({"rigid": 0.330, "weight_only": 0.330, "tool_axis": 6.190}[model], abs=1e-9)
    assert found.margin[2] == pytest.approx(0.0, abs=1e-12)
    assert (found.margin[[0, 1, 3, 4]] > 0.0).all()
    assert found.per_joint[2] == found.mass == found.per_joint.min()
    assert found.history == ()
    assert str(found) == (
        f"{found.mass:.6f} kg ({model} payload), limited by screw_3 at {found.time:.4f} s; at 50 instants per segment, "
        "not between them"
    )


def test_capacity_of_every_joint_at_table_7():
    force, rigid = dlcc_sampled(table_7("weight_only")).per_joint, dlcc_sampled(table_7("rigid")).per_joint
    assert np.isinf(force[[0, 1, 3]]).all()
    assert force[4] == pytest.approx(30.725, abs=1e-3)
    assert rigid[[0, 1, 2, 4]] == pytest.approx([9327, 2925, 11.882180, 29.85], rel=1e-3)
    assert rigid[3] > 1e5  # where the payload's share is all but 0: it depends on the samples


@every_model
def test_capacity_does_not_depend_on_the_mass_carried(model):
    masses = [
        dlcc_sampled(Rollout(Dynamics(ROBOT, Payload(mass, model=model)), HybridManipulator().decode(TABLE_7))).mass
        for mass in (0.0, 1.0, 40.0)
    ]
    assert masses == pytest.approx([masses[0]] * 3, rel=1e-12)


def test_capacity_of_a_solution_and_of_an_optimum():
    problem = HybridManipulator()
    front = optimise(problem, seed=1, generations=30, population=20, progress=False, polish=False)
    solution = front.knee()
    assert dlcc_sampled(solution).mass == dlcc_sampled(problem.rollout(solution.x)).mass
    assert dlcc_sampled(solution, samples=6).mass >= 10.0
    optimum = minimise_weighted(problem, problem.paper_weights, seed=1, starts=1)
    assert dlcc_sampled(optimum).mass == pytest.approx(11.7005, abs=2e-3)


@every_model
def test_steps_of_the_iteration_at_table_7(model):
    exact = dlcc_sampled(table_7(model)).mass
    for step in (0.01, 0.05, 0.1):
        found = dlcc_iterative(table_7(model), start=0.0, step=step)
        assert found.mass == pytest.approx(np.floor(exact / step) * step, abs=1e-9)
        assert (found.joint, found.payload_model) == ("screw_3", model)
        assert found.time == pytest.approx(dlcc_sampled(table_7(model)).time)


def test_the_papers_iteration_of_the_conjectured_convention_breaks_at_12_65():
    history = dlcc_iterative(table_7("tool_axis"), step=0.05).history
    assert history[-1][0] == pytest.approx(12.65, abs=1e-9)


def test_history_ends_infeasible():
    found = dlcc_iterative(table_7(), start=10.0, step=0.25)
    masses, used, joints = zip(*found.history, strict=True)
    np.testing.assert_allclose(masses, 10.0 + 0.25 * np.arange(len(masses)))
    assert max(used[:-1]) <= 1.0 < used[-1]
    assert found.mass == masses[-2]
    assert joints[-1] == found.joint == "screw_3"
    assert (np.diff(used) > 0.0).all()
    assert found.margin.min() == pytest.approx(1.0 - used[-2], rel=1e-12)


@every_model
@pytest.mark.parametrize("count", mostly_long([20, 50], 20))
def test_closed_form_equals_bisection(model, count):
    outcomes = set()
    for rollout in random_rollouts(count, model, seed=MODELS.index(model)):
        found = dlcc_sampled(rollout, samples=6)
        unloaded, per_kilogram = efforts(rollout, 6)
        assert found.mass == pytest.approx(
            bisected_capacity(unloaded, per_kilogram, ROBOT.limits.effort), rel=1e-12, abs=1e-8
        )
        outcomes.add(found.mass > 0.0)
        if found.mass > 0.0:
            used = np.abs(unloaded + found.mass * per_kilogram) / ROBOT.limits.effort
            joint = ROBOT.joint_names.index(found.joint)
            assert used.max() == pytest.approx(1.0, abs=1e-12)
            assert used[:, joint].max() == pytest.approx(1.0, abs=1e-12)
            assert found.margin.min() == pytest.approx(0.0, abs=1e-12)
    assert outcomes == {True, False}


@every_model
def test_every_joints_capacity_equals_bisection(model):
    for rollout in random_rollouts(10, model, seed=20, low=0.3):
        per_joint = dlcc_sampled(rollout, samples=4).per_joint
        unloaded, per_kilogram = efforts(rollout, 4)
        for joint, limit in enumerate(ROBOT.limits.effort):
            expected = bisected_capacity(unloaded[:, joint], per_kilogram[:, joint], limit, high=1e12, steps=90)
            if expected < 1e9:
                assert per_joint[joint] == pytest.approx(expected, rel=1e-9, abs=1e-8)
            else:
                assert per_joint[joint] >= 1e9


@pytest.mark.parametrize("count", mostly_long([40, 100, 1000], 40))
def test_iteration_agrees_within_its_step_on_many_trajectories(count):
    step, positive = 0.1, 0
    for i, rollout in enumerate(random_rollouts(count, "rigid", seed=9)):
        rollout = Rollout(Dynamics(ROBOT, Payload(1.0, model=MODELS[i % 3])), rollout.trajectory)
        exact, stepped = dlcc_sampled(rollout, samples=2), dlcc_iterative(rollout, step=step, samples=2)
        assert stepped.mass <= exact.mass + 1e-9
        assert exact.mass < stepped.mass + step + 1e-9
        if exact.mass > 0.0:
            positive += 1
            assert stepped.mass == pytest.approx(step * np.floor(exact.mass / step + 1e-9), abs=1e-9)
            assert stepped.joint
        else:
            assert stepped.joint == exact.joint
    assert 0.1 * count < positive < count


@pytest.mark.parametrize("model", MODELS)
def test_unlimited_capacity(model):
    rollout = table_7(model, with_effort([np.inf] * 5))
    closed, stepped = dlcc_sampled(rollout), dlcc_iterative(rollout, step=5.0)
    for found in (closed, stepped):
        assert found.mass == np.inf
        assert found.joint == ""
        assert np.isnan(found.time)
        assert str(found) == (f"unlimited: no joint has an effort limit that a {model} payload reaches on this motion")
        assert (found.margin == 1.0).all()
    assert stepped.history == ()


def test_only_joints_with_a_limit_bind():
    limits = np.array([np.inf, np.inf, np.inf, np.inf, 17.0])
    found = dlcc_sampled(table_7("weight_only", with_effort(limits)))
    assert found.joint == "joint_5"
    assert found.mass == pytest.approx(30.725, abs=1e-3)
    unlimited = dlcc_sampled(table_7("weight_only", with_effort([500.0, 500.0, np.inf, 17.0, np.inf])))
    assert unlimited.mass == np.inf  # the weight alone loads neither the upper screws nor joint 4


def test_zero_capacity():
    unloaded = efforts(table_7(), 50)[0]
    limits = ROBOT.limits.effort.copy()
    limits[2] = np.abs(unloaded[:, 2]).max()
    rollout = table_7(robot=with_effort(limits))
    found = dlcc_sampled(rollout)
    assert found.mass == 0.0
    assert found.joint == "screw_3"
    assert found.margin.min() == pytest.approx(0.0, abs=1e-12)
    assert str(found).startswith("0.000000 kg (rigid payload), limited by screw_3 at ")
    stepped = dlcc_iterative(rollout)
    assert (stepped.mass, stepped.joint, len(stepped.history)) == (0.0, "screw_3", 2)


@pytest.mark.parametrize("model", MODELS)
def test_infeasible_without_payload(model):
    limits = ROBOT.limits.effort.copy()
    limits[2] = 300.0  # the links alone weigh 377 N
    rollout = table_7(model, with_effort(limits))
    for found in (dlcc_sampled(rollout), dlcc_iterative(rollout)):
        assert (found.mass, found.joint) == (0.0, "screw_3")
        assert found.margin[2] < -0.25
        excess = -100.0 * found.margin[2]
        assert str(found) == (
            f"0 kg: even without payload screw_3 exceeds its effort limit by {excess:.3g} %, at {found.time:.4f} s"
        )
    assert dlcc_sampled(rollout).per_joint[2] == 0.0
    assert len(dlcc_iterative(rollout).history) == 1


def test_a_payload_that_would_help_does_not_make_a_broken_limit_feasible():
    """Joint 5 held by gravity: one sign of effort without payload, the other with it."""
    for rollout in random_rollouts(60, "rigid", seed=30, low=0.1):
        unloaded, per_kilogram = efforts(rollout, 4)
        relieved = unloaded * per_kilogram < 0.0
        if relieved.any():
            joint = int(np.argwhere(relieved)[0, 1])
            limits = np.full(5, np.inf)
            limits[joint] = 0.5 * np.abs(unloaded[:, joint][relieved[:, joint]]).max()
            found = dlcc_sampled(Rollout(Dynamics(with_effort(limits), Payload(1.0)), rollout.trajectory), samples=4)
            assert (found.mass, found.joint) == (0.0, ROBOT.joint_names[joint])
            return
    pytest.fail("no motion in which a payload relieves a joint")


def test_capacity_is_that_of_the_first_of_a_batch():
    problem = HybridManipulator()
    both = problem.rollout(np.stack([TABLE_7, 0.7 * TABLE_7]))
    assert dlcc_sampled(both).mass == dlcc_sampled(problem.rollout(TABLE_7)).mass


def test_capacity_at_rest_is_the_static_bound():
    """A motion of almost no velocity near one point: F₃ = (m + m_p) g."""
    q = np.array(GUO2016["via_points"][0])
    coefficients = np.zeros((1, 1, 5, 2))
    coefficients[0, 0, :, 0] = q
    still = PolynomialBatch(np.array([[0.0, 1.0]]), coefficients)
    found = dlcc_sampled(Rollout(Dynamics(ROBOT), still))
    assert found.mass == pytest.approx(12.510810648896424, abs=1e-9)


@pytest.mark.parametrize(
    "bad",
    [{"start": -1.0}, {"start": float("nan")}, {"start": float("inf")}]
    + [{"step": value} for value in (0.0, -0.05, float("nan"), float("inf"))],
)
def test_bad_start_and_step_are_refused(bad):
    with pytest.raises(InvalidInputError, match=rf"^{next(iter(bad))}: expected"):
        dlcc_iterative(table_7(), **bad)


def test_capacity_samples_are_checked():
    with pytest.raises(InvalidInputError, match="samples"):
        dlcc_sampled(table_7(), samples=1)


def test_a_start_that_is_infeasible():
    found = dlcc_iterative(table_7(), start=20.0, step=1.0)
    assert found.mass == 0.0
    assert [mass for mass, _, _ in found.history] == [20.0]


def test_capacity_is_frozen_and_read_only():
    found = dlcc_sampled(table_7())
    assert isinstance(found, Capacity)
    assert not found.margin.flags.writeable
    assert not found.per_joint.flags.writeable
    with pytest.raises(AttributeError):
        found.mass = 1.0


def counterweighted():
    """A joint with less effort than its own links need at some instant, where the payload brings it back."""
    for rollout in random_rollouts(200, "rigid", seed=30, low=0.1):
        unloaded, per_kilogram = efforts(rollout, 4)
        for joint in range(5):
            worst = int(np.abs(unloaded[:, joint]).argmax())
            limits = np.full(5, np.inf)
            limits[joint] = 0.99 * abs(unloaded[worst, joint])
            weak = Rollout(Dynamics(with_effort(limits), Payload(1.0)), rollout.trajectory)
            if dlcc_sampled(weak, samples=4).feasible:
                return weak, unloaded[:, joint], per_kilogram[:, joint], limits[joint]
    return pytest.fail("no motion on which a payload is a counterweight")


def test_a_counterweight_gives_an_interval_and_the_iteration_says_where_to_start():
    weak, unloaded, per_kilogram, limit = counterweighted()
    found = dlcc_sampled(weak, samples=4)
    assert 0.0 < found.least < found.mass
    for mass, feasible in (
        (0.0, False),
        (0.999 * found.least, False),
        (1.001 * found.least, True),
        (0.999 * found.mass, True),
        (1.001 * found.mass, False),
    ):
        assert bool((np.abs(unloaded + mass * per_kilogram) <= limit).all()) is feasible
    assert str(found).startswith(
        f"{found.least:.6f} to {found.mass:.6f} kg (rigid payload), limited by {found.joint} at "
    )
    early = dlcc_iterative(weak, samples=4)
    assert (early.mass, len(early.history)) == (0.0, 1)
    assert str(early).endswith(f"already breaks the limit of {found.joint}; start at {found.least:.6g} kg")
    step = (found.mass - found.least) / 5.5
    later = dlcc_iterative(weak, start=found.least, step=step, samples=4)
    assert later.mass == pytest.approx(found.least + 5 * step)


@every_model
def test_margins_over_time(model):
    found = dlcc_sampled(table_7(model))
    unloaded, per_kilogram = efforts(table_7(model), 50)
    expected = 1.0 - np.abs(unloaded + found.mass * per_kilogram) / ROBOT.limits.effort
    np.testing.assert_allclose(found.margins, expected, rtol=1e-12, atol=1e-12)
    assert found.times.shape == found.margins.shape[:1]
    assert (found.margin == found.margins.min(axis=0)).all()
    assert found.times[found.margins[:, 2].argmin()] == found.time
    assert found.joint_names == ROBOT.joint_names


@pytest.mark.parametrize("generations", mostly_long([8, 30], 8))
def test_capacities_of_a_front_are_those_of_its_solutions(generations):
    front = optimise(HybridManipulator(), seed=1, generations=generations, population=20, progress=False, polish=False)
    assert len(front) > 3
    found = capacities(front, samples=6)
    each = [dlcc(front.problem.rollout(x), samples=6) for x in front.X]
    assert found.mass.tolist() == [one.mass for one in each]
    assert found.least.tolist() == [one.least for one in each]
    assert [ROBOT.joint_names[joint] for joint in found.joint] == [one.joint for one in each]
    assert (found.mass >= 10.0).all()
    again = capacities(front.problem.rollout(front.X), samples=6)
    assert (again.mass == found.mass).all()


def test_capacities_where_nothing_binds_or_nothing_is_feasible():
    trajectories = HybridManipulator().decode(np.stack([TABLE_7, 0.7 * TABLE_7]))
    free = capacities(Rollout(Dynamics(with_effort([np.inf] * 5)), trajectories))
    assert np.isinf(free.mass).all()
    assert (free.joint == -1).all()
    weak = capacities(Rollout(Dynamics(with_effort([500.0, 500.0, 300.0, 17.0, 17.0])), trajectories))
    assert (weak.mass == 0.0).all()
    assert np.isnan(weak.least).all()
    with pytest.raises(InvalidInputError, match="motion: expected"):
        capacities("front")
