import numpy as np
import pytest

from trajevo import TrajevoError
from trajevo.front import selection

RNG = np.random.default_rng(4)
ANGLES = np.linspace(0.0, np.pi / 2, 101)
#: A quarter circle that bulges to the origin, in skewed units; its middle is the knee by every rule.
CIRCLE = np.stack([10.0 + 3.0 * (1 - np.sin(ANGLES)), 500.0 * (1 - np.cos(ANGLES))], axis=1)


def test_knee_of_two_objectives_is_farthest_from_the_line_between_the_ends():
    (x0, y0), (x1, y1) = selection.normalised(CIRCLE)[[0, -1]]
    f = selection.normalised(CIRCLE)
    distance = np.abs((x1 - x0) * (y0 - f[:, 1]) - (x0 - f[:, 0]) * (y1 - y0)) / np.hypot(x1 - x0, y1 - y0)
    assert selection.knee(CIRCLE).index == distance.argmax() == 50


@pytest.mark.parametrize("rule", [selection.knee, selection.nearest_to_utopia])
def test_rules_do_not_depend_on_units(rule):
    F = RNG.random((60, 3))
    assert rule(F).index == rule(F * [1e-3, 57.3, 1e4] + [5.0, -2.0, 0.0]).index
    assert rule(CIRCLE).index == 50


def test_weights_move_the_choice_to_their_objective():
    assert selection.weighted(CIRCLE, [1.0, 0.0]).index == 100
    assert selection.weighted(CIRCLE, [0.0, 1.0]).index == 0
    assert selection.weighted(CIRCLE, [1.0, 1.0]).index == selection.weighted(CIRCLE, [7.0, 7.0]).index == 50


def test_pseudo_weights_follow_the_weights():
    index = [selection.pseudo_weights(CIRCLE, [w, 1.0 - w]).index for w in (0.05, 0.5, 0.95)]
    assert index == sorted(index)
    assert index[1] == 50


@pytest.mark.filterwarnings("ignore:.*scipy.spatial.ckdtree:DeprecationWarning")  # in what pymoo imports
@pytest.mark.parametrize("objectives", [2, 3, 5])
def test_pseudo_weights_choose_what_pymoo_chooses(objectives):
    from pymoo.mcdm.pseudo_weights import PseudoWeights

    F = RNG.random((200, objectives)) * 10.0 ** np.arange(objectives)
    for given in RNG.random((50, objectives)):
        assert selection.pseudo_weights(F, given).index == PseudoWeights(given / given.sum()).do(F)


def test_least_is_the_minimum():
    F = RNG.random((30, 3))
    assert selection.least(F, 1, "energy").index == F[:, 1].argmin()
    assert selection.least(F, 1, "energy").rule == "least_energy"


def test_every_rule_gives_a_sentence_and_copes_with_one_point():
    one = np.array([[1.0, 2.0, 3.0]])
    for choice in (
        selection.knee(one),
        selection.nearest_to_utopia(one),
        selection.weighted(one, [1, 2, 3]),
        selection.pseudo_weights(one, [1, 2, 3]),
    ):
        assert choice.index == 0
        assert choice.reason


def test_input_is_not_touched():
    F = RNG.random((30, 3))
    before = F.copy()
    for rule in (selection.knee, selection.nearest_to_utopia):
        rule(F)
    selection.pseudo_weights(F, [1, 1, 1])
    np.testing.assert_array_equal(F, before)


@pytest.mark.parametrize(
    ("weights", "says"),
    [
        ([1.0], r"weights: expected shape \(2\), got \(1,\)"),
        ([1.0, -1.0], "non-negative"),
        ([0.0, 0.0], "not all zero"),
        ([1.0, np.nan], "finite"),
        (["a", "b"], "expected numbers"),
    ],
)
def test_bad_weights_are_refused(weights, says):
    for rule in (selection.weighted, selection.pseudo_weights):
        with pytest.raises(TrajevoError, match=says):
            rule(CIRCLE, weights)
