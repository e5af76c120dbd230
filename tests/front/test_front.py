import json

import numpy as np
import pytest

from tests.helpers import impossible, small_problem
from trajevo import Front, TrajevoError, load_robot, optimise
from trajevo.problems import HybridManipulator, PointingMechanism

SMALL = {"seed": 1, "generations": 10, "population": 20, "progress": False}


@pytest.fixture(scope="module")
def front() -> Front:
    return optimise(PointingMechanism(), **SMALL, polish=False)


def test_a_front_comes_back_equal(front, tmp_path):
    front.save(tmp_path / "front.json")
    back = Front.load(tmp_path / "front.json")
    assert back == front
    for name in "XFG":
        np.testing.assert_array_equal(getattr(back, name), getattr(front, name))
    np.testing.assert_array_equal(back.knee().trajectory.coefficients, front.knee().trajectory.coefficients)


def test_an_empty_front_comes_back_equal(tmp_path):
    problem = small_problem(constraints=(impossible(load_robot("pointing_mechanism"), 0.1),))
    empty = optimise(problem, **SMALL, polish=False)
    empty.save(tmp_path / "front.json")
    assert Front.load(tmp_path / "front.json") == empty


def test_fronts_differ_when_a_number_does(front, tmp_path):
    front.save(tmp_path / "front.json")
    content = json.loads((tmp_path / "front.json").read_text())
    content["F"][0][0] = np.nextafter(content["F"][0][0], 99.0)
    (tmp_path / "front.json").write_text(json.dumps(content))
    assert Front.load(tmp_path / "front.json") != front


def test_the_file_describes_itself(front, tmp_path):
    front.save(tmp_path / "front.json")
    content = json.loads((tmp_path / "front.json").read_text())
    assert content["format"] == "trajevo front"
    assert [o["unit"] for o in content["problem"]["objectives"]] == ["s", "rad/s^2", "rad/s^3"]
    assert content["problem"]["settings"]["interpolant"] == "smooth"
    assert content["run"]["seed"] == 1
    assert set(content["run"]["versions"]) >= {"python", "pymoo", "pin", "numpy", "trajevo"}


def test_solutions_name_their_numbers(front):
    best = front.knee()
    assert best.F["time"] == pytest.approx(best.x.sum(), rel=1e-12)
    assert best.F["time"] == pytest.approx(best.trajectory.duration[0], rel=1e-12)
    assert set(best.G) == set(front.problem.constraint_names)
    assert max(best.G.values()) <= 0.0
    assert best.rollout.robot.name == "pointing_mechanism"
    assert best.reason


@pytest.mark.parametrize("rule", ["knee", "utopia", "least_time", "least_acceleration", "least_jerk", "3"])
def test_solutions_are_picked_by_name(front, rule):
    assert front.pick(rule).rule == ("row" if rule == "3" else rule)


def test_least_and_weights(front):
    assert front.least("time").index == 0
    assert front.weighted([1, 0, 0]).index == 0
    assert front.pseudo_weights([1, 1, 1]).F["time"] > front.least("time").F["time"]


@pytest.mark.parametrize("rule", ["best", "least_energy", "-1", "100000", ""])
def test_unknown_solutions_list_the_known(front, rule):
    with pytest.raises(TrajevoError, match="known: a row from 0 to .*knee, least_acceleration"):
        front.pick(rule)
    with pytest.raises(TrajevoError, match="unknown objective 'energy'; known: acceleration, jerk, time"):
        front.least("energy")


def test_arrays_are_read_only(front):
    with pytest.raises(ValueError, match="read-only"):
        front.F[0, 0] = 0.0
    with pytest.raises(AttributeError):
        front.F = None


def test_a_hand_made_problem_must_be_passed_again(tmp_path):
    problem = small_problem()
    made = optimise(problem, **SMALL, polish=False)
    made.save(tmp_path / "front.json")
    alone = Front.load(tmp_path / "front.json")
    with pytest.warns(UserWarning, match="as recorded, not checked: its problem 'trajectory problem' is not a reg"):
        assert alone.knee().F == made.knee().F
    with pytest.raises(TrajevoError, match="is not a registered one; pass it as problem="):
        _ = alone.knee().trajectory
    assert Front.load(tmp_path / "front.json", problem=problem).knee().trajectory.duration > 0.0
    other = Front.load(tmp_path / "front.json", problem=PointingMechanism())
    with pytest.raises(TrajevoError, match="differs from the one that made this front"):
        _ = other.problem


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: "", "is no front of trajevo"),
        (lambda text: text[:1000], "is no front of trajevo"),
        (lambda text: text.replace('"trajevo front"', '"something else"'), "format: "),
        (lambda text: text.replace('"version": 1', '"version": 99'), "version: "),
        (lambda text: text.replace('"run"', '"ruin"'), "ruin|run"),
        (lambda text: text.replace('"seed": 1', '"seed": "one"'), "run.seed: "),
        (lambda text: text.replace('"G": [\n  [\n   -', '"G": [\n  [\n   '), "expected feasible points"),
        (
            lambda text: text.replace('"generations": 10,', '"generations": 12,'),
            "expected a history of at least 12 generations",
        ),
        (lambda text: text.replace('"X": [', '"X": [[1.0],'), "expected [0-9]+ rows of 4 numbers in X"),
    ],
)
def test_files_that_are_no_front_are_refused(front, tmp_path, change, says):
    file = tmp_path / "front.json"
    front.save(file)
    file.write_text(change(file.read_text()))
    with pytest.raises(TrajevoError, match=says) as caught:
        Front.load(file)
    assert str(file) in str(caught.value)


def test_files_that_cannot_be_read_or_written_are_named(front, tmp_path):
    with pytest.raises(TrajevoError, match=r"none\.json: cannot be read: No such file"):
        Front.load(tmp_path / "none.json")
    with pytest.raises(TrajevoError, match=r"front\.json: cannot be written"):
        front.save(tmp_path / "no" / "such" / "front.json")
    (tmp_path / "folder").mkdir()
    with pytest.raises(TrajevoError, match="folder: cannot be written"):
        front.save(tmp_path / "folder")
    assert not (tmp_path / "folder.part").exists()
    for nonsense in (5, "", "/", None):
        with pytest.raises(TrajevoError, match="expected the path of a file"):
            Front.load(nonsense)
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(TrajevoError, match="is no front of trajevo: not UTF-8"):
        Front.load(tmp_path / "binary")


def test_the_weighted_best_is_the_paper_s_unless_weights_are_given():
    arguments = {"seed": 1, "generations": 4, "population": 16, "progress": False, "polish": False}
    problem = HybridManipulator()
    front = optimise(problem, **arguments)
    assert front.weighted().index == front.weighted(problem.paper_weights).index
    other = optimise(PointingMechanism(), **arguments)
    said = "weights: expected one for each of time, acceleration, jerk; the problem's paper gives none"
    with pytest.raises(TrajevoError, match=said):
        other.weighted()
