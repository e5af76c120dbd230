"""Robots compared: the common front is what is left of fronts solved one by one, whatever runs them."""

import json
import multiprocessing
import time
from dataclasses import replace

import moocore
import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from trajevo import (
    DaskCluster,
    InProcess,
    Processes,
    check,
    choose_robot,
    largest_payload,
    load_problem,
    load_robot,
    optimise,
)
from trajevo.study import cell
from trajevo.study.folder import StudyFolder
from trajevo.study.robots.ability import abilities, nearest_misses
from trajevo.study.robots.asked import asked_of
from trajevo.study.robots.choose import non_dominated

SMALL = {"generations": 4, "population": 12, "polish": False, "progress": False}
POSES = [
    {"position": [0.45, -0.35, 0.15], "rpy": [180.0, 0.0, 0.0]},
    {"position": [0.50, 0.0, 0.40], "rpy": [180.0, 0.0, 0.0]},
    {"position": [0.45, 0.35, 0.15], "rpy": [180.0, 0.0, 0.0]},
]
LIMITS = {"acceleration": 12.0, "jerk": 120.0}
UR5 = {"name": "ur5", "tool": "tool0", "price": "24000 EUR", "mass": 18.4, "reach": "850 mm"}
UR10 = {"name": "ur10", "tool": "tool0", "price": "32000 EUR", "mass": 28.9, "reach": 1.3}
XARM7 = {"name": "xarm7", "price": "11000 EUR", "mass": 13.7}
#: With a tool whose z axis points away from the arm, as those of the others.
TCP = {"name": "tcp", "parent": "link06", "position": [0.14, 0.0, 0.0], "rpy": [0.0, "90 deg", 0.0]}
LOADED = {"lock": {"jointGripper": 0.0}, "tool": "tcp", "tools": [TCP]}
Z1 = {"name": "z1", "price": "9000 EUR", "mass": "4300 g", **LOADED}
ALL = [UR5, UR10, XARM7, Z1]


def task(**changes):
    given = {
        "angle": "deg",
        "points": POSES,
        "duration_bounds": [0.2, 1.5],
        "objectives": ["time", "energy", "price"],
        "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.05]},
        "limits": LIMITS,
        "robots": ALL,
        "seed": 3,
    }
    return {key: value for key, value in (given | changes).items() if value is not None}


def numbers_of(choice):
    return {one.name: (one.state, one.F.tobytes(), one.best.tobytes(), one.carried) for one in choice.robots}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("robots") / "study"


@pytest.fixture(scope="module")
def found(folder):
    return choose_robot(task(), out=folder, payload=False, **SMALL)


def test_the_common_front_is_what_is_left_of_fronts_solved_one_by_one(found):
    prices = {"ur5": 24000.0, "ur10": 32000.0, "xarm7": 11000.0}
    alone = []
    for one in found.robots[:3]:
        record = one.front.record
        front = optimise(load_problem(record.name, **record.settings), seed=one.seed, **SMALL)
        assert front.F.tobytes() == one.front.F.tobytes()
        alone.append(np.column_stack([front.F, np.full(len(front), prices[one.name])]))
    expected = moocore.filter_dominated(np.concatenate(alone))
    assert len(found) == len(expected) > 10
    assert np.array_equal(found.F[np.lexsort(found.F.T)], expected[np.lexsort(expected.T)])
    for member, F, name in zip(found, found.F, found.robot, strict=True):
        assert (member.robot, tuple(member.F.values())) == (name, tuple(F))
        assert tuple(member.solution.F.values()) == tuple(F[:2])
    assert set(found.robot) == {"ur5", "xarm7"}


def test_who_is_never_the_best_is_named_with_whom(found):
    ur10 = found.robots[1]
    assert (ur10.state, ur10.beaten_by, ur10.best.any()) == ("beaten", ("ur5",), False)
    ur5 = found.robots[0].F
    assert all(((ur5 <= F).all(axis=1) & (ur5 < F).any(axis=1)).any() for F in ur10.F)
    assert "ur10 is never the best: every one of its motions is beaten by ur5" in found.sentences


