"""Weights of objectives by entropy, comparisons in pairs and least information, against other computations of them."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog

from tests.helpers import refused
from trajevo import comparison_weights, entropy_weights, least_information_weights
from trajevo.front import selection
from trajevo.front.weighing.weights import in_order
from trajevo.problems import HybridManipulator

#: Four motions: time [s] and energy [J], of which less is better, and payload [kg], of which more is.
MOTIONS = np.array([[3.0, 400.0, 12.0], [3.5, 320.0, 11.0], [4.2, 260.0, 10.5], [5.0, 240.0, 12.4]])
#: The same as a front has it.
MINIMISED = MOTIONS * [1.0, 1.0, -1.0]
RNG = np.random.default_rng(7)


def test_entropy_of_shares_of_the_sum():
    found = entropy_weights(MOTIONS)
    np.testing.assert_allclose(found.entropies, [0.9867952, 0.98533729, 0.99841639], atol=1e-8)
    np.testing.assert_allclose(found.weights, [0.44836324, 0.49786596, 0.05377080], atol=1e-8)
    assert found.normalisation == "sum"


def test_entropy_of_shares_of_the_range():
    found = entropy_weights(MINIMISED, normalisation="range")
    np.testing.assert_allclose(found.entropies, [0.74752865, 0.76471417, 0.70778288], atol=1e-8)
    np.testing.assert_allclose(found.weights, [0.32369188, 0.30165844, 0.37464968], atol=1e-8)


@pytest.mark.parametrize(("normalisation", "moves"), [("sum", False), ("range", True)])
def test_entropy_weights_know_no_units_and_by_the_range_no_zero(normalisation, moves):
    F = 1.0 + RNG.random((40, 4))
    own = entropy_weights(F, normalisation=normalisation).weights
    assert sum(own) == pytest.approx(1.0, abs=1e-15)
    assert min(own) > 0.0
    units = entropy_weights(F * [1e-3, 57.3, 1e9, 2.0], normalisation=normalisation).weights
    np.testing.assert_allclose(units, own, rtol=1e-9)
    shifted = entropy_weights(F + np.array([3.0, 0.0, 0.0, 0.0]), normalisation=normalisation).weights
    assert np.allclose(shifted, own, rtol=1e-9) is moves


def test_an_objective_without_spread_has_no_weight():
    F = np.array([[1.0, 5.0], [2.0, 5.0], [3.0, 5.0]])
    for normalisation in ("sum", "range"):
        found = entropy_weights(F, normalisation=normalisation)
        assert found.weights == (1.0, 0.0)
        assert found.entropies[1] == 1.0


def test_entropy_of_what_has_none_is_refused():
    refused(lambda: entropy_weights(MOTIONS[:1]), "F: expected at least 2 solutions.*got 1")
    refused(lambda: entropy_weights(MINIMISED), r"no negative values.*got -12.4 in column 2; normalisation=.range.")
    refused(lambda: entropy_weights(np.ones((3, 2))), "expected an objective in which the solutions differ")
    refused(lambda: entropy_weights(MOTIONS, normalisation="max"), "unknown normalisation 'max'; known: range, sum")
    refused(lambda: entropy_weights([1.0, 2.0]), r"F: expected shape \(N, n_obj\), got \(2,\)")


COMPARED = {
    "three": (
        [[1, 3, 5], [1 / 3, 1, 2], [1 / 5, 1 / 2, 1]],
        [0.64832901, 0.22965079, 0.12202019],
        (3.00369460, 0.00184730, 0.00318500),
    ),
    "four": (
        [[1, 2, 4, 3], [1 / 2, 1, 3, 2], [1 / 4, 1 / 3, 1, 1 / 2], [1 / 3, 1 / 2, 2, 1]],
        [0.46729598, 0.27718059, 0.09543495, 0.16008848],
        (4.03098350, 0.0309835 / 3.0, 0.01147537),
    ),
    "the weights of Guo 2016": (
        [[1, 1, 1.5, 1.5], [1, 1, 1.5, 1.5], [2 / 3, 2 / 3, 1, 1], [2 / 3, 2 / 3, 1, 1]],
        [0.3, 0.3, 0.2, 0.2],
        (4.0, 0.0, 0.0),
    ),
}


@pytest.mark.parametrize("case", COMPARED)
def test_comparisons_in_pairs(case):
    matrix, weights, (eigenvalue, index, ratio) = COMPARED[case]
    found = comparison_weights(matrix)
    np.testing.assert_allclose(found.weights, weights, atol=1e-8)
    assert found.eigenvalue == pytest.approx(eigenvalue, abs=1e-8)
    assert found.index == pytest.approx(index, abs=1e-8)
    assert found.ratio == pytest.approx(ratio, abs=1e-8)


def test_of_three_objectives_the_eigenvector_is_the_geometric_mean_of_rows():
    matrix = np.array(COMPARED["three"][0])
    means = matrix.prod(axis=1) ** (1.0 / 3.0)
    np.testing.assert_allclose(comparison_weights(matrix).weights, means / means.sum(), atol=1e-12)


def test_consistent_comparisons_give_back_their_weights():
    for count in range(1, 9):
        weights = RNG.dirichlet(np.ones(count)) + 0.01
        weights /= weights.sum()
        found = comparison_weights(weights[:, None] / weights)
        np.testing.assert_allclose(found.weights, weights, atol=1e-12)
        assert abs(found.eigenvalue - count) < 1e-10
        assert abs(found.ratio) < 1e-10


def test_two_objectives_cannot_contradict_each_other():
    found = comparison_weights([[1.0, 9.0], [1.0 / 9.0, 1.0]])
    assert found.ratio == 0.0
    np.testing.assert_allclose(found.weights, [0.9, 0.1])


def test_comparisons_that_contradict_one_another_are_refused_and_the_worst_is_named():
    matrix = [[1, 3, 1 / 5], [1 / 3, 1, 2], [5, 1 / 2, 1]]
    says = "at most 0.1, got 1.23: time over jerk is 0.2, but by the other comparisons 6$"
    refused(lambda: comparison_weights(matrix, names=("time", "energy", "jerk")), says)
    refused(lambda: comparison_weights(matrix), "1 over 3 is 0.2")
    matrix[0][2], matrix[2][0] = 6, 1 / 6
    assert comparison_weights(matrix).ratio == pytest.approx(0.0, abs=1e-12)


def test_the_comparison_that_is_named_is_the_one_that_was_spoilt():
    weights = np.array([0.4, 0.3, 0.2, 0.07, 0.03])
    for i, k in itertools.combinations(range(5), 2):
        matrix = weights[:, None] / weights
        right = matrix[i, k]
        matrix[i, k], matrix[k, i] = right / 30.0, 30.0 / right
        refused(
            lambda matrix=matrix: comparison_weights(matrix),
            f": {i + 1} over {k + 1} is .* by the other comparisons {right:.4g}",
        )


@pytest.mark.parametrize(
    ("matrix", "says"),
    [
        ([[1, 2]], "expected a square of 1 to 8 rows, got 1 by 2"),
        (np.ones((9, 9)), "expected a square of 1 to 8 rows, got 9 by 9"),
        ([[1, 0], [1, 1]], "expected positive numbers, got 0"),
        ([[1, 2], [2, 1]], "expected 2 over 1 to be 0.5, the reciprocal of 1 over 2, got 2"),
        ([[2, 1], [1, 1]], "expected 1 of 1 with itself, got 2"),
        ([[1, "much"], [1, 1]], r"expected numbers of shape \(n, n\)"),
        ([1, 2], r"expected shape \(n, n\), got \(2,\)"),
    ],
)
def test_what_is_no_comparison_is_refused(matrix, says):
    refused(lambda: comparison_weights(matrix), says)


def test_comparisons_of_other_objectives_are_refused():
    refused(lambda: comparison_weights(np.ones((2, 2)), names=("a", "b", "c")), "expected 3 rows and columns, got 2 by")


def test_thirds_may_be_written_with_two_digits():
    found = comparison_weights([[1, 3, 5], [0.33, 1, 2], [0.2, 0.5, 1]])
    np.testing.assert_allclose(found.weights, COMPARED["three"][1], atol=2e-3)


def test_without_conditions_nothing_is_added_to_the_prior():
    found = least_information_weights("abc")
    np.testing.assert_allclose(found.weights, [1 / 3] * 3, atol=1e-9)
    assert found.divergence == pytest.approx(0.0, abs=1e-12)
    prior = {"b": 3.0, "a": 5.0, "c": 2.0}
    np.testing.assert_allclose(least_information_weights("abc", prior=prior).weights, [0.5, 0.3, 0.2], atol=1e-9)


def test_what_a_bound_takes_the_others_share_as_before():
    # One bound that binds: the others keep their ratios, so that the answer is a closed form.
    found = least_information_weights("abcd", most={"a": 0.1}, prior=[4, 3, 2, 1])
    np.testing.assert_allclose(found.weights, [0.1, 0.45, 0.3, 0.15], atol=1e-8)
    assert found.divergence == pytest.approx(0.1 * np.log(0.25) + 0.9 * np.log(1.5), abs=1e-10)


def test_an_order_pools_what_contradicts_it():
    # The prior says the reverse of the order: both become the geometric mean, the third keeps its ratio to it.
    found = least_information_weights(("a", "b", "c"), order=("b", "a"), prior=[0.5, 0.2, 0.3])
    pooled = np.array([np.sqrt(0.1), np.sqrt(0.1), 0.3])
    np.testing.assert_allclose(found.weights, pooled / pooled.sum(), atol=1e-8)


def test_least_information_by_a_bound_of_linear_programs():
    names = tuple("abcde")
    for case in range(20):
        rng = np.random.default_rng(case)
        prior = rng.dirichlet(np.ones(5)) + 0.02
        prior /= prior.sum()
        low, high = rng.uniform(0.0, 0.15, 5), rng.uniform(0.25, 0.6, 5)
        order = tuple(np.array(names)[rng.permutation(5)[:3]])
        least, most = dict(zip(names, low, strict=True)), dict(zip(names, high, strict=True))
        found = least_information_weights(names, least=least, most=most, order=order, prior=prior)
        w = np.array(found.weights)
        assert w.sum() == pytest.approx(1.0, abs=1e-12)
        assert (w >= low - 1e-9).all()
        assert (w <= high + 1e-9).all()
        places = [names.index(name) for name in order]
        assert (np.diff(w[places]) <= 1e-9).all()
        rows = np.array([np.eye(5)[b] - np.eye(5)[a] for a, b in itertools.pairwise(places)])
        # The relative entropy is convex: no weights that keep all this have less than a linear program says.
        slope = np.log(w / prior) + 1.0
        lowest = linprog(slope, rows, np.zeros(len(rows)), np.ones((1, 5)), [1.0], list(zip(low, high, strict=True)))
        assert lowest.status == 0
        assert slope @ w - lowest.fun <= 1e-7
        assert found.divergence == pytest.approx((w * np.log(w / prior)).sum(), abs=1e-12)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"least": {"a": 0.6, "b": 0.6}}, "no weights that sum to 1 .*; the least weights sum to 1.2"),
        ({"most": {"a": 0.1, "b": 0.1, "c": 0.1}}, "the greatest weights sum to 0.3"),
        ({"order": ("c", "b"), "least": {"b": 0.6}}, "no weights that sum to 1 keep the bounds and the order"),
        ({"least": {"d": 0.6}}, "unknown objective 'd'; known: a, b, c"),
        ({"order": ("a", "d")}, "unknown objective 'd'"),
        ({"order": ("a", "a")}, "order: expected objectives, each once"),
        ({"most": {"a": 1.5}}, "most: expected weights from 0 to 1, got 1.5 of a"),
        ({"prior": [1, 0, 1]}, "prior: expected positive weights, got 0 for b"),
        ({"prior": {"a": 1, "b": 1}}, "expected one for each of a, b, c, got none of c"),
        ({"least": {"a": "much"}}, "least of a: expected numbers"),
    ],
)
def test_conditions_that_nothing_keeps_are_refused(given, says):
    refused(lambda: least_information_weights(("a", "b", "c"), **given), says)


def test_names_are_asked_for_once_each():
    refused(lambda: least_information_weights(()), "names: expected at least one objective")
    refused(lambda: least_information_weights(("a", "a")), "each once")


TOPSIS = {
    "entropy": ([0.44836324, 0.49786596, 0.05377080], [0.46729450, 0.60184886, 0.63500353, 0.53297031], [2, 1, 3, 0]),
    "equal": ([1, 1, 1], [0.50095884, 0.59527788, 0.58537699, 0.51896732], [1, 2, 3, 0]),
    "given": ([0.5, 0.3, 0.2], [0.61974617, 0.66515678, 0.52023199, 0.38659837], [1, 0, 2, 3]),
}


@pytest.mark.parametrize("case", TOPSIS)
def test_closeness_and_order_by_topsis(case):
    weights, closeness, order = TOPSIS[case]
    w = np.array(weights) / np.sum(weights)
    found = selection.closeness(MINIMISED, w[None])[0]
    np.testing.assert_allclose(found, closeness, atol=1e-7)
    assert np.argsort(-found).tolist() == order
    chosen = selection.topsis(MINIMISED, weights)
    assert (chosen.index, chosen.rule) == (order[0], "topsis")
    assert f"closeness {max(closeness):.4f}" in chosen.reason


def test_topsis_as_its_steps_are_written():
    F, w = RNG.normal(size=(50, 4)), RNG.dirichlet(np.ones(4), 6)
    found = selection.closeness(F, w)
    for weights, row in zip(w, found, strict=True):
        v = weights * F / np.sqrt((F**2).sum(axis=0))
        best, worst = (np.sqrt(((v - end) ** 2).sum(axis=1)) for end in (v.min(axis=0), v.max(axis=0)))
        np.testing.assert_allclose(row, worst / (best + worst), atol=1e-12)


def test_topsis_knows_no_units_and_copes_with_what_has_no_spread():
    F = RNG.random((60, 3))
    assert selection.topsis(F, [1, 2, 3]).index == selection.topsis(F * [1e-200, 57.3, 1e200], [1, 2, 3]).index
    assert selection.topsis(np.array([[1.0, 0.0]]), [1, 1]).index == 0
    assert selection.closeness(np.zeros((2, 2)), np.array([[0.5, 0.5]])).tolist() == [[1.0, 1.0]]
    assert selection.topsis(F, [0, 1, 0]).index == F[:, 1].argmin()


def test_an_alternative_may_change_the_order_of_the_others():
    # The known weakness of the method: the worst value of an objective moves with what is added.
    F = np.array([[7.0, 3.0], [9.0, 2.0], [4.0, 6.0]])
    assert selection.topsis(F, [1, 1]).index == 0
    assert selection.topsis(np.vstack([F, [3.0, 24.0]]), [1, 1]).index == 2


def test_the_weighted_sum_of_guo_2016():
    weights = HybridManipulator.paper_weights
    for z, value, within in (
        ((6.189, 3921.602, 1.068, 0.194), 3.0933406, 5e-8),
        ((7.146, 3250.239, 2.510, 0.252), 3.2194717, 5e-8),
    ):
        chosen = selection.weighted(np.array([z]), weights)
        own = sum(w * part / scale for w, part, scale in zip(weights.weights, z, weights.scales, strict=True))
        assert own == pytest.approx(value, abs=within)
        assert f"least weighted sum {value:.6g} " in chosen.reason


def test_weights_by_name_are_put_in_order():
    names = ("time", "energy", "jerk")
    assert in_order({"jerk": 1, "time": 2, "energy": 3}, names) == [2, 3, 1]
    assert in_order([1, 2, 3], names) == [1, 2, 3]
    refused(lambda: in_order({"time": 1, "jerks": 1}, names), "unknown objective 'jerks'; .* did you mean 'jerk'")
    refused(lambda: in_order({"time": 1, "jerk": 1}, names), "expected one for each of time, energy, jerk, got none of")
