"""How stable choices by weights are: shares exactly, by Sobol's points and by brute force, and least changes."""

import itertools
import shutil

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import mostly_long, refused, trajevo
from trajevo import Robot, ViaPointProblem, optimise, plots
from trajevo.formulation.problem import Weights
from trajevo.front import selection
from trajevo.front.weighing.stability import cells, chooser, simplex, stability

RULES = ("weighted", "topsis")


def bulging(count, objectives, seed=0):
    """Points of a front that bulges to the ideal, in skewed units, with some behind it."""
    rng = np.random.default_rng(seed)
    points = np.abs(rng.normal(size=(count, objectives)))
    points /= np.linalg.norm(points, axis=1, keepdims=True) * rng.uniform(0.8, 1.0, (count, 1)) ** -1
    return (1.0 - points) * np.array([1.0, 300.0, 0.02, 7.0, 1.0])[:objectives] + 0.3


def test_two_objectives_by_hand():
    # Normalised (0, 1), (0.25, 0.25), (1, 0): the middle one from where 0.25 = 1 - w to where 0.25 = w.
    F = np.array([[1.0, 50.0], [2.0, 20.0], [5.0, 10.0]])
    found = stability(F, [1, 1])
    assert (found.row, found.rows) == (1, (1, 0, 2))
    np.testing.assert_allclose(found.shares, [0.5, 0.25, 0.25], atol=1e-15)
    assert found.errors == (0.0, 0.0, 0.0)
    assert found.change.size == pytest.approx(0.25, abs=1e-12)
    np.testing.assert_allclose(sorted(found.change.weights), [0.25, 0.75], atol=1e-12)
    assert str(found).startswith(
        "row 1 by 50 % of all weights, 3 rows by some; weights that change by 0.25 choose row "
    )


def test_three_objectives_by_hand():
    # Three ends alike and nothing between: each is chosen where its weight is the greatest, a third of the triangle.
    found = stability(1.0 - np.eye(3), [3, 2, 1])
    assert found.row == 0
    np.testing.assert_allclose(found.shares, [1 / 3] * 3, atol=1e-14)
    # The nearest weights with two equal greatest ones: a twelfth from one to the other.
    assert found.change.size == pytest.approx(1 / 12, abs=1e-9)
    assert found.change.row == 1


@pytest.mark.parametrize("objectives", [2, 3])
def test_exact_shares_by_counting(objectives):
    F = bulging(40, objectives)
    found = stability(F, [1] * objectives)
    random = np.random.default_rng(3).dirichlet(np.ones(objectives), 200_000)
    rows = (random @ selection.normalised(F).T).argmin(axis=1)
    counted = np.bincount(rows, minlength=len(F)) / len(rows)
    exact = np.zeros(len(F))
    exact[list(found.rows)] = found.shares
    assert sum(found.shares) == pytest.approx(1.0, abs=1e-12)
    assert list(found.shares) == sorted(found.shares, reverse=True)
    deviation = np.sqrt(exact * (1.0 - exact) / len(rows))
    assert (np.abs(counted - exact) <= 5.0 * deviation + 1e-12).all()
    assert set(np.flatnonzero(counted)) <= set(found.rows)


@pytest.mark.thinned(2)
@pytest.mark.parametrize(("objectives", "rule"), [(4, "weighted"), *((count, "topsis") for count in (2, 3, 4))])
def test_counted_shares_by_brute_force(objectives, rule):
    F = bulging(15, objectives)
    found = stability(F, [1] * objectives, rule=rule)
    assert sum(found.shares) == pytest.approx(1.0, abs=1e-12)
    random = np.random.default_rng(5).dirichlet(np.ones(objectives), 5_000)
    by_hand = getattr(selection, rule)
    rows = [by_hand(F, weights).index for weights in random]
    counted = np.bincount(rows, minlength=len(F)) / len(rows)
    told = dict(zip(found.rows, zip(found.shares, found.errors, strict=True), strict=True))
    for row, share in enumerate(counted):
        own, error = told.get(row, (0.0, 0.0))
        assert abs(share - own) <= 5.0 * np.hypot(error, np.sqrt(share * (1 - share) / len(rows))) + 1e-4


