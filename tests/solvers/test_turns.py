"""Turns of evolution and polishing under a limit of CPU time: when they come, and that a run holds what they find."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.helpers import small_problem
from trajevo import optimise, read_run, resume
from trajevo.front.hypervolume import hypervolume
from trajevo.problems import PointingMechanism
from trajevo.solvers.gradient import anchors
from trajevo.solvers.gradient.anchors import AnchorSearch
from trajevo.solvers.gradient.polish import polish, polished_between
from trajevo.solvers.run.turns import Turns
from trajevo.study.bench.suite import benchmark


def turns(cpu, polishing=(), objectives=3, found=True, terms=None, **manifest):
    books = SimpleNamespace(
        cpu_seconds=list(cpu),
        polishing=[*polishing, *[0] * (len(cpu) - len(polishing))],
        archive=SimpleNamespace(F=np.ones((int(found), objectives))),
        target=SimpleNamespace(n_obj=objectives, smooth=None, objectives=[SimpleNamespace(terms=terms)] * objectives),
    )
    given = {"cpu_time": 10.0, "polish": True, "polish_every": None} | manifest
    return Turns(books, SimpleNamespace(**given))


def test_a_short_polish_comes_after_six_generations_and_when_half_of_its_time_has_passed():
    first = 0.1 * np.arange(1, 7)
    assert [turns(first[:count]).due for count in (1, 5, 6)] == [False, False, True]
    # Evaluations of the first generation found the first population.
    polished = [[500, *[0] * 5, 70]]
    assert turns([*first, 1.6], *polished).taken == (7,)
    assert not turns([*first, 1.6, 2.0], *polished).due
    assert turns([*first, 1.6, 2.2], *polished).due
    assert turns([*first, 1.6, 2.2], *polished).left == pytest.approx(7.8)


def test_a_maximum_alone_is_descended_by_its_terms_after_the_first_generation():
    alone = {"objectives": 1, "terms": len}
    assert turns([0.1], **alone).due
    assert not turns([0.1], **alone, found=False).due
    assert not turns([0.1], objectives=2, terms=len).due
    assert not turns([0.1], objectives=1).due
    assert [turns([0.1, 1.1, now], [0, 70], **alone).due for now in (1.5, 1.7)] == [False, True]


def test_at_most_half_of_the_time_is_kept_for_the_whole_polish():
    cpu, polished = [*0.1 * np.arange(1, 7), 1.6], [0] * 6 + [70]
    assert turns(cpu).share == 0.5
    assert turns(cpu, polished).share == pytest.approx(1.0 - 4.0 * 1.0 / 10.0)
    assert turns(cpu, polished, cpu_time=4.0).share == 0.5
    # The least of one objective is sought in all valleys, however long that takes.
    assert turns(cpu, polished, objectives=1).share == 0.5
    assert turns(cpu, polish=False).share == 1.0


@pytest.mark.parametrize(
    "without", [{"cpu_time": None}, {"polish": False}, {"polish_every": 3}, {"found": False}], ids=str
)
def test_there_are_no_turns_without_limit_or_gradients_or_a_front(without):
    assert not turns(0.1 * np.arange(1, 21), **without).due


def test_a_run_holds_what_short_polishes_find():
    made = PointingMechanism()
    given = {"seed": 1, "population": 20, "generations": 30, "progress": False}
    front = optimise(made, cpu_time=60.0, **given)
    taken = front.run.settings["polished before"]
    assert taken[0] == 7
    assert taken[-1] <= 30
    volumes, size = front.history.hypervolume, front.history.front_size
    plain = optimise(made, polish=False, **given)
    assert volumes[6] > plain.history.hypervolume[-1] > plain.history.hypervolume[6]
    assert size[6] > 20
    np.testing.assert_array_equal(front.F, made.evaluate(front.X, return_values_of=["F"]))
    assert (front.G <= 0.0).all()
    assert "polished before" not in plain.run.settings


def test_an_interrupted_run_goes_on_after_the_turns_it_has_taken(tmp_path, stopped_after):
    settings = {"seed": 2, "population": 16, "generations": 30, "cpu_time": 60.0, "progress": False}
    stopped_after(13)
    first = optimise(PointingMechanism(), out=tmp_path / "run", **settings)
    assert (first.run.interrupted, first.run.settings["polished before"][0]) == (True, 7)
    read = read_run(tmp_path / "run")
    np.testing.assert_array_equal(read.F, first.F)
    stopped_after(None)
    last = resume(tmp_path / "run", progress=False)
    # What was evaluated before is as it was; nothing of it is lost.
    assert last.run.cpu_seconds[:13] == first.run.cpu_seconds
    assert last.history.evaluations[:13] == first.history.evaluations
    assert last.run.settings["polished before"][: len(first.run.settings["polished before"])][0] == 7
    corner = np.array(first.history.reference_point)
    assert hypervolume(last.F, corner) >= hypervolume(first.F, corner)


def test_what_a_short_polish_adds_is_new_feasible_and_ends_when_it_is_told_to():
    made = small_problem()
    front = optimise(made, seed=1, population=16, generations=5, polish=False, progress=False)
    X, F, G, cost = polished_between(front, seed=1, cpu_time=60.0)
    assert cost > len(X) > 0
    known = {row.tobytes() for row in front.X}
    assert not known & {row.tobytes() for row in X}
    np.testing.assert_array_equal(F, made.evaluate(X, return_values_of=["F"]))
    assert (G <= 0.0).all()
    corner = np.array(front.history.reference_point)
    assert hypervolume(np.concatenate([front.F, F]), corner) > hypervolume(front.F, corner)
    assert polished_between(front, seed=1, cpu_time=60.0, stop=lambda: True)[0].shape == (0, made.n_var)


def test_the_best_of_the_first_descents_is_told_before_the_search_ends(monkeypatch):
    monkeypatch.setattr(anchors, "_KICKS", 1)
    made = benchmark("luus1993").problem()
    front = optimise(made, seed=1, population=20, generations=3, polish=False, progress=False)
    told = []

    def found(early):
        search = AnchorSearch(made, np.ones(1), 1, lambda gradients, _: gradients > 1000, early=early)
        return search.run(front.X[0], front.X, explore=True).x

    best = found(told.append)
    assert len(told) > 1
    values, limits = made.evaluate(np.stack([*told, best]), return_values_of=["F", "G"])
    assert (limits <= 0.0).all()
    assert values[-1, 0] <= values[:-1, 0].min() * (1.0 + 1e-12)  # but for rounding
    assert values[:-1, 0].min() < front.F[0, 0]
    np.testing.assert_array_equal(found(None), best)


def test_a_whole_polish_does_not_depend_on_turns():
    front = optimise(small_problem(), seed=1, population=16, generations=5, polish=False, progress=False)
    before = polish(front, members=3, rounds=1).front.F
    polished_between(front, seed=1, cpu_time=60.0)
    np.testing.assert_array_equal(polish(front, members=3, rounds=1).front.F, before)
