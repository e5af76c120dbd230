"""Pictures of effort and payload of a run: which there are, that they show something, and that reports have them."""

import io

import matplotlib.image
import numpy as np
import pytest

from tests.helpers import refused, without_files
from trajevo import analyse, optimise, plots
from trajevo.capacity.dlcc import capacities, dlcc
from trajevo.capacity.payload_studies import Studied
from trajevo.capacity.payload_time import capacity_front
from trajevo.page.report import report
from trajevo.plots.analyses import ANALYSES
from trajevo.plots.pictures import FIGURES, PAYLOAD_FIGURES, draw_all, figures_of, save_pictures
from trajevo.problems import HybridManipulator, PointingMechanism
from trajevo.problems.hybrid_manipulator import paper_solution

SMALL = {"seed": 1, "generations": 25, "population": 20, "progress": False}


@pytest.fixture(scope="module")
def front():
    return optimise(HybridManipulator(objectives=["time", "energy", "unused_payload"]), **SMALL, polish=False)


def stems(front):
    return [stem for stem in figures_of(front, analyse(front)) if stem in PAYLOAD_FIGURES]


def test_every_picture_is_drawn_once_and_shows_something(front, tmp_path, monkeypatch):
    without_files(monkeypatch)
    analyses = analyse(front)
    pictures = draw_all(front, analyses)
    drawn = {picture.stem for picture in pictures}
    assert [picture.stem for picture in pictures] == [*figures_of(front, analyses)]
    assert drawn & {*PAYLOAD_FIGURES} == {*PAYLOAD_FIGURES} - {"payload_time", "uncertainty"}  # the mass is a variable
    assert drawn <= {*FIGURES}
    for picture in pictures:
        image = matplotlib.image.imread(io.BytesIO(picture.png))[..., :3]
        assert min(image.shape[:2]) > 300
        assert 0.02 < (image.min(axis=2) < 0.9).mean() < 0.95, f"{picture.stem} looks empty"
    files = save_pictures(pictures, tmp_path)
    assert [file.read_bytes() for file in files] == [picture.png for picture in pictures]
    page = report(front, tmp_path / "report.html", analyses=analyses, pictures=pictures).read_text(encoding="utf-8")
    assert page.count("data:image/png") == len(pictures)
    assert "<h2>Payload</h2>" in page
    assert "kg per % of the effort limit of" in page
    assert "0 to 10 kg, a rigid body fixed to the tool" in page
    assert "the payload" not in page.split("<h2>Run</h2>")[0].split("<h2>Payload</h2>")[0]


@pytest.mark.long
def test_what_has_nothing_to_show_is_left_out():
    fixed = optimise(HybridManipulator(), **SMALL, polish=False)
    assert stems(fixed) == [stem for stem in PAYLOAD_FIGURES if stem != "payload_front"]
    along_axis = optimise(HybridManipulator(payload_model="tool_axis"), **SMALL, polish=False)
    assert stems(along_axis) == ["effort", "margins", "capacities", "slowdown", "payload_time", "workspace"]
    unloaded = optimise(HybridManipulator(payload=0.0), **SMALL, polish=False)
    assert stems(unloaded) == [stem for stem in PAYLOAD_FIGURES if stem not in ("payload_front", "uncertainty")]
    assert stems(optimise(PointingMechanism(), **SMALL, polish=False)) == []


def test_a_problem_without_time_has_no_curve():
    fixed = optimise(HybridManipulator(objectives=["energy", "jerk"]), **SMALL | {"generations": 8}, polish=False)
    found = {**analyse(fixed, "short"), "payload_time": ANALYSES["payload_time"](Studied(fixed))}
    assert found["payload_time"] is None
    assert "payload_time" not in figures_of(fixed, found)
    refused(lambda: capacity_front(fixed.problem, [1.0], seed=1), "expected the time among the objectives")
    loaded = HybridManipulator(objectives=["time", "unused_payload"])
    refused(lambda: capacity_front(loaded, [1.0], seed=1), "its mass is a decision variable")


def test_a_front_of_payloads_is_drawn_over_time(front):
    ax = plots.payload_front(front)
    shown = np.asarray(ax.collections[0].get_offsets())
    np.testing.assert_allclose(shown, np.column_stack([front.F[:, 0], front.X[:, -1]]))
    assert ax.figure.axes[1].get_ylabel().startswith("energy")
    refused(lambda: plots.payload_front(front, colour="speed"), "unknown objective 'speed'")
    fixed = optimise(HybridManipulator(), **SMALL | {"generations": 2}, polish=False)
    refused(lambda: plots.payload_front(fixed), "expected a front whose payload is a variable")


def test_capacities_and_margins_are_those_that_are_computed(front):
    found = capacities(front)
    ax = plots.front_capacities(found, knee=front.knee().index)
    drawn = np.concatenate([line.get_ydata() for line in ax.lines[:-1]])
    np.testing.assert_allclose(np.sort(drawn), np.sort(found.mass))
    capacity = dlcc(HybridManipulator().rollout(paper_solution()))
    lines = {line.get_label().split(":")[0]: line.get_ydata() for line in plots.capacity_margins(capacity).lines}
    np.testing.assert_allclose(lines["screw_3"], 100.0 * capacity.margins[:, 2])
