"""The table of `make bench`: turns, ratios, verdicts, exponents, and what it measures against."""

from pathlib import Path

import numpy as np
import pytest

from trajevo import load_robot
from trajevo.base import jit
from trajevo.dynamics import rnea


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "benchmarks"))


def test_ways_are_measured_in_turn(monkeypatch):
    import compare

    called, costs = [], {"a": 1.0, "b": 1e-3}

    def cpu(action):
        before = len(called)
        action()
        return sum(costs[name] for name in called[before:])

    monkeypatch.setattr(compare, "cpu", cpu)
    seconds = compare.in_turn([lambda: called.append("a"), lambda: called.append("b")], 3)
    np.testing.assert_allclose(seconds, np.tile(list(costs.values()), (3, 1)))
    assert called.count("b") > called.count("a")  # what costs little is measured over many calls
    order = "".join(called)
    assert order.startswith("ab")
    assert [len(run) for run in order[2:].split("b") if run] == [1, 1, 1]


def test_lines_tell_ratios_and_whether_they_suffice():
    from cases import COLUMNS, PLAIN, Asked, Case

    case = Case(
        title="a sum",
        ways={"long": lambda: sum(range(400_000)), PLAIN: lambda: sum(range(20_000))},
        rounds=3,
        asked=(Asked("long", PLAIN, 2.0), Asked("long", PLAIN, 1e6)),
        most={PLAIN: 10.0},
        missing=("nothing",),
    )
    long, ours, missing = case.lines()
    assert [line.way for line in (long, ours, missing)] == ["long", PLAIN, "nothing"]
    assert long.asked == f"2 over {PLAIN}: met; 1e+06 over {PLAIN}: missed"
    assert float(long.over_plain.split()[0]) == pytest.approx(20.0, rel=0.7)
    assert (ours.over_plain, ours.asked) == ("", "at most 10 s: met")
    assert missing.time == "not installed"
    assert str(long).count("|") == len(COLUMNS) + 1


def test_exponents_are_of_the_greater_half():
    from rows_scaling import exponents

    sizes = np.array([1, 2, 4, 8, 16, 32])
    seconds = np.stack([np.where(sizes < 8, 1.0, sizes**1.3), 2.0 * sizes])
    np.testing.assert_allclose(exponents(sizes, seconds), [1.3, 1.0])


def test_without_numba_nothing_is_compiled():
    pytest.importorskip("numba")
    from subjects import without_numba

    model = load_robot("puma560").model
    with without_numba():
        assert rnea.slopes_kernel_of(model) is None
        assert not jit.can_compile()
    assert rnea.slopes_kernel_of(model) is not None


def test_candidates_one_by_one_are_the_same_problem():
    from subjects import SUBJECTS

    for make, one_by_one in SUBJECTS.values():
        if one_by_one is not None:
            problem = make()
            F, G = one_by_one(problem)(problem.xu)  # refuses to exist where objectives differ
            assert (F.shape, G.shape) == ((problem.n_obj,), (problem.n_ieq_constr,))


def test_chains_are_as_long_and_as_heavy_as_each_other():
    from chains import MASS, REACH, chain

    for joints in (2, 7):
        robot = chain(joints)
        assert robot.dof == joints
        assert sum(inertia.mass for inertia in robot.model.inertias) == pytest.approx(MASS)
        ends = [placement.translation[2] for placement in robot.model.jointPlacements]
        assert sum(ends) == pytest.approx(REACH * (joints - 1) / joints)
