"""Proof files: what certify claims is proven again by a program that knows nothing of trajevo, and nothing else is."""

import ast
import copy
import dataclasses
import json
import math
import subprocess
import sys
import tomllib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from jsonschema import Draft202012Validator

from tests.helpers import UNDRAWN, mostly_long, refused, trajevo
from trajevo import ViaPointProblem, ViaPoints, analyse, certify, load_robot, optimise
from trajevo.cli.proof.command import print_proof
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.exporters.samples import proof_schema
from trajevo.plots.analyses_file import read_analyses
from trajevo.problems import HybridManipulator, TimeJerkReparameterisation
from trajevo.problems.hybrid_manipulator import paper_solution
from trajevo.robot.joints import Friction
from trajevo.robot.payload import Payload, carrying
from trajevo.trajectory.interpolants import CubicSpline, QuinticSpline, SepticSpline
from trajevo.verification import check_proof, proof_file
from trajevo.verification.check_proof import TERMS, ZERO, BadFileError, Tube, check
from trajevo.verification.proof_file import CHECKED, digest

PROGRAM = Path(check_proof.__file__)
ROOT = Path(__file__).parents[2]
FREE = {"acceleration": np.inf, "jerk": np.inf}
FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
SPLINES = (CubicSpline, QuinticSpline, SepticSpline)
NAMES = ("ur5", "panda", "hybrid_manipulator")
SEEDS = {"ur5": (0, 1), "panda": (0, 1), "hybrid_manipulator": (1, 0), "puma560": (0, 1)}
#: Points of a path [rad].
WAY = 0.6 * np.sin(np.linspace(0.0, 1.0, 12)[:, None] * [1.5, 2.0, 1.0, 2.5, 1.2, 0.8] + 0.3 * np.arange(6))


@pytest.fixture(scope="module")
def robots():
    return {
        "ur5": load_robot("ur5", tool="tool0", limits={"acceleration": 15.0, "jerk": 150.0}),
        "panda": load_robot("panda", lock=FINGERS, limits=FREE, tool="panda_hand"),
        "hybrid_manipulator": load_robot("hybrid_manipulator"),
        "fingers": load_robot("panda", limits=FREE, tool="panda_hand"),
        "puma560": load_robot("puma560", limits={"jerk": 2000.0}),
    }


