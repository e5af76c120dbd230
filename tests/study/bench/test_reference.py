"""Best known sets: checked when they are read, replaced only by better ones."""

import numpy as np
import pytest

from trajevo.errors import InvalidInputError
from trajevo.study.bench.reference import Reference, ReferenceFile
from trajevo.study.bench.suite import benchmark

LEAST, FRONT = benchmark("lin1983"), benchmark("gasparetto2007")


def with_told(of, **keys):
    return Reference.of(ReferenceFile.model_validate(of.told.model_dump() | keys), of.problem())


def test_members_that_break_a_limit_are_refused():
    faster = (tuple(0.99 * x for x in LEAST.told.variables[0]),)
    with pytest.raises(
        InvalidInputError, match=r"row 0: breaks (velocity|acceleration|jerk) of j\d by .* % of its limit"
    ):
        with_told(LEAST, variables=faster)


def test_members_outside_their_bounds_are_refused():
    (member,) = LEAST.told.variables
    with pytest.raises(InvalidInputError, match="row 0: h_1: expected 0.05 to 6, got 7"):
        with_told(LEAST, variables=((7.0, *member[1:]),))


def test_values_that_are_not_those_of_the_problem_are_refused():
    with pytest.raises(InvalidInputError, match=r"values.0: expected 17.8\d* for time, as the problem finds, got 17"):
        with_told(LEAST, values=((17.0,),))


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"objectives": ("jerk",)}, "objectives: expected those of the problem"),
        ({"units": ("ms",)}, "units: expected"),
        ({"variables": ((1.0,),)}, "variables: expected"),
        ({"values": ()}, "values: expected"),
    ],
)
def test_a_file_of_another_problem_is_refused(keys, told):
    with pytest.raises(InvalidInputError, match=told):
        with_told(LEAST, **keys)


def test_a_least_value_is_replaced_by_a_lesser_one_alone():
    best = LEAST.reference
    slower = best.variables * 1.001
    worse = with_told(LEAST, variables=tuple(map(tuple, slower.tolist())), values=((1.001 * best.values[0, 0],),))
    assert best.improved(slower) is best
    assert best.improved(best.variables) is best
    better = worse.improved(best.variables, found_by="a test")
    np.testing.assert_array_equal(better.values, best.values)
    assert better.file.found_by == "a test"
    assert worse.file.found_by == LEAST.told.found_by
    with pytest.raises(InvalidInputError, match="X: row 0: breaks"):
        best.improved(0.999 * best.variables)


def test_a_front_takes_in_what_is_better_and_nothing_else():
    whole = FRONT.reference
    half = with_told(FRONT, variables=FRONT.told.variables[::8], values=FRONT.told.values[::8])
    better = half.improved(whole.variables[4::8])
    assert better.hypervolume(better.values) > half.hypervolume(half.values)
    assert better.hypervolume(better.values) == pytest.approx(whole.hypervolume(whole.values), rel=0.02)
    assert whole.improved(whole.variables[:5]) is whole
    slower = np.minimum(whole.variables * np.random.default_rng(0).uniform(1.1, 1.4, whole.variables.shape), 6.0)
    F, G = FRONT.problem().evaluate(slower, return_values_of=["F", "G"])
    worse = (whole.values[:, None] < F).all(axis=2).any(axis=0) & (G <= 0.0).all(axis=1)
    assert worse.any()
    assert whole.improved(slower[worse]) is whole
    assert len(better.variables) <= 200
    assert not better.values.flags.writeable


def test_a_written_set_is_read_again(tmp_path):
    half = with_told(FRONT, variables=FRONT.told.variables[::8], values=FRONT.told.values[::8])
    better = half.improved(FRONT.reference.variables[4::8], found_by="a test")
    better.write(tmp_path / "reference.json")
    again = Reference.of(ReferenceFile.read(tmp_path / "reference.json"), FRONT.problem())
    np.testing.assert_array_equal(again.variables, better.variables)
    np.testing.assert_array_equal(again.values, better.values)
    assert again.file == better.file
    assert len((tmp_path / "reference.json").read_text().splitlines()) > 2 * len(again.variables)


def test_the_hypervolume_is_a_share_of_the_box():
    reference = FRONT.reference
    assert reference.hypervolume([reference.ideal]) == pytest.approx(1.0)
    middle = 0.5 * (reference.ideal + reference.reference_point)
    assert reference.hypervolume([middle, reference.reference_point]) == pytest.approx(0.25)
    assert reference.hypervolume(np.empty((0, 2))) == 0.0
    with pytest.raises(InvalidInputError, match="values: expected"):
        reference.hypervolume([[1.0]])
