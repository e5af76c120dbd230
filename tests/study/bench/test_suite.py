"""Problems of the suite against what every problem must have."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from trajevo.errors import InvalidInputError, UnknownNameError
from trajevo.study.bench.reference import ReferenceFile
from trajevo.study.bench.score import violation_of
from trajevo.study.bench.suite import bench_folder, benchmark, benchmarks

NAMES = benchmarks()

#: What a folder may hold beside its task and reference: what the task names.
BESIDE = {".urdf", ".csv"}


def test_the_suite_has_at_least_sixteen_problems():
    assert len(NAMES) >= 16
    assert list(NAMES) == sorted(NAMES)
    assert set(NAMES) == {folder.name for folder in bench_folder().iterdir() if folder.is_dir()}


@pytest.mark.parametrize("name", NAMES)
def test_a_folder_holds_a_task_and_a_reference_and_what_the_task_names(name):
    of = benchmark(name)
    files = {file.name for file in of.folder.iterdir()}
    task = of.folder / "task.toml"
    assert "reference.json" in files
    assert task.is_file() == (of.told.registered is None)
    others = files - {"task.toml", "reference.json"}
    assert {Path(other).suffix for other in others} <= BESIDE
    assert all(other in task.read_text(encoding="utf-8") for other in others)
    assert re.fullmatch(r"[a-z0-9_]+", name)


@pytest.mark.parametrize("name", NAMES)
def test_a_problem_says_where_it_and_its_numbers_are_from(name):
    of = benchmark(name)
    assert of.name == name
    for text in (of.title, of.source, of.told.found_by):
        assert text.strip() == text
        assert len(text.splitlines()) == 1
    assert len(of.title) <= 120
    for one in of.published:
        assert one.objective in of.told.objectives
        assert one.source
        assert one.unit == of.told.units[of.told.objectives.index(one.objective)]
        assert one.basis == "printed" or one.note, "what is not printed says what it is worth"
        by_a_solver = any(word in one.source for word in ("SLSQP", "Ipopt", "closed form", "toppra", "Drake"))
        assert (one.basis == "computed") == by_a_solver


@pytest.mark.parametrize("name", NAMES)
def test_a_box_holds_the_best_known_set(name):
    told = benchmark(name).told
    ideal, corner, values = (np.array(each) for each in (told.ideal, told.reference_point, told.values))
    assert (ideal < corner).all()
    assert (values >= ideal).all()
    assert (values < corner).all()
    assert len(told.variables) == len(values) > 0
    assert told.kind != "least" or len(values) == 1
    if told.kind == "front":
        assert len(values) >= 20
        order = np.lexsort(values.T[::-1])
        np.testing.assert_array_equal(order, np.arange(len(values)))
        worse = (values[:, None] >= values).all(axis=2) & (values[:, None] > values).any(axis=2)
        assert not worse.any()


@pytest.mark.parametrize("name", NAMES)
def test_what_confirms_a_published_value_does(name):
    told = benchmark(name).told
    for one in told.published:
        if one.tolerance is not None:
            best = min(values[told.objectives.index(one.objective)] for values in told.values)
            assert best == pytest.approx(one.value, rel=one.tolerance), one


@pytest.mark.parametrize("name", [name for name in NAMES if len(benchmark(name).told.variables) < 10])
def test_a_least_value_is_found_again_by_its_problem(name):
    of = benchmark(name)
    np.testing.assert_allclose(of.reference.values, of.told.values, rtol=1e-9)


def excess_of(certificates):
    """Greatest share by which a value that is exhibited exceeds its limit."""
    return max(row.exhibited_share - 1.0 for certificate in certificates for row in certificate.rows)


@pytest.mark.parametrize("name", ["lin1983", "piazzi2000", "planar_2r_torque_speed", "luus1993", "guo2016_payload"])
def test_best_known_sets_are_certified_or_told_not_to_be(name):
    reference = benchmark(name).reference
    violated = [certificate for certificate in reference.certificates() if certificate.violated]
    assert reference.proven == (name != "guo2016_payload")
    assert (not violated) == reference.proven


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("gemini_path", "s_path")])
def test_all_best_known_sets_are_certified_but_for_a_hundredth_between_samples(name):
    reference = benchmark(name).reference
    certificates = reference.certificates()
    if reference.kind == "capacity":  # payloads of motions that are given, whatever their speeds
        efforts = [row for certificate in certificates for row in certificate.rows if row.quantity == "effort"]
        assert efforts
        assert not any(row.exhibited_share > 1.0 for row in efforts)
    elif reference.proven:
        assert not any(certificate.violated for certificate in certificates)
    elif name == "cops_robot_arm":  # its only limits are its own constraint, of which certificates know nothing
        assert not any(certificate.rows for certificate in certificates)
        assert violation_of(benchmark(name), reference.variables, reference.values)[0] < 1e-3
    else:
        assert excess_of(certificates) < 0.02


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_every_best_known_set_is_found_again_by_its_problem(name):
    of = benchmark(name)
    reference = of.reference
    np.testing.assert_allclose(reference.values, of.told.values, rtol=1e-9)
    assert reference.objectives == of.told.objectives
    assert 0.0 < reference.hypervolume(reference.values) <= 1.0


def test_the_least_of_the_two_rods_is_near_that_of_any_motion():
    """2.98 s for any motion, on which Ipopt agrees (2.98235 s); 3.17587 s on the cubic curve at samples alone."""
    cubic, free = (benchmark(name).told.values[0][0] for name in ("luus1993", "luus1993_bspline"))
    assert 3.17587 < cubic == pytest.approx(3.17727, abs=1e-5)
    assert 2.98235 < free < cubic


def test_the_least_of_the_level_links_is_near_that_of_any_motion():
    """0.3917 s for any motion; direct transcription in 120 intervals by Ipopt gives 0.39186 s."""
    (found,) = benchmark("dissanayake1991").told.values[0]
    assert 0.3917 < found < 1.01 * 0.3917


@pytest.mark.parametrize(
    ("name", "time", "mass"),
    [
        ("planar_2r_payload", 1.0, 3.3607215),
        ("planar_2r_payload", 0.6, 0.7835941),
        ("planar_2r_torque_speed", 1.0, 2.1631074),
        ("planar_2r_torque_speed", 0.6, 0.0749228),
    ],
)
def test_the_planar_arm_carries_what_closed_forms_say(name, time, mass):
    """Capacities from closed forms at 400,000 instants of the same motion."""
    problem = benchmark(name).problem()
    G = problem.evaluate(np.array([[time, mass * (1.0 - 1e-4)], [time, mass * (1.0 + 1e-6)]]), return_values_of=["G"])
    assert (G[0] <= 0.0).all()
    assert G[1].max() > 0.0


def copied(tmp_path, name="lin1983"):
    folder = tmp_path / name
    shutil.copytree(bench_folder() / name, folder)
    return folder / "reference.json"


def changed(file, **keys):
    file.write_text(json.dumps(json.loads(file.read_text()) | keys))


def test_a_problem_is_added_with_one_task_and_one_reference(tmp_path):
    copied(tmp_path)
    (tmp_path / "lin1983").rename(tmp_path / "mine")
    assert benchmarks(tmp_path) == ("mine",)
    mine = benchmark("mine", tmp_path)
    assert mine.reference.values[0, 0] == benchmark("lin1983").told.values[0][0]
    assert mine.statement().objectives == ("time",)
    assert mine.search.population == 60


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"registered": {"name": "pick-place"}}, "registered: expected none beside task.toml"),
        ({"kind": "best"}, "kind: input should be 'front', 'least' or 'capacity'"),
        ({"units": ["s", "s"]}, "units: expected one for each of 1 objectives, got 2"),
        ({"colour": "red"}, "colour: extra inputs are not permitted"),
    ],
)
def test_a_file_that_says_something_else_is_refused(tmp_path, keys, told):
    changed(copied(tmp_path), **keys)
    with pytest.raises(InvalidInputError, match=told):
        benchmark("lin1983", tmp_path)


def test_unknown_names_and_missing_files_are_told(tmp_path):
    with pytest.raises(UnknownNameError, match="lin1983"):
        benchmark("lin1984")
    file = copied(tmp_path)
    (file.parent / "task.toml").unlink()
    with pytest.raises(InvalidInputError, match=r"task.toml: no such file"):
        benchmark("lin1983", tmp_path)
    file.write_text("{")
    with pytest.raises(InvalidInputError, match="cannot be read as JSON"):
        ReferenceFile.read(file)