def test_sobol_errors_are_those_of_the_exact_shares():
    from trajevo.front.weighing import stability as module

    F = bulging(30, 3, seed=2)
    exact = stability(F, [1, 1, 1])
    shares, errors = module._counted(3, chooser(F, [1, 1, 1], "weighted"))
    off = [
        (shares[row] - share) / errors[row] for row, share in zip(exact.rows, exact.shares, strict=True) if share > 0.01
    ]
    assert len(off) > 5
    assert 0.2 < np.sqrt(np.mean(np.square(off))) < 2.5
    assert max(errors.values()) < 1e-3


@pytest.mark.thinned(2)
@pytest.mark.parametrize("objectives", [2, 3, 4, 5])
def test_the_least_change_flips_the_choice_and_less_does_not(objectives):
    rng = np.random.default_rng(objectives)
    for case in range(12):
        F = bulging(60, objectives, seed=case)
        weights = rng.dirichlet(np.ones(objectives))
        found = stability(F, weights)
        change, own = found.change, np.array(found.weights)
        end = np.array(change.weights)
        assert end.sum() == pytest.approx(1.0, abs=1e-12)
        assert end.min() >= 0.0
        assert np.abs(end - own).max() == pytest.approx(change.size, abs=1e-8)
        chosen = chooser(F, weights, "weighted")
        assert change.row != found.row
        # Slightly less keeps it, slightly more towards the weights of the other one's own best objective flips it.
        assert chosen((own + (1.0 - 1e-5) * (end - own))[None])[0] == found.row
        gaps = selection.normalised(F)[change.row] - selection.normalised(F)[found.row]
        beyond = end + 1e-5 * (np.eye(objectives)[gaps.argmin()] - end)
        assert chosen(beyond[None])[0] != found.row
        # Nothing within a smaller box flips it: its corners on the simplex, and many weights in it.
        steps = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=objectives)))
        steps = np.vstack([steps[np.abs(steps.sum(axis=1)) < 1e-9], rng.uniform(-1, 1, (4000, objectives))])
        steps -= steps.mean(axis=1, keepdims=True)
        steps /= np.maximum(np.abs(steps).max(axis=1, keepdims=True), 1e-9)
        near = own + (1.0 - 1e-5) * change.size * steps
        assert (chosen(near[(near >= 0.0).all(axis=1)]) == found.row).all()


def test_scales_of_a_paper_are_kept():
    F = bulging(50, 3)
    weights = Weights((0.5, 0.3, 0.2), scales=(1.0, 100.0, 0.01))
    found = stability(F, weights)
    assert found.row == selection.weighted(F, weights).index
    assert found.scales == weights.scales
    same = stability(F / weights.scales, Weights(weights.weights, (1.0, 1.0, 1.0)))
    assert (same.rows, same.row) == (found.rows, found.row)
    np.testing.assert_allclose(same.shares, found.shares, atol=1e-12)


def test_choices_do_not_depend_on_units():
    F = bulging(50, 3)
    for rule in RULES:
        own, other = (stability(each, [1, 2, 3], rule=rule) for each in (F, F * [1e-3, 57.3, 1e6]))
        assert (own.rows, own.row) == (other.rows, other.row)
        np.testing.assert_allclose(own.shares, other.shares, atol=1e-9)


def test_what_is_chosen_by_all_weights_cannot_be_changed():
    for F in ([[1.0, 2.0, 3.0]], [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]], [[1.0], [2.0]]):
        for rule in RULES:
            found = stability(np.array(F), [1.0] * len(F[0]), rule=rule)
            assert (found.row, found.rows, found.shares, found.change) == (0, (0,), (1.0,), None)
            assert found.share == 1.0
            assert str(found) == "row 0 by 100 % of all weights, 1 rows by some"


def test_a_point_behind_the_others_is_chosen_by_no_weighted_sum():
    F = np.array([[0.0, 1.0], [0.6, 0.6], [1.0, 0.0]])
    assert 1 not in stability(F, [1, 1]).rows
    assert set(cells(selection.normalised(F))) == {0, 2}


def test_corners_of_cells_fill_the_triangle():
    values = selection.normalised(bulging(80, 3))
    for row, corners in cells(values).items():
        np.testing.assert_allclose(corners.sum(axis=1), 1.0, atol=1e-12)
        sums = corners @ values.T
        assert (sums[:, row] <= sums.min(axis=1) + 1e-12).all()
        assert (corners.mean(axis=0) @ values.T).argmin() == row