def test_who_cannot_reach_is_told_with_the_nearest_miss(found):
    z1 = found.robots[3]
    assert (z1.state, z1.stopped_by, z1.front, len(z1.F)) == ("impossible", "reach", None, 0)
    assert [one.point for one in z1.misses] == [0, 1, 2]
    assert z1.reason.startswith(f"misses point 0 by {1e3 * z1.misses[0].distance:.3g} mm")
    robot = load_robot("z1", limits=LIMITS, **LOADED)
    q = np.random.default_rng(1).uniform(robot.limits.lower, robot.limits.upper, (20_000, robot.dof))
    positions, rotations = robot.tool_poses(q)
    down = np.diag([1.0, -1.0, -1.0])
    angle = 2.0 * np.arcsin(np.minimum(np.linalg.norm((rotations - down).reshape(-1, 9), axis=1) / np.sqrt(8.0), 1.0))
    for one, pose in zip(z1.misses, POSES, strict=True):  # no random posture comes nearer
        sampled = np.linalg.norm(positions - pose["position"], axis=1) + angle
        assert 0.05 < one.distance + one.angle <= sampled.min()


def test_a_pose_that_is_reached_is_not_missed():
    robot = load_robot("ur5", tool="tool0", limits=LIMITS)
    position, rotation = robot.tool_poses(np.array([[0.3, -1.2, 1.1, -1.5, -1.4, 0.2]]))
    (miss,) = nearest_misses(robot, [{"position": position[0]}])
    assert miss.distance < 1e-9
    assert miss.angle == 0.0
    assert str(replace(miss, distance=0.0123)) == "point 0 by 12.3 mm"
    assert rotation.shape == (1, 3, 3)


def test_the_largest_payload_is_that_of_the_problem_in_the_same_time(folder):
    within = choose_robot(task(), ["xarm7"], within=2.2, out=folder.with_name("within"), **SMALL)
    (xarm7,) = within.robots
    record = xarm7.front.record
    expected = largest_payload(load_problem(record.name, **record.settings), within=2.2, seed=xarm7.seed)
    assert (xarm7.carried.mass, xarm7.carried.time) == (expected.mass, expected.time)
    assert expected.time <= 2.2 * (1.0 + 1e-9)
    assert within.columns[5] == "largest payload within 2.2 s [kg]"
    (again,) = choose_robot(task(), ["xarm7"], within=2.2, out=folder.with_name("within"), **SMALL).robots
    assert again.carried == xarm7.carried
    (longer,) = choose_robot(task(), ["xarm7"], out=folder.with_name("within"), **SMALL).robots
    assert longer.carried.mass > expected.mass
    assert longer.carried.at_rest > longer.carried.mass


@pytest.mark.parametrize("payload", mostly_long([False, True], False))
@pytest.mark.parametrize("engine", mostly_long(["dask", "processes"], "dask"))
def test_a_cluster_gives_the_same_to_the_bit(found, tmp_path, engine, payload):
    made = {"dask": DaskCluster, "processes": Processes}[engine](2)
    given = SMALL | {"robots": ["ur5", "xarm7"], "payload": payload}
    own = choose_robot(task(), engine=made, out=tmp_path, **given)
    assert [one.F.tobytes() for one in own.robots] == [found.robots[k].F.tobytes() for k in (0, 2)]
    if payload:
        assert all(one.carried.mass > 2.0 for one in own.robots)
        assert numbers_of(own) == numbers_of(choose_robot(task(), **given))


def test_what_was_found_before_a_kill_stays_and_the_rest_goes_on(tmp_path):
    long = SMALL | {"generations": 100, "payload": False, "robots": ["ur5", "ur10"]}
    expected = choose_robot(task(), **long)
    place = StudyFolder(tmp_path / "study")

    def begun():
        runs = [place.cell(f"robot={name},repeat=01") for name in ("ur5", "ur10")]
        return (runs[0] / "front.json").exists() and (runs[1] / "checkpoint.npz").exists()

    child = multiprocessing.get_context("fork").Process(
        target=lambda: choose_robot(task(), out=place.folder, **long), daemon=True
    )
    child.start()
    end = time.monotonic() + 60.0
    while not begun():
        assert child.is_alive()
        assert time.monotonic() < end
        time.sleep(0.005)
    child.kill()
    child.join()
    assert not place.finished("robot=ur10,repeat=01")
    before = (place.cell("robot=ur5,repeat=01") / "front.json").stat().st_mtime_ns
    assert numbers_of(choose_robot(task(), out=place.folder, **long)) == numbers_of(expected)
    assert (place.cell("robot=ur5,repeat=01") / "front.json").stat().st_mtime_ns == before


