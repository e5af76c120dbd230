"""Payloads of given motions: references against bisection and by hand, and what rivals of both kinds find."""

import numpy as np
import pytest

from trajevo.errors import InvalidInputError
from trajevo.problems.hybrid_manipulator import TABLE_7_INTERVALS
from trajevo.study.bench.adapters.adapter import adapters
from trajevo.study.bench.adapters.of_pinocchio import bisected
from trajevo.study.bench.contest import Contest
from trajevo.study.bench.reference import Reference, ReferenceFile
from trajevo.study.bench.run import run_rival
from trajevo.study.bench.score import Measure, Story
from trajevo.study.bench.suite import benchmark, benchmarks

CAPACITIES = [name for name in benchmarks() if benchmark(name).told.kind == "capacity"]
RANDOM = ["panda_random_payload", "ur5_random_payload"]


def test_the_motion_of_a_paper_and_random_ones_of_two_arms_are_there():
    assert set(CAPACITIES) == {"guo2016_table7", *RANDOM}


@pytest.mark.parametrize("name", RANDOM)
def test_random_motions_are_those_of_the_seed(name):
    told, problem = benchmark(name).told, benchmark(name).problem()
    drawn = np.random.default_rng(1).uniform(problem.xl, problem.xu, (48, problem.n_var))
    drawn[:, -1] = 0.0
    kept = (problem.evaluate(drawn, return_values_of=["F", "G"])[1] <= 0.0).all(axis=1)
    np.testing.assert_allclose(np.array(told.variables)[:, :-1], drawn[kept][:24, :-1], rtol=1e-12)


@pytest.mark.parametrize("name", CAPACITIES)
def test_a_few_capacities_are_where_pinocchio_alone_sees_limits_break(name):
    """At as many instants as the file's; masses are rounded down to 1e-5 kg."""
    of = benchmark(name)
    statement = of.statement(instants=20_000)
    rows = np.array(of.told.variables)
    for row in {0, len(rows) // 2, rows[:, -1].argmin()}:
        heavier = rows[row] + np.eye(rows.shape[1])[-1] * 1.1e-5
        assert statement.evaluate(rows[row])[1].max() <= 0.0
        assert statement.evaluate(heavier)[1].max() > 0.0


def test_bisection_finds_the_same_from_nothing():
    of = benchmark("guo2016_table7")
    (row,) = np.array(of.told.variables)
    assert bisected(of.statement(instants=1000), row, enough=1e-7) == pytest.approx(row[-1], abs=2e-4)


def test_table_7_carries_what_its_closed_form_says():
    (row,) = benchmark("guo2016_table7").told.variables
    assert row[:-1] == TABLE_7_INTERVALS
    assert row[-1] == pytest.approx(11.88218025, abs=1e-4)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_capacity_that_is_not_the_greatest_is_refused(share):
    of = benchmark("guo2016_table7")
    motion, most = of.told.variables[0], of.told.reference_point[0]
    mass = share * motion[-1]
    file = of.told.model_dump() | {"variables": ((*motion[:-1], mass),), "values": ((most - mass,),)}
    told = "row 0: expected a payload of 11.88.* kg, got 11.87" if share < 1.0 else "row 0: breaks effort of"
    with pytest.raises(InvalidInputError, match=told):
        Reference.of(ReferenceFile.model_validate(file), of.problem())


def test_capacities_of_a_fixed_payload_are_refused():
    of = benchmark("lin1983")
    file = of.told.model_copy(update={"kind": "capacity"})
    with pytest.raises(InvalidInputError, match="kind: expected a payload that is a variable"):
        Reference.of(file, of.problem())


@pytest.mark.parametrize(
    ("name", "rival", "share"),
    [
        ("guo2016_table7", "pinocchio", 0.998),
        ("guo2016_table7", "trajevo", 0.9998),
        ("ur5_random_payload", "trajevo", 0.9998),
    ],
)
def test_both_find_what_motions_carry(name, rival, share):
    found = run_rival(name, rival, seed=1, budget=60.0)
    assert found.end == "scored"
    assert share < found.share <= 1.0 + 1e-6
    assert len(found.X) == len(benchmark(name).told.variables)
    assert found.violation is not None
    assert found.violation <= 1e-6


def test_a_capacity_stays_whatever_is_tried():
    reference = benchmark("guo2016_table7").reference
    assert reference.improved(reference.variables) is reference


def test_whatever_looks_for_motions_refuses():
    contest = Contest(benchmark("guo2016_table7"), seed=1, budget=1.0)
    for name, one in adapters().items():
        assert bool(one.refuses(contest)) == (name not in ("trajevo", "pinocchio"))
    elsewhere = Contest(benchmark("piazzi2000"), seed=1, budget=1.0)
    assert (
        adapters()["pinocchio"].refuses(elsewhere) == "it finds payloads of given motions, the problem asks for motions"
    )


def test_a_share_is_the_mean_over_the_motions_by_hand():
    of = benchmark("ur5_random_payload")
    measure, X = Measure(of.reference), np.array(of.reference.variables)
    most = of.told.reference_point[0]
    half = X.copy()
    half[:, -1] *= 0.5
    other = X[:1] * 0.99
    tried = np.concatenate([half, X[:6], other])
    values = measure.told(tried, most - tried[:, -1:])
    np.testing.assert_array_equal(values[-1, -1], -1.0)
    assert measure(values[:24]) == pytest.approx(0.5)
    assert measure(values) == pytest.approx((6 + 18 * 0.5) / 24)
    np.testing.assert_array_equal(measure.front(values), [*range(6, 24), *range(24, 30)])
    assert measure(values[:0]) == 0.0
    story = Story(measure, np.linspace(0.1, 1.0, 31), np.arange(31), values, budget=1.0)
    assert story.share == pytest.approx(0.625)
    assert len(story.history()[-1].least) == 1
    assert story.time_to(0.625) == pytest.approx(1.0 - 0.03)