def test_weights_of_a_cube_are_spread_evenly():
    points = simplex(np.random.default_rng(1).random((100_000, 3)))
    assert points.min() >= 0.0
    np.testing.assert_allclose(points.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(points.mean(axis=0), 0.25, atol=3e-3)
    np.testing.assert_allclose(points.var(axis=0), 3.0 / 80.0, rtol=0.02)  # of a uniform distribution on it


def test_mistakes_are_told():
    F = bulging(5, 2)
    refused(lambda: stability(F, [1, 1], rule="topsi"), "unknown rule 'topsi'; .*did you mean 'topsis'")
    refused(lambda: stability(F, [1, 1, 1]), r"weights: expected shape \(2\), got \(3,\)")
    refused(lambda: stability(F, [-1, 1]), "weights: expected non-negative")
    refused(lambda: cells(bulging(5, 4)), "F: expected 1 to 3 objectives, got 4")


@pytest.fixture(scope="module", params=mostly_long([False, True], False), ids=["evolved", "polished"])
def polish(request):
    """Whether fronts are polished, so that they have a thousand rows."""
    return request.param


@pytest.fixture(scope="module")
def folder(tmp_path_factory, polish):
    return tmp_path_factory.mktemp("choices")


@pytest.fixture(scope="module")
def fronts(folder, polish):
    robot = Robot.from_limits(velocity=[1.6, 1.9], acceleration=[6.0, 7.0], jerk=[60.0, 80.0], names=["a", "b"])
    points = [[0.0, 0.5], [0.8, -0.4], [0.2, 0.9]]
    found = {}
    for names in (
        ("time",),
        ("time", "jerk"),
        ("time", "acceleration", "jerk"),
        ("time", "jerk", "acceleration", "peak_jerk"),
    ):
        problem = ViaPointProblem(
            robot=robot, points=points, interpolant="cubic", objectives=names, duration_bounds=(0.05, 5.0)
        )
        out = folder / f"run{len(names)}"
        sizes = {"population": 20, "generations": 6, "polish": polish}
        found[len(names)] = optimise(problem, seed=1, **sizes, progress=False, out=out)
    return found


def test_a_front_chooses_by_topsis_and_tells_how_stable_that_is(fronts):
    front = fronts[3]
    chosen = front.topsis({"jerk": 1, "time": 2, "acceleration": 1})
    assert (chosen.rule, chosen.index) == ("topsis", selection.topsis(front.F, [2, 1, 1]).index)
    assert "closeness 0." in chosen.reason
    assert front.weighted({"jerk": 1, "time": 2, "acceleration": 1}).index == front.weighted([2, 1, 1]).index
    assert (
        front.pseudo_weights({"jerk": 1, "time": 2, "acceleration": 1}).index == front.pseudo_weights([2, 1, 1]).index
    )
    for rule in RULES:
        found = front.stability([2, 1, 1], rule=rule)
        assert found.row == getattr(front, rule)([2, 1, 1]).index
        assert found == front.stability([2, 1, 1], rule=rule)
    refused(
        lambda: front.topsis(), "weights: expected one for each of time, acceleration, jerk; the problem's paper gives"
    )
    refused(lambda: front.stability({"time": 1}), "got none of acceleration")
    refused(lambda: front.topsis([0, 0, 0]), "not all zero")
    refused(lambda: front[:0].stability([1, 1, 1]), "the front is empty")


@pytest.mark.thinned(2)
@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("rule", RULES)
def test_pictures_show_the_choice_of_all_weights(fronts, count, rule):
    front = fronts[count]
    found = front.stability([1] * count, rule=rule)
    for width in ("column", "page"):
        ax = plots.weight_map(front, found, width=width)
        if count < 4:
            (told,) = (text.get_text() for text in ax.get_legend().get_texts())
            assert told == f"row {found.row}: {found.told} % of all weights"
            (star,) = (line for line in ax.lines if line.get_marker() == "*")
            at = [0.5, np.sqrt(0.75) / 3.0] if count == 3 else [0.5, 0.5]
            np.testing.assert_allclose(np.ravel(star.get_data()), at, atol=1e-12)
            shown = np.ravel(ax.collections[0].get_array())
            assert set(shown) <= set(front.F[:, 0])
            values, sizes = np.unique(shown, return_counts=True)
            areas = dict(zip(values, sizes / sizes.sum(), strict=True))
            assert areas[front.F[found.row, 0]] == pytest.approx(found.share, abs=0.02)
        else:
            shares = {f"row {row}": 100.0 * share for row, share in zip(found.rows, found.shares, strict=True)}
            labels = [label.get_text() for label in ax.get_yticklabels()]
            lengths = [bar.get_width() for bar in ax.patches]
            np.testing.assert_allclose(lengths, [shares[label.rstrip("*")] for label in labels], atol=1e-12)
            assert [label for label in labels if label.endswith("*")] == [f"row {found.row}*"]
            assert lengths == sorted(lengths, reverse=True)
        plt.close(ax.figure)


def test_pictures_of_another_front_are_refused(fronts):
    found = fronts[3].stability([1, 1, 1])
    refused(lambda: plots.weight_map(fronts[2], found), "found: expected the stability of a choice on this front")
    refused(lambda: plots.weight_map(fronts[3][:1], found), "found: expected the stability of a choice on this front")
    refused(lambda: plots.weight_map(fronts[1], found), "front: expected at least 2 objectives, the front has 1")


def shown(folder, weights):
    return trajevo("show", "run3", "--weights", weights, cwd=folder)


def test_the_command_tells_what_weights_choose(folder, fronts):
    front = fronts[3]
    done = shown(folder, "time=2,jerk=1,acceleration=1")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("weights, as given: time 0.5, acceleration 0.25, jerk 0.25\n")
    for rule in RULES:
        found = front.stability([2, 1, 1], rule=rule)
        (line,) = (line for line in done.stdout.splitlines() if line.startswith(rule))
        assert line.split()[1] == str(found.row)
    assert "weights, equal: time 0.3333" in shown(folder, "equal").stdout
    assert "weights, by entropy of shares of the sum: time 0." in shown(folder, "entropy").stdout
    (folder / "compared.csv").write_text("1,3,5\n1/3,1,2\n0.2,1/2,1\n")
    told = shown(folder, "compared.csv").stdout
    assert told.startswith("weights, by comparisons in pairs (lambda 3.0037, CI 0.0018, CR 0.0032): time 0.6483, accel")


MISTAKES = {
    "paper": "weights: the problem's paper gives none",
    "time=1": "weights: expected one for each of time, acceleration, jerk, got none of acceleration",
    "time=1,jerks=1": "unknown objective 'jerks'",
    "time=0,acceleration=0,jerk=0": "weights: expected non-negative numbers that are not all zero, got [0.0, 0.0, 0.0]",
    "time=-1,acceleration=1,jerk=1": "weights: expected non-negative numbers that are not all zero",
    "time=much,acceleration=1,jerk=1": "weights: of time: expected a number, got 'much'",
    "time=1,time=1": "weights: expected OBJECTIVE=NUMBER once for each, got 'time=1'",
    "entropie": "unknown weights 'entropie'",
    "none.csv": "weights: none.csv: no such file",
    "two.csv": "comparisons: expected 3 rows and columns, got 2 by 2",
    "ragged.csv": "ragged.csv: expected rows of equal length, got [2, 1]",
    "words.csv": "words.csv: expected a number, got 'one'",
    "empty.csv": "empty.csv: expected rows of equal length, got []",
    "contradictory.csv": "comparisons: expected a ratio of consistency of at most 0.1, got 1.23: time over jerk",
}
FILES = {
    "two.csv": "1,2\n1/2,1\n",
    "ragged.csv": "1,2\n1\n",
    "words.csv": "one,2\n1,1\n",
    "empty.csv": "\n",
    "contradictory.csv": "1,3,1/5\n1/3,1,2\n5,1/2,1\n",
}


@pytest.mark.parametrize("weights", MISTAKES)
def test_a_mistake_on_the_command_line_costs_a_sentence(folder, fronts, weights):
    if weights in FILES:
        (folder / weights).write_text(FILES[weights])
    done = shown(folder, weights)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith(f"error: {MISTAKES[weights]}")
    assert done.stderr.count("\n") == 1


def test_a_front_without_solutions_has_no_choice(folder, fronts):
    shutil.copytree(folder / "run3", folder / "empty", dirs_exist_ok=True)
    fronts[3][:0].save(folder / "empty" / "front.json")
    done = trajevo("show", "empty/front.json", "--weights", "equal", cwd=folder)
    assert done.returncode == 3
    assert "the front is empty" in done.stderr
