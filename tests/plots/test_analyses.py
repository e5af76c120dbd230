"""What is computed for a report: once, by name, kept beside the front; drawing optimises nothing."""

import dataclasses
import json
import warnings

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.helpers import refused, without_files
from trajevo import Front, analyse, base_map, load_task, optimise
from trajevo.capacity.slowdown import slowdown_curve
from trajevo.dynamics.rollout import Rollout
from trajevo.formulation.problem import TrajectoryProblem
from trajevo.front.records import ProblemRecord
from trajevo.page.report import report
from trajevo.plots import analyses as module
from trajevo.plots import pictures
from trajevo.plots.analyses import ANALYSES, KINDS, analysed
from trajevo.plots.analyses_file import read_analyses, write_analyses
from trajevo.plots.pictures import PAYLOAD_FIGURES, VIEWS, draw_all, figures_of, save_pictures
from trajevo.problems import PickAndPlace, PointingMechanism
from trajevo.trajectory.polynomial import PolynomialBatch

SMALL = {"seed": 1, "generations": 12, "population": 20, "progress": False, "polish": False}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A front's file of an arm that carries something and has rivals, the file of its analyses, and all of them."""
    folder = tmp_path_factory.mktemp("kept")
    front = optimise(PickAndPlace(payload=2.5), **SMALL)
    front.save(folder / "front.json")
    return folder / "front.json", folder / "analyses.npz", analyse(front, file=folder / "analyses.npz")


@pytest.fixture
def no_solver(monkeypatch):
    """Whatever optimises raises."""

    def never(*_, **__):
        raise AssertionError("something was optimised")

    monkeypatch.setattr("scipy.optimize.minimize", never)
    monkeypatch.setattr("scipy.optimize.linprog", never)


def same(one, other):
    """Whether two analyses hold the same numbers, to the bit."""
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, Rollout):
        return same(one.trajectory, other.trajectory)
    if isinstance(one, PolynomialBatch):
        return same(one.breaks, other.breaks) and same(one.coefficients, other.coefficients)
    if dataclasses.is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, field.name), getattr(other, field.name))
            for field in dataclasses.fields(one)
            if field.compare
        )
    if isinstance(one, dict):
        return [*one] == [*other] and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other or one != one


def test_what_is_kept_comes_back_to_the_bit_and_is_not_computed_again(kept, no_solver, monkeypatch):
    file, analyses_file, computed = kept
    assert set(computed) == {*ANALYSES} - {"base_map"}  # of bases that move
    monkeypatch.setattr(module, "ANALYSES", {})  # nothing to compute with
    read = analyse(Front.load(file), file=analyses_file)
    assert [*read] == [*computed]
    for name in computed:
        assert same(read[name], computed[name]), name
    assert read["rivals"][0].rollout.robot.name == "puma560"


def test_payload_pictures_of_an_arm_with_friction_and_a_load_off_centre(kept):
    file, _, found = kept
    stems = [stem for stem in figures_of(Front.load(file), found) if stem in PAYLOAD_FIGURES]
    assert stems[1:] == [*PAYLOAD_FIGURES[2:]]


def test_what_holds_at_the_full_limits_comes_back_too(kept, tmp_path):
    front = Front.load(kept[0])
    rollout = front.knee().rollout
    margin = dataclasses.replace(rollout.robot.limits, effort=0.8 * rollout.robot.limits.effort)
    curve = slowdown_curve(dataclasses.replace(rollout, kept_limits=margin), [0.0, 1.0])
    assert curve.at_full_limits is not None
    write_analyses(tmp_path / "curve.npz", front, {"slowdown": curve})
    assert same(read_analyses(tmp_path / "curve.npz", front)["slowdown"], curve)


