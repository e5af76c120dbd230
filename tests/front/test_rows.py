"""A front is a sequence of its solutions, with rows as NumPy has them, and a table of pandas."""

import csv
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers import refused, small_problem
from trajevo import Front, Solution, TrajevoError, export, max_payload_problem, optimise
from trajevo.errors import InvalidInputError, NoSolutionError, NoSuchRowError
from trajevo.problems import HybridManipulator, PointingMechanism

SMALL = {"seed": 1, "generations": 10, "population": 20, "progress": False, "polish": False}


@pytest.fixture(scope="module")
def front() -> Front:
    return optimise(PointingMechanism(), **SMALL)


def test_a_row_is_the_solution_of_that_row(front):
    for row in (0, 3, np.int64(3), -1, -len(front)):
        found = front[row]
        assert isinstance(found, Solution)
        assert found.index == row % len(front)
        np.testing.assert_array_equal(found.x, front.X[row])
    assert front[2].F == front.pick(2).F
    assert front[2].reason == front.pick(2).reason


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_rows_are_those_of_numpy(front, data):
    n = len(front)
    whole = st.integers(-2 * n, 2 * n)
    asked = data.draw(
        st.one_of(
            st.slices(n),
            st.lists(st.integers(-n, n - 1), min_size=1, max_size=5),
            st.lists(st.booleans(), min_size=n, max_size=n).map(np.array),
            st.builds(slice, st.none() | whole, st.none() | whole, st.integers(1, 3)),
        )
    )
    rows = sorted(set(np.arange(n)[asked].tolist()))
    some = front[asked]
    for name in "XFG":
        np.testing.assert_array_equal(getattr(some, name), getattr(front, name)[rows])
    assert (some.record, some.run, some.history) == (front.record, front.run, front.history)


def test_a_loop_goes_through_all_solutions_and_ends(front):
    assert [one.index for one in front] == list(range(len(front)))
    assert [one.index for one in reversed(front)] == list(range(len(front)))[::-1]
    first, *_, last = front
    assert (first.index, last.index) == (0, len(front) - 1)
    assert next(iter(front[4:6])).F == front[4].F


def test_what_is_no_row_is_told_in_one_sentence(front):
    n = len(front)
    for row in (n, -n - 1, 10**30):
        with pytest.raises(NoSuchRowError, match=rf"front: no row {row}: rows are 0 to {n - 1}") as caught:
            front[row]
        assert isinstance(caught.value, IndexError)
        assert isinstance(caught.value, InvalidInputError)
    refused(lambda: front[[0, n]], rf"no row {n}")
    refused(lambda: front["knee"], r"expected a row, .* got 'knee'; front.pick\('knee'\) takes the name of a rule")
    for wrong in (1.5, True, None, (0, 1.5), [[0, 1]], np.zeros(n + 1, dtype=bool), {"row": 1}, slice("a", "b")):
        refused(lambda wrong=wrong: front[wrong], r"front: expected ")


def test_a_part_of_a_front_is_a_front(front, tmp_path):
    some = front[front.F[:, 0] < np.median(front.F[:, 0])]
    assert 2 <= len(some) < len(front)
    some.save(tmp_path / "some.json")
    assert Front.load(tmp_path / "some.json") == some
    assert some.problem is front.problem
    np.testing.assert_array_equal(some.knee().trajectory.coefficients, some[some.knee().index].trajectory.coefficients)
    assert len(front[[]]) == 0
    nothing = front[5:5]
    assert len(nothing) == 0
    assert list(nothing) == []
    assert nothing.to_dataframe().shape[0] == 0
    with pytest.raises(NoSolutionError, match="the front is empty: none of its rows was taken"):
        nothing.knee()
    with pytest.raises(NoSuchRowError, match="no row 0: it is empty"):
        nothing[0]


@pytest.mark.parametrize("take", [lambda front: front[5], lambda front: front[4:7], list])
def test_rows_of_a_front_that_was_changed_are_refused(front, take, tmp_path):
    front.save(tmp_path / "front.json")
    content = json.loads((tmp_path / "front.json").read_text())
    content["F"][5][1] *= 0.999
    (tmp_path / "front.json").write_text(json.dumps(content))
    loaded = Front.load(tmp_path / "front.json")
    refused(lambda: take(loaded), r"row 5: acceleration is recorded as")


def test_rows_of_a_front_without_its_problem_are_as_recorded(tmp_path):
    made = optimise(small_problem(), **SMALL)
    made.save(tmp_path / "front.json")
    alone = Front.load(tmp_path / "front.json")
    with pytest.warns(UserWarning, match="as recorded, not checked"):
        some = alone[:3]
    np.testing.assert_array_equal(some.F, made.F[:3])
    refused(lambda: some.problem, "pass it as problem=")


def test_the_table_is_the_front_in_the_units_of_its_problem(front):
    table = front.to_dataframe()
    assert table.index.name == "row"
    assert list(table.columns[:4]) == ["time [s]", "acceleration [deg/s^2]", "jerk [deg/s^3]", "dt_1 [s]"]
    np.testing.assert_allclose(table["acceleration [deg/s^2]"], np.degrees(front.F[:, 1]), rtol=1e-14)
    np.testing.assert_array_equal(table["dt_1 [s]"], front.X[:, 0])
    np.testing.assert_allclose(table["velocity of joint_1 [% of limit]"], 100 + 100 * front.G[:, 2])
    assert front.record.constraints[2] == "velocity of joint_1"
    assert table.shape == (len(front), 3 + front.X.shape[1] + front.G.shape[1] + 1)
    for choice in front.choices():
        assert choice.rule in table["choice"][choice.index].split(", ")
    assert sum(map(len, table["choice"].str.split(", "))) - (table["choice"] == "").sum() == len(front.choices())


def test_a_payload_may_be_variable_and_objective_in_one_table():
    problem = max_payload_problem(HybridManipulator(payload_bounds=(0.0, 13.0)), objectives=["time"])
    found = optimise(problem, **SMALL)
    table = found.to_dataframe()
    assert table.columns.is_unique
    assert table.shape[1] == problem.n_obj + problem.n_var + problem.n_ieq_constr + 1
    (payload,) = (name for name in table.columns if name.startswith("payload") and name.endswith("[kg]") and (
        np.array_equal(table[name], found.X[:, -1])
    ))  # fmt: skip
    assert payload in ("payload [kg]", "payload (variable) [kg]")


def test_the_table_of_a_motion_is_what_is_exported(front, tmp_path):
    knee = front.knee()
    export(knee, tmp_path / "motion.csv", format="csv", step=0.05, angle="deg")
    lines = [line for line in (tmp_path / "motion.csv").read_text().splitlines() if not line.startswith("#")]
    headers, *rows = csv.reader(lines)
    table = knee.to_dataframe(step=0.05)
    assert list(table.columns) == headers
    np.testing.assert_array_equal(table.to_numpy(), np.array(rows, dtype=float))
    for step in (0.0, -1.0, np.nan, np.inf, True, "0.1", None):
        refused(lambda step=step: knee.to_dataframe(step=step), r"step: expected a positive time \[s\], got")
    refused(lambda: knee.to_dataframe(step=1e-9), "step: 1e-09 s gives over 10000000 samples")


def test_arrays_of_fronts_are_refused_where_fronts_are_not_meant(front):
    """A front has rows, so NumPy would take it for a sequence of solutions."""
    with pytest.raises(TrajevoError):
        optimise(PointingMechanism(), **SMALL, initial=list(front))