def test_a_run_that_fails_takes_no_other_with_it(found, tmp_path, monkeypatch):
    solve = cell.optimise

    def failing(problem, *given, **settings):
        if problem.robot.name == "ur5":
            raise ZeroDivisionError("of all things")
        return solve(problem, *given, **settings)

    monkeypatch.setattr(cell, "optimise", failing)
    left = choose_robot(task(), ["ur5", "xarm7"], out=tmp_path, payload=False, **SMALL)
    assert [one.state for one in left.robots] == ["failed", "best"]
    assert left.sentences[0] == "ur5: its run failed: ZeroDivisionError: of all things"
    monkeypatch.undo()
    again = choose_robot(task(), ["ur5", "xarm7"], out=tmp_path, payload=False, **SMALL)
    assert [one.F.tobytes() for one in again.robots] == [found.robots[k].F.tobytes() for k in (0, 2)]


def test_a_search_that_finds_nothing_tells_the_limit():
    tight = task(robots=[UR5], objectives=["time", "energy"])
    times = check(abilities(asked_of(tight))[0].problem).least_times[:-1]
    least = max(one.seconds for one in times)
    close = tight | {"duration_bounds": [0.2, 1.02 * least]}
    (ur5,) = choose_robot(close, payload=False, **SMALL).robots
    assert (ur5.state, ur5.stopped_by, len(ur5.F)) == ("nothing found", next(iter(ur5.front.blocking.violations)), 0)
    assert ur5.reason == str(ur5.front.blocking)
    (none,) = choose_robot(tight | {"duration_bounds": [0.2, 0.98 * least]}, payload=False, **SMALL).robots
    assert (none.state, none.stopped_by, none.front) == ("impossible", "duration", None)
    assert "takes at least" in none.reason


def test_prices_do_not_change_a_search_and_one_objective_is_enough():
    one = choose_robot(task(objectives=["time", "price", "mass"]), payload=False, **SMALL)
    assert one.objective_names == ("time", "price", "mass")
    assert [o.unit for o in one.objectives] == ["s", "EUR", "kg"]
    assert [len(each.F) for each in one.robots] == [1, 1, 1, 0]
    assert set(one.F[:, 1]) <= {24000.0, 11000.0, 32000.0}
    assert one.least("price").robot == "xarm7"
    assert one.least("time").robot == min(one.robots[:3], key=lambda each: each.F[0, 0]).name


def test_unused_payload_counts_from_the_most_of_all_robots():
    asked = task(objectives=["time", "unused_payload"], payload={"mass": 1.0, "com": [0.0, 0.0, 0.05]})
    both = choose_robot(asked, ["ur5", "xarm7"], payload=False, **SMALL)
    ur5, xarm7 = both.robots
    most = [each.front.problem.payload_range[1] for each in (ur5, xarm7)]
    assert most[0] > most[1] > 0.0
    assert np.allclose(most[0] - xarm7.F[:, 1], most[1] - xarm7.front.F[:, 1], rtol=1e-12)  # what is carried
    assert np.array_equal(ur5.F, ur5.front.F)
    assert both.notes == (f"unused payload counts from {most[0]:.4g} kg, the most that any of these robots may carry",)
    assert both.robot.count("xarm7") == int(xarm7.best.sum())


def test_what_is_left_of_fronts_and_who_beats_the_rest():
    values = {
        "a": np.array([[1.0, 5.0], [2.0, 4.0]]),
        "b": np.array([[4.0, 1.0], [9.0, 9.0]]),
        "c": np.array([[1.5, 5.5], [4.0, 2.0], [8.0, 8.0]]),
        "a again": np.array([[1.0, 5.0]]),
        "none": np.empty((0, 2)),
    }
    best, by = non_dominated(values)
    assert {name: mask.tolist() for name, mask in best.items()} == {
        "a": [True, True],
        "b": [True, False],
        "c": [False, False, False],
        "a again": [True],  # which beats no more than its twin
        "none": [],
    }
    assert by == {"a": (), "b": (), "c": ("a", "b"), "a again": (), "none": ()}