def test_a_report_makes_the_problem_once_and_decodes_a_few_rows(kept, tmp_path, no_solver, monkeypatch):
    file, analyses_file, _ = kept
    counted = {"decode": 0, "record": 0}
    decode, record = TrajectoryProblem.decode, ProblemRecord.of.__func__

    def decoding(self, x):
        counted["decode"] += 1
        return decode(self, x)

    def recording(cls, problem):
        counted["record"] += 1
        return record(cls, problem)

    monkeypatch.setattr(TrajectoryProblem, "decode", decoding)
    monkeypatch.setattr(ProblemRecord, "of", classmethod(recording))
    blank = pictures.Picture("blank", "blank", b"").png
    monkeypatch.setattr(
        pictures, "_png", lambda figure, made_for="": (plt.close(figure), blank)[1]
    )  # laid out, not drawn
    without_files(monkeypatch)
    front = Front.load(file)
    found = analyse(front, file=analyses_file)
    report(front, tmp_path / "full.html", analyses=found, pictures=draw_all(front, found))
    # Once to compare the numbers on record, twice for how far they are known; all motions of the page at once, and each
    # choice for its certificate and files.
    assert counted == {"decode": 3 + 2 + len(front.choices()), "record": 1}
    monkeypatch.setattr(ProblemRecord, "of", classmethod(record))
    front, counted["decode"] = Front.load(file), 0
    report(front, tmp_path / "short.html", analyses=analyse(front, "short"))
    # What holds the knee back takes three: the number of its segments, an example of its terms, and the gradients.
    assert counted["decode"] <= 3 + 2 + 2 * len(front.choices()) + 3


def test_what_is_missing_is_computed_and_added(kept, tmp_path, monkeypatch):
    file, _, _ = kept
    front, own = Front.load(file), tmp_path / "analyses.npz"
    assert [*analyse(front, "none", file=own)] == []
    assert not own.exists()
    short = analyse(front, "short", file=own)
    assert {*short} == {*KINDS["short"]} == {*read_analyses(own, front)}
    monkeypatch.setattr(module, "KINDS", KINDS | {"full": (*KINDS["short"], "uncertainty")})
    monkeypatch.setitem(module.ANALYSES, "certificate", None)
    assert {*analyse(front, file=own)} == {*KINDS["short"], "uncertainty"} == {*read_analyses(own, front)}


def test_of_another_front_nothing_is_read(kept):
    file, analyses_file, _ = kept
    front = Front.load(file)
    fewer = dataclasses.replace(front, X=front.X[1:], F=front.F[1:], G=front.G[1:])
    assert fewer.digest != front.digest
    assert read_analyses(analyses_file, fewer) == {}
    assert read_analyses(analyses_file.with_name("none.npz"), front) == {}
    before = analyses_file.read_bytes()
    found = analyse(fewer, "short", file=analyses_file)
    assert same(found["certificate"], analyse(fewer, "short")["certificate"])
    assert {*read_analyses(analyses_file, fewer)} == {*KINDS["short"]}
    assert read_analyses(analyses_file, front) == {}
    analyses_file.write_bytes(before)


def _without_a_field(content):
    about = json.loads(str(content["about"]))
    del about["analyses"]["effort"]["fields"]["limit"]
    return content | {"about": np.array(json.dumps(about))}


def _of_an_unknown_record(content):
    about = json.loads(str(content["about"]))
    about["analyses"]["effort"]["record"] = "Popen"
    return content | {"about": np.array(json.dumps(about))}


@pytest.fixture(scope="module")
def short(kept, tmp_path_factory):
    """The content of the file of a short report's analyses, and these."""
    file = tmp_path_factory.mktemp("short") / "analyses.npz"
    found = analyse(Front.load(kept[0]), "short", file=file)
    return file.read_bytes(), dict(found)


@pytest.mark.parametrize("damage", ["cut", "text", "empty", _without_a_field, _of_an_unknown_record])
def test_a_damaged_file_is_told_and_computed_again(kept, short, tmp_path, damage):
    file, _, _ = kept
    front, own = Front.load(file), tmp_path / "analyses.npz"
    content, whole = short
    own.write_bytes(content)
    if callable(damage):
        with np.load(own) as content:
            np.savez(own, **damage(dict(content)))
    else:
        own.write_bytes({"cut": own.read_bytes()[:-200], "text": b"analyses", "empty": b""}[damage])
    with pytest.warns(UserWarning, match=r"analyses.npz: analyses that were kept cannot be read") as told:
        again = analyse(front, "short", file=own)
    assert len(told) == 1
    assert "\n" not in str(told[0].message)
    assert same(dict(again), whole)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert same(dict(analyse(front, "short", file=own)), whole)