def moving(robot, seed):
    """A random motion through four points, fast or slow, with or without a load."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limits.lower, -2.5), np.minimum(robot.limits.upper, 2.5)
    points = 0.5 * (lower + upper) + rng.uniform(-0.3, 0.3, (4, robot.dof)) * (upper - lower)
    interpolant = SPLINES[seed % 3](ViaPoints(points), duration_bounds=(0.1, 20.0))
    times = rng.uniform(0.7, 1.3, (1, len(interpolant.variables))) * 10.0 ** rng.uniform(-0.3, 0.7)
    payload = Payload(float(rng.uniform(0.5, 3.0)), (0.02, 0.0, 0.05)) if rng.random() < 0.5 else Payload(0.0)
    return Rollout(Dynamics(robot, payload), interpolant(np.clip(times, 0.1, 20.0)))


def written(certificate, folder):
    """The content of a proof file as data."""
    return json.loads(certificate.write_proof(folder / "motion.proof.json").read_text())


def content(data, *, new_digest=True):
    """The bytes of a file, by default with the digest that belongs to its content."""
    data = dict(data)
    if new_digest:
        data.pop("digest", None)
        data["digest"] = digest(data)
    return json.dumps(data).encode()


def verdicts(data, **options):
    return {name: proven for name, proven, _ in check(content(data, **options)) if proven is not None}


def is_refused(raw):
    try:
        rows = check(raw)
    except BadFileError:
        return True
    return not all(proven for _, proven, _ in rows if proven is not None)


def greatest_efforts(rollout, count=2001):
    """Greatest magnitudes of efforts at evenly spread instants, and these instants, (n_joints,) each."""
    t = rollout.trajectory.duration[:, None] * np.linspace(0.0, 1.0, count)
    states = (rollout.trajectory.evaluate(t, order) for order in range(3))
    effort = np.abs(rollout.effort_in(*states, t)[0])
    return effort.max(axis=0), t[0, effort.argmax(axis=0)]


# the program stands alone


def test_the_program_imports_the_standard_library_alone():
    imported = set()
    for node in ast.walk(ast.parse(PROGRAM.read_text())):
        if isinstance(node, ast.Import):
            imported |= {alias.name.partition(".")[0] for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(str(node.module).partition(".")[0])
        assert not (isinstance(node, ast.Name) and node.id in ("__import__", "eval", "exec"))
    assert imported <= sys.stdlib_module_names - {"importlib"}


def test_the_contract_of_imports_names_every_other_module():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (contract,) = (each for each in contracts if each["id"] == "proof_checker_stands_alone")
    rooms = {f"trajevo.{room.parent.name}" for room in (ROOT / "trajevo").glob("*/__init__.py")} - {
        "trajevo.verification"
    }
    beside = {f"trajevo.verification.{file.stem}" for file in PROGRAM.parent.glob("*.py")}
    beside -= {"trajevo.verification.__init__", "trajevo.verification.check_proof"}
    beside |= {f"trajevo.verification.{room.parent.name}" for room in PROGRAM.parent.glob("*/__init__.py")}
    assert set(contract["forbidden_modules"]) == rooms | beside | {"problems", "trajevo.errors"}


def test_the_program_has_fewer_than_400_lines():
    assert len(PROGRAM.read_text().splitlines()) < 400


def test_the_program_runs_alone(robots, tmp_path):
    file = certify(moving(robots["ur5"], 3)).write_proof(tmp_path / "motion.proof.json")
    alone = tmp_path / "check_proof.py"
    alone.write_bytes(PROGRAM.read_bytes())
    done = subprocess.run([sys.executable, "-I", alone, file], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1].startswith("PROVEN: 30 of 30 claims")
    assert subprocess.run([sys.executable, "-I", alone, alone], capture_output=True).returncode == 2
    assert subprocess.run([sys.executable, "-I", alone], capture_output=True).returncode == 2


# the same verdict


def assert_same_verdict(rollout, folder):
    certificate = certify(rollout)
    data = written(certificate, folder)
    theirs = {row.name: row.proven for row in certificate.rows if row.quantity in CHECKED}
    assert verdicts(data) == theirs
    left = {name for name, proven, _ in check(content(data)) if proven is None}
    assert left == {row.name for row in certificate.rows if row.quantity not in CHECKED}
    return all(theirs.values())


@pytest.mark.parametrize("name", [*NAMES, "puma560"])
def test_certificates_are_checked_with_the_same_verdict(robots, name, tmp_path):
    # One that keeps its limits and one that does not.
    assert [assert_same_verdict(moving(robots[name], seed), tmp_path) for seed in SEEDS[name]] == [True, False]


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 340, 34))
@pytest.mark.parametrize("name", NAMES)
def test_a_thousand_certificates_are_checked_with_the_same_verdict(robots, name, first, tmp_path):
    for seed in range(1000 + first, 1000 + first + 34):
        assert_same_verdict(moving(robots[name], seed), tmp_path)


def test_friction_followers_and_loads_are_part_of_the_proof(robots, tmp_path):
    robot = robots["fingers"]
    n = robot.dof
    friction = Friction(np.full(n, 0.5), np.full(n, 2.0), np.full(n, 0.1), np.full(n, 1.0))
    rough = dataclasses.replace(robot, friction=friction)
    assert_same_verdict(moving(rough, 1), tmp_path)


def test_loads_that_change_on_the_way_are_part_of_the_proof(tmp_path):
    points = [[0.0, -1.0, 1.0, 0.0, 0.3, 0.0], [0.5, -1.2, 0.8, 0.2, 0.0, 0.1], [0.2, -0.8, 1.1, 0.4, -0.2, 0.3]]
    carried = [{"mass": 1.0, "com": [0.0, 0.02, 0.05]}, {"mass": 2.0, "from": 1}]
    problem = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
        points=points,
        payload=carried,
        duration_bounds=(0.5, 3.0),
    )
    rollout = problem.rollout(0.2 * problem.xl[None] + 0.8 * problem.xu[None])
    data = written(certify(rollout), tmp_path)
    assert set(data["carried"]) == {0, 1}
    assert len(data["robot"]["loads"][1]) == 2
    efforts, _ = greatest_efforts(rollout)
    found = verdicts(data)
    assert all(found.values())
    data["carried"] = [1 - phase for phase in data["carried"]]
    other = verdicts(data)
    rows = {row["joint"]: row["greatest"] for row in data["rows"] if row["quantity"] == "effort"}
    assert all(most <= rows[joint] for joint, most in zip(rollout.robot.joint_names, efforts, strict=True))
    assert not all(other.values())


def test_the_paper_s_motion_of_coupled_screws_is_proven(tmp_path):
    certificate = certify(HybridManipulator().rollout(paper_solution()))
    found = verdicts(written(certificate, tmp_path))
    assert len(found) == 25
    assert all(found.values())


@pytest.mark.parametrize(
    "settings", [{}, {"path": WAY, "robot": "puma560", "effort": True, "jerk": "inf", "longest_time": 20.0}]
)
def test_motions_along_a_path_are_proven_as_polynomials_of_time(settings, tmp_path):
    problem = TimeJerkReparameterisation(**settings)
    rollout = problem.rollout(problem.xl[None] + 0.5 * (problem.xu - problem.xl)[None])
    composed, found = rollout.trajectory, rollout.trajectory.polynomials(0)
    t = composed.duration[:, None] * np.linspace(0.0, 1.0, 1001)
    for order in range(4):
        values = composed.evaluate(t, order)
        assert np.abs(found.evaluate(t, order) - values).max() <= 1e-11 * np.abs(values).max()
        assert (np.abs(found.jump(order)) <= 1e-9 * composed.peak(order)).all()
    assert_same_verdict(rollout, tmp_path)
    data = json.loads((tmp_path / "motion.proof.json").read_text())
    row = next(row for row in data["rows"] if row["quantity"] == ("effort" if settings else "acceleration"))
    row["least"], row["greatest"] = 0.99 * row["least"], 0.99 * row["greatest"]
    assert is_refused(content(data))


# a second opinion


@pytest.mark.parametrize("seed", mostly_long(range(10, 14), 10))
@pytest.mark.parametrize("name", mostly_long(NAMES, "hybrid_manipulator"))
def test_pinocchio_at_many_instants_never_exceeds_what_is_proven(robots, name, seed, tmp_path):
    rollout = moving(robots[name], seed)
    robot, data = rollout.robot, written(certify(rollout), tmp_path)
    t = rollout.trajectory.duration[:, None] * np.linspace(0.0, 1.0, 801)
    q, v, a = (rollout.trajectory.evaluate(t, order)[0] for order in range(3))
    model = carrying(robot, rollout.dynamics.payload)
    memory = model.createData()
    states = zip(*robot.transmission.motion(q, v, a), strict=True)
    torque = np.array([pin.rnea(model, memory, *state) for state in states])
    effort = robot.transmission.effort(q, torque) + robot.friction.effort(rollout.without_rounding(v[None])[0], a)
    greatest = dict(zip(robot.joint_names, np.abs(effort).max(axis=0).tolist(), strict=True))
    data["rows"] = [row for row in data["rows"] if row["quantity"] == "effort"]
    for row in data["rows"]:
        assert greatest[row["joint"]] <= row["greatest"]
        row["lower"] = row["upper"] = None  # what is claimed is proven, whatever the limits are
    assert all(verdicts(data).values())
    for row in data["rows"]:  # just below the greatest instant each claim is refused
        row["greatest"] = greatest[row["joint"]] * (1.0 - 1e-6)
        row["least"] = -row["greatest"]
    assert not any(verdicts(data).values())


def test_kinematic_claims_just_below_the_peaks_are_refused(robots, tmp_path):
    rollout = moving(robots["ur5"], 4)
    data = written(certify(rollout), tmp_path)
    rows = [row for row in data["rows"] if row["quantity"] != "effort"]
    for share, kept in ((1.0 + 1e-11, True), (1.0 - 1e-11, False)):
        data["rows"] = copy.deepcopy(rows)
        for row in data["rows"]:
            order, j = CHECKED.index(row["quantity"]), rollout.robot.joint_names.index(row["joint"])
            least, greatest = (each[0, j] for each in rollout.trajectory.extremes(order))
            middle, half = 0.5 * (greatest + least), 0.5 * share * (greatest - least)
            row["least"], row["greatest"], row["lower"], row["upper"] = middle - half, middle + half, None, None
        assert set(verdicts(data).values()) == {kept}


# altered files


def _row(data, rng, quantities):
    rows = [row for row in data["rows"] if row["quantity"] in quantities]
    return rows[rng.integers(len(rows))]


def _coefficient(data, rollout, rng):
    """A coefficient moved so that the velocity limit is broken."""
    joint, segment = rng.integers(rollout.robot.dof), rng.integers(len(data["motion"]["breaks"]) - 1)
    row = next(
        row for row in data["rows"] if (row["quantity"], row["joint"]) == ("velocity", rollout.robot.joint_names[joint])
    )
    c = data["motion"]["coefficients"][segment][joint]
    c[1] = (float.fromhex(c[1]) + 2.5 * row["greatest"] * rng.choice([-1.0, 1.0])).hex()


def _peak(row, rollout):
    j = rollout.robot.joint_names.index(row["joint"])
    if row["quantity"] == "effort":
        return greatest_efforts(rollout)[0][j]
    return rollout.trajectory.peak(CHECKED.index(row["quantity"]))[0, j]


def _limit(data, rollout, rng):
    """A limit tightened below the true peak."""
    row = _row(data, rng, CHECKED[1:])
    row["upper"] = 0.99 * _peak(row, rollout)
    row["lower"] = -row["upper"]


def _bound(data, rollout, rng):
    """A bound, and its limit, lowered below what is true."""
    row = _row(data, rng, CHECKED[1:])
    row["greatest"] = (1.0 - 10.0 ** rng.uniform(-5.0, -1.0)) * _peak(row, rollout)
    row["least"] = -row["greatest"]
    row["lower"], row["upper"] = None, None


def _mass(data, rollout, rng):
    """All bodies heavier by more than the tolerance of the bounds."""
    factor = 1.0 + 10.0 ** rng.uniform(-2.0, 0.0)
    for body in (*data["robot"]["links"], *(load for loads in data["robot"]["loads"] for load in loads)):
        body["body"] = [factor * x for x in body["body"]]


def _removed(data, rollout, rng):
    """A piece of time removed."""
    del data["pieces"][rng.integers(len(data["pieces"]))]


def _swapped(data, rollout, rng):
    """Two pieces of time in the wrong order."""
    first = rng.integers(len(data["pieces"]) - 1)
    pieces = data["pieces"]
    pieces[first], pieces[first + 1] = pieces[first + 1], pieces[first]


def _moved_piece(data, rollout, rng):
    """A piece that is said to lie in another segment."""
    piece = data["pieces"][rng.integers(len(data["pieces"]))]
    piece["segment"] = (piece["segment"] + 1) % (len(data["motion"]["breaks"]) - 1)


def _share(data, rollout, rng):
    """The share of the piece on which an effort is greatest."""
    names = [row["joint"] for row in data["rows"] if row["quantity"] == "effort"]
    _, instants = greatest_efforts(rollout)
    j = int(rng.integers(len(names)))
    at = instants[rollout.robot.joint_names.index(names[j])]
    breaks = [float.fromhex(x) for x in data["motion"]["breaks"]]
    for piece in data["pieces"]:
        begin, end = breaks[piece["segment"] : piece["segment"] + 2]
        width = (end - begin) / 2 ** piece["level"]
        if begin + piece["place"] * width <= at <= begin + (piece["place"] + 1) * width:
            piece["shares"][j] = 900


def _breaks(data, rollout, rng):
    """A segment that is over before the polynomial is where the next one begins."""
    breaks = [float.fromhex(x) for x in data["motion"]["breaks"]]
    k = rng.integers(1, len(breaks) - 1)
    moved = breaks[k] - 0.2 * (breaks[k] - breaks[k - 1])
    data["motion"]["breaks"][k] = moved.hex()


def _standing(data, rollout, rng):
    """Speeds at which joints count as at rest, so that they have no friction."""
    data["robot"]["friction"]["standing"] = [1.0] * rollout.robot.dof


def _friction(data, rollout, rng):
    """Friction that pushes."""
    data["robot"]["friction"]["coulomb"][rng.integers(rollout.robot.dof)] = -1.0


def _load(data, rollout, rng):
    """A load on no link."""
    data["robot"]["loads"][0].append({"link": 99, "body": [1.0] + [0.0] * 9})


def _unit(data, rollout, rng):
    """The same numbers in another unit."""
    row = _row(data, rng, CHECKED)
    row["unit"] = f"k{row['unit']}"


def _name(data, rollout, rng):
    """A row told twice."""
    data["rows"].append(copy.deepcopy(_row(data, rng, CHECKED)))


ALTERED = (
    *(_coefficient, _limit, _bound, _bound, _mass, _removed, _swapped, _moved_piece, _share, _breaks),
    *(_standing, _friction, _load, _unit, _name),
)


def assert_refused(rollout, certificate, data, change, rng):
    changed = copy.deepcopy(data)
    change(changed, rollout, rng)
    assert changed != data
    assert is_refused(content(changed)), change.__doc__  # with a digest that fits
    with pytest.raises(BadFileError, match="digest"):
        check(content(changed, new_digest=False))


def proven_motion(robot, seed):
    """A random motion at which no limit is broken."""
    for k in range(seed, seed + 10_000, 101):
        rollout = moving(robot, k)
        certificate = certify(rollout)
        if certificate.proven:
            return rollout, certificate
    raise AssertionError


@pytest.mark.parametrize("change", ALTERED, ids=lambda change: change.__name__)
def test_altered_files_are_refused(robots, change, tmp_path):
    rng = np.random.default_rng(5)
    rollout, certificate = proven_motion(robots["hybrid_manipulator"], 7)
    data = written(certificate, tmp_path)
    assert all(verdicts(data).values())
    assert_refused(rollout, certificate, data, change, rng)


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 340, 34))
@pytest.mark.parametrize("name", NAMES)
def test_a_thousand_altered_files_are_refused(robots, name, first, tmp_path):
    rng = np.random.default_rng(first)
    for seed in range(first, first + 34):
        rollout, certificate = proven_motion(robots[name], seed)
        change = ALTERED[seed % len(ALTERED)]
        assert_refused(rollout, certificate, written(certificate, tmp_path), change, rng)


@pytest.mark.parametrize("seed", range(3))
def test_another_mass_is_refused_where_the_claim_is_then_false(robots, seed, tmp_path):
    rng = np.random.default_rng(seed)
    rollout, certificate = proven_motion(robots["ur5"], seed)
    data, factor, link = written(certificate, tmp_path), rng.uniform(1.2, 3.0), int(rng.integers(1, 5))
    data["robot"]["links"][link]["body"] = [factor * x for x in data["robot"]["links"][link]["body"]]
    model = rollout.robot.model.copy()
    model.inertias[link + 1] = pin.Inertia(
        factor * model.inertias[link + 1].mass,
        model.inertias[link + 1].lever,
        factor * model.inertias[link + 1].inertia,
    )
    robot = dataclasses.replace(rollout.robot, model=model)
    efforts, _ = greatest_efforts(dataclasses.replace(rollout, dynamics=Dynamics(robot, rollout.dynamics.payload)))
    found = verdicts(data)
    rows = {row["joint"]: row for row in data["rows"] if row["quantity"] == "effort"}
    false = [joint for joint, most in zip(robot.joint_names, efforts, strict=True) if most > rows[joint]["greatest"]]
    assert false
    assert not any(found[f"effort of {joint}"] for joint in false)


def test_any_edit_is_noticed_by_the_digest(robots, tmp_path):
    data = written(certify(moving(robots["ur5"], 3)), tmp_path)
    for key in data:
        changed = {**data, key: "other"}
        with pytest.raises(BadFileError):
            check(content(changed, new_digest=False))


BROKEN = {
    "empty": lambda text: "",
    "truncated": lambda text: text[: len(text) // 2],
    "no object": lambda text: "[]",
    "a key twice": lambda text: text.replace('"version": 1', '"version": 1, "version": 1'),
    "a key twice inside": lambda text: text.replace('"gravity":', '"gravity": [0.0, 0.0, 0.0], "gravity":'),
    "not a number": lambda text: text.replace('"greatest": ', '"greatest": NaN, "x": ', 1),
    "infinite": lambda text: text.replace('"upper": ', '"upper": Infinity, "x": ', 1),
    "negative infinity": lambda text: text.replace('"lower": ', '"lower": -Infinity, "x": ', 1),
    "huge": lambda text: text.replace('"greatest": ', '"greatest": 1e999, "x": ', 1),
    "digits": lambda text: text.replace('"greatest": ', f'"greatest": {"9" * 5000}, "x": ', 1),
    "deep": lambda text: "[" * 100_000 + "]" * 100_000,
    "another version": lambda text: text.replace('"version": 1', '"version": 2'),
    "another format": lambda text: text.replace('"trajevo proof"', '"trajevo motion"'),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_broken_files_are_refused(robots, kind, tmp_path):
    text = certify(moving(robots["ur5"], 3)).write_proof(tmp_path / "motion.json").read_text()
    with pytest.raises(BadFileError):
        check(BROKEN[kind](text).encode())


@pytest.mark.parametrize("content", [b"", b"{]", b"\xff\x00"])
def test_what_is_no_json_is_told_in_plain_words(content, tmp_path):
    (tmp_path / "a.json").write_bytes(content)
    refused(lambda: print_proof(None, tmp_path / "a.json"), "a.json: not a valid proof file: cannot be read as JSON: ")


VALUES = (None, True, "text", "0x1.8p+2000", "nan", [], {}, -1, 1e308, 10**400, [[1.0]], "1.5")


@pytest.mark.parametrize("seed", mostly_long(range(20), 0))
def test_values_of_other_kinds_are_refused_or_change_nothing_that_is_checked(robots, seed, tmp_path):
    rng = np.random.default_rng(seed)
    data = written(certify(moving(robots["hybrid_manipulator"], 8)), tmp_path)
    for _ in range(8):
        changed = copy.deepcopy(data)
        key = str(rng.choice(["motion", "robot", "carried", "rows", "pieces"]))
        place, at = changed, key
        while isinstance(place[at], dict | list) and place[at] and (place is changed or rng.random() < 0.9):
            place = place[at]
            at = list(place)[rng.integers(len(place))] if isinstance(place, dict) else int(rng.integers(len(place)))
        before, place[at] = place[at], VALUES[rng.integers(len(VALUES))]
        free = (
            at in ("name", "unit", "proven_by") or place[at] == before or (at in ("lower", "upper") and not place[at])
        )
        try:
            raw = content(changed)
        except OverflowError:
            continue
        assert free or is_refused(raw) or _lesser(before, place[at]), (at, before, place[at])


def _lesser(before, after):
    """Whether a change of a number may leave a claim true: it is then decided by the proof, not by its kind."""
    number = isinstance(after, int | float) and not isinstance(after, bool)
    return after is None or (number and isinstance(before, int | float | str))


# arithmetic of the program


def enclosed(tube, function, tolerance=1e-14):
    for k in range(41):
        s = Fraction(k - 20, 20)
        value = sum(complex(c) * float(s) ** i for i, c in enumerate(tube.c))
        assert abs(value - function(s)) <= tube.e + tolerance * (1.0 + abs(value)), s


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("width", [0.0, 1e-3])
def test_tubes_enclose_products_angles_and_roots(seed, width):
    rng = np.random.default_rng(seed)
    x, y = (Tube((rng.uniform(-1.0, 1.0, TERMS) * 0.4 ** np.arange(TERMS)).tolist(), width) for _ in range(2))
    angle, square = Tube([3.0 * (seed - 2), *x.c[1:]], width), Tube([2.0, *x.c[1:]], width)
    for off in (-width, width):  # functions as far away from the polynomials as a tube allows
        p, r, a, b = (
            lambda s, t=t, off=off: float(sum(Fraction(c) * s**i for i, c in enumerate(t.c))) + off
            for t in (x, y, angle, square)
        )
        enclosed(x * y, lambda s, p=p, r=r: p(s) * r(s))
        enclosed(angle.phase(), lambda s, a=a: complex(math.cos(a(s)), math.sin(a(s))))
        enclosed(square.inverse_root(), lambda s, b=b: b(s) ** -0.5)
    assert angle.phase().e < 1e-3 + 3.0 * width
    assert square.inverse_root().e < 0.1
    assert x * ZERO is ZERO


@pytest.mark.parametrize("middle", [0.5, 1000.0])
def test_narrow_tubes_stay_as_narrow_as_rounding(middle):
    # Bounds that certify proves lie above what is true by as little as 1e-12 of it.
    narrow = Tube([middle, 1e-9, 1e-12] + [0.0] * (TERMS - 3), 0.0)
    turn, root = narrow.phase(), narrow.inverse_root()
    assert abs(turn.c[0] - complex(math.cos(middle), math.sin(middle))) <= 3e-16
    assert 0.0 < turn.e < 1e-15
    assert 0.0 < root.e < 2e-15 * root.c[0]


def test_a_tangent_bound_is_decided_exactly():
    # 4 u (1 - u) has its greatest value 1 at u = 1/2.
    b, divisor = check_proof.bernstein([0, 4, -4])
    assert check_proof.decide(b, 0, divisor) == (True, 0)
    kept, where = check_proof.decide([x * 10**30 for x in b], 0, divisor * 10**30 - 1)
    assert kept is False
    assert abs(where - Fraction(1, 2)) < 1e-6


# written files


def test_files_are_of_the_schema(robots, tmp_path):
    validator = Draft202012Validator(proof_schema())
    validator.check_schema(proof_schema())
    for name in ("ur5", "fingers", "hybrid_manipulator"):
        validator.validate(written(certify(moving(robots[name], 1)), tmp_path))
    polynomials = json.loads((tmp_path / "motion.proof.json").read_text())["motion"]
    trajectory = moving(robots["hybrid_manipulator"], 1).trajectory
    assert [float.fromhex(x) for x in polynomials["breaks"]] == trajectory.breaks[0].tolist()
    read = [[[float.fromhex(x) for x in row] for row in segment] for segment in polynomials["coefficients"]]
    assert read == trajectory.coefficients[0].tolist()


def test_what_cannot_be_written_is_told_in_a_sentence(robots, tmp_path, monkeypatch):
    along = TimeJerkReparameterisation()
    motion = along.rollout(along.xl[None] + 0.5 * (along.xu - along.xl)[None])
    with monkeypatch.context() as patched:  # a kind of motion that is not known
        patched.setattr(proof_file, "ComposedBatch", CubicSpline)
        refused(lambda: certify(motion).write_proof(tmp_path / "x.json"), "polynomials of time, .*, got ComposedBatch")
    refused(lambda: certify(moving(robots["ur5"], 3)).write_proof(tmp_path / "no" / "x.json"), "cannot be written")
    refused(lambda: certify(moving(robots["ur5"], 3)).write_proof(3), "file: expected the path of a file, got 3")
    printed = HybridManipulator(convention="printed")
    data = written(certify(printed.rollout(printed.xl[None] + 0.5 * (printed.xu - printed.xl)[None])), tmp_path)
    assert not any(row["quantity"] == "effort" for row in data["rows"])
    assert any("weight_only" in each["why"] for each in data["not_checked"])


def test_a_certificate_that_was_read_has_no_motion(tmp_path):
    front = optimise(HybridManipulator(), seed=1, generations=3, population=12, progress=False, polish=False)
    if not len(front):
        pytest.skip("no feasible motion after three generations")
    analyse(front, "short", file=tmp_path / "front.analyses.npz")
    kept = read_analyses(tmp_path / "front.analyses.npz", front)["certificate"]
    refused(lambda: kept.write_proof(tmp_path / "x.json"), "certify it again")


def test_on_the_command_line(tmp_path):
    small = ("--generations", "3", "--population", "12", "--quiet")
    assert trajevo("solve", "hybrid", *small, *UNDRAWN, "--out", "run", cwd=tmp_path).returncode == 0
    done = trajevo("certify", "run", "--proof", "m.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "next: trajevo check-proof m.json" in done.stdout
    done = trajevo("check-proof", "m.json", cwd=tmp_path)
    assert done.returncode == 0
    assert "\nPROVEN: 25 of 25 claims; " in done.stdout
    data = json.loads((tmp_path / "m.json").read_text())
    next(row for row in data["rows"] if row["quantity"] == "velocity")["greatest"] = 1e-6
    (tmp_path / "m.json").write_bytes(content(data))
    done = trajevo("check-proof", "m.json", cwd=tmp_path)
    assert done.returncode == 1
    assert "NOT PROVEN: velocity of screw_1: " in done.stdout
    (tmp_path / "m.json").write_text("{}")
    for file in ("m.json", "none.json"):
        done = trajevo("check-proof", file, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr.startswith("error: ")
    assert trajevo("certify", "run", "--all", "--proof", "m.json", cwd=tmp_path).returncode == 2
    for nowhere in ("no/m.json", "run"):  # told before anything is proven
        done = trajevo("certify", "run", "--proof", nowhere, cwd=tmp_path)
        assert done.returncode == 2
        assert not done.stdout
        assert done.stderr.startswith(f"error: --proof: {nowhere}: cannot be written: ")