def test_random_fronts_are_put_together_as_by_comparing_all():
    generator = np.random.default_rng(5)
    for _ in range(20):
        values = {f"r{k}": generator.integers(0, 6, (generator.integers(0, 9), 3)).astype(float) for k in range(4)}
        best, by = non_dominated(values)
        every = np.concatenate(list(values.values()))
        for name, F in values.items():
            slow = [not any((other <= row).all() and (other < row).any() for other in every) for row in F]
            assert best[name].tolist() == slow
            assert bool(by[name]) == (len(F) > 0 and not any(slow))
            left = np.concatenate([values[other][best[other]] for other in by[name]]) if by[name] else every[:0]
            assert all(((left <= row).all(axis=1) & (left < row).any(axis=1)).any() for row in F if by[name])


def test_files_tell_what_was_found(found, tmp_path):
    files = {file.name: file for file in found.save(tmp_path)}
    assert set(files) == {"robots.csv", "front.csv", "choice.json", "fronts.png", "motions.png", "choice.html"}
    told = json.loads(files["choice.json"].read_text(encoding="utf-8"))
    assert [one["robot"] for one in told["robots"]] == ["ur5", "ur10", "xarm7", "z1"]
    assert np.array_equal([[row[f"{o.name} [{o.unit}]"] for o in found.objectives] for row in told["front"]], found.F)
    rows = files["front.csv"].read_text(encoding="utf-8").splitlines()
    assert rows[0] == "robot,row,time [s],energy [J],price [EUR]"
    assert len(rows) == 1 + len(found)
    table = found.to_dataframe()
    assert table.loc[3, "stopped_by"] == "reach"
    assert np.isnan(table.loc[3, "least_time [s]"])
    page = files["choice.html"].read_text(encoding="utf-8")
    assert f"Which robot: {found.title}</h1>" in page
    assert "<h2>Which robot</h2>" in page
    assert "ur10 is never the best" in page


def test_a_choice_that_was_not_kept_needs_a_folder():
    kept_nowhere = choose_robot(task(), ["z1"], **SMALL)
    refused(kept_nowhere.save, "folder: expected one to write to, as the study was not kept")
    refused(kept_nowhere.knee, "no robot can do the task: z1 cannot do it: misses point 0 by")


def test_robots_may_be_added_later_and_none_taken_away(tmp_path):
    quick = SMALL | {"payload": False}
    few = choose_robot(task(), ["ur5"], out=tmp_path, **quick)
    more = choose_robot(task(), ["ur5", "xarm7"], out=tmp_path, **quick)
    assert more.robots[0].F.tobytes() == few.robots[0].F.tobytes()
    refused(lambda: choose_robot(task(), ["xarm7"], out=tmp_path, **quick), "has the level ur5, which is missing here")


def test_the_engine_is_checked():
    refused(
        lambda: choose_robot(task(), engine="dask"), "engine: expected InProcess, Processes or DaskCluster, got 'dask'"
    )
    refused(lambda: choose_robot(task(), within=-1.0), "within: expected a positive time")
    refused(lambda: choose_robot(task(), engine=InProcess(), popsize=3), "unknown setting of a search 'popsize'")
    assert asked_of(task()).currency == "EUR"


def test_a_robot_that_does_not_reach_may_stand_where_it_does():
    near = [{"position": [0.74, -0.1, 0.2], "rpy": [180.0, 0.0, 0.0]}, {"position": [0.77, 0.1, 0.2]}]
    light = {"mass": 0.5, "com": [0.0, 0.0, 0.03]}
    asked = task(points=near, objectives=["time", "energy"], robots=[UR5, Z1], payload=light)
    given = choose_robot(asked, ["z1"], **SMALL)
    moving = choose_robot(asked | {"base": {"moving": {"x": [0.5, 0.6]}}}, ["z1"], **SMALL)
    (fixed,), (moved,) = given.robots, moving.robots
    assert (fixed.state, fixed.stopped_by) == ("impossible", "reach")
    assert moved.state == "best"
    assert 0.5 <= moved.front.pick("least_time").base.position[0] <= 0.6
    assert 0.5 < moved.carried.mass < moved.carried.at_rest
    far = choose_robot(asked | {"base": {"moving": {"x": [-0.6, -0.5]}}}, ["z1"], **SMALL)
    assert (far.robots[0].stopped_by, far.robots[0].misses) == ("reach", ())
    assert "base.moving: expected a base from which 'z1' reaches all points" in far.sentences[0]