def test_where_nothing_can_be_kept_a_report_is_made_all_the_same(kept, tmp_path):
    front = Front.load(kept[0])
    with pytest.warns(UserWarning, match="cannot be written: No such file or directory; analyses are not kept"):
        assert {*analyse(front, "short", file=tmp_path / "none" / "analyses.npz")} == {*KINDS["short"]}


def test_only_what_suits_a_problem_is_computed(kept):
    pointing = optimise(PointingMechanism(), **SMALL)
    assert analysed(pointing) == analysed(pointing, "short") == ("certificate", "exchange_rates")
    assert analysed(Front.load(kept[0]), "none") == ()
    refused(lambda: analyse(pointing, "long"), "unknown report 'long'; known: full, none, short")


def test_pictures_are_drawn_once_for_their_front(kept, tmp_path, no_solver, monkeypatch):
    file, _, _ = kept
    front = Front.load(file)
    drawn = draw_all(front, views=False)
    save_pictures(drawn, tmp_path / "plots")
    (tmp_path / "plots" / "front.png").write_bytes(drawn[0].png[:-50])  # cut off
    (tmp_path / "plots" / "parallel.png").write_bytes(drawn[2].png)  # another picture of this front
    (tmp_path / "plots" / "profiles.png").write_text("mine")
    made = []
    monkeypatch.setattr(pictures, "_png", lambda figure, made_for: (plt.close(figure), made.append(1), drawn[0].png)[2])
    again = draw_all(front, kept=tmp_path / "plots", views=False)
    assert [picture.stem for picture in again] == [picture.stem for picture in drawn]
    assert len(made) == 3
    fewer = dataclasses.replace(front, X=front.X[1:], F=front.F[1:], G=front.G[1:])
    draw_all(fewer, kept=tmp_path / "plots", views=False)
    assert len(made) == 3 + len(drawn)


def test_views_in_space_are_drawn_when_asked_for(kept, tmp_path, monkeypatch):
    front, png = Front.load(kept[0]), pictures._png

    def views_alone(figure, made_for=""):
        return png(figure, made_for) if any(ax.name == "3d" for ax in figure.axes) else b""

    monkeypatch.setattr(pictures, "_png", views_alone)
    every, few = (draw_all(front, kept=tmp_path, views=views) for views in (True, False))
    assert {picture.stem for picture in every} - {picture.stem for picture in few} == set(VIEWS) - {
        "visits"  # of problems that choose an order or postures
    }
    save_pictures([picture for picture in every if picture.stem == "front_3d"], tmp_path)
    again = [picture.stem for picture in draw_all(front, kept=tmp_path, views=False)]
    assert set(again) == {picture.stem for picture in few} | {"front_3d"}


def test_an_interrupted_computation_keeps_what_it_has(kept, tmp_path, monkeypatch):
    front, file, begun = Front.load(kept[0]), tmp_path / "analyses.npz", []

    def stopped(name):
        begun.append(name)
        if name == "rivals":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        analyse(front, file=file, begin=stopped)
    names = list(analysed(front))
    assert begun == names[: names.index("rivals") + 1]
    assert len(begun) > 2
    assert list(read_analyses(file, front)) == begun[:-1]
    again = []
    analyse(front, "short", file=file, begin=again.append)
    assert {*again} == {*KINDS["short"]} - {*begun[:-1]} < {*KINDS["short"]}


#: What a file keeps of a map; the problem is that of the front.
KEPT = ("axes", "columns", "rows", "objective", "unit", "least", "missed", "X")


def test_a_map_of_bases_belongs_to_a_full_report_of_a_base_that_moves_and_is_kept(tmp_path):
    problem = load_task("ur5_base").problem
    front = optimise(problem, **SMALL | {"generations": 2})
    assert "base_map" in analysed(front)
    assert "base_map" not in analysed(front, "short")
    found = base_map(problem, cells=2)
    write_analyses(tmp_path / "kept.npz", front, {"base_map": found})
    (read,) = read_analyses(tmp_path / "kept.npz", front).values()
    assert read.problem is front.problem
    assert all(same(getattr(read, name), getattr(found, name)) for name in KEPT)
    assert read.best == found.best
    assert "base_map" in figures_of(front, {"base_map": read})
