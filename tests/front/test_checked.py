"""Numbers of a front's file that do not follow from its decision vectors are refused, or told, by name."""

import json
import warnings

import numpy as np
import pytest

from tests.helpers import small_problem, trajevo
from trajevo import Front, ViaPointProblem, optimise
from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.front.records import FORMULAS

POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.2, 1.4, -1.7, -1.5, 0.2], [0.9, -1.4, 1.5, -1.6, -1.5, 0.0]]
ARGUMENTS = {
    "robot": {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
    "points": POINTS,
    "duration_bounds": (0.3, 4.0),
    "objectives": ("time", "energy"),
    "constraints": ("position", "velocity", "acceleration", "jerk", "effort"),
    "payload": {"mass": 1.0, "com": [0.0, 0.0, 0.03], "inertia": [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]},
    "effort_margin": 0.2,
    "tool_speed": 3.0,
}


@pytest.fixture(scope="module")
def front() -> Front:
    return optimise(ViaPointProblem(**ARGUMENTS), seed=1, generations=10, population=20, progress=False, polish=False)


@pytest.fixture
def changed(front, tmp_path):
    """Writes the front with changed content, and returns its file."""

    def write(change):
        file = tmp_path / "front.json"
        front.save(file)
        content = json.loads(file.read_text(encoding="utf-8"))
        change(content)
        file.write_text(json.dumps(content), encoding="utf-8")
        return file

    return write


def put(what, row, column, value):
    def change(content):
        content[what][row][column] = value

    return change


def test_a_front_with_a_payload_of_its_own_inertia_is_read_checked_and_picked(front, changed):
    back = Front.load(changed(lambda content: None))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert back.problem.settings == front.problem.settings
        for row in range(len(back)):
            np.testing.assert_array_equal(back.pick(row).x, front.X[row])
        assert len(back.rollouts.trajectory) == len(front)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (put("F", 0, 0, 0.5), r"row 0: time is recorded as 0\.5 s, but the decision vector gives "),
        (put("F", 0, 1, 3.0), r"row 0: energy is recorded as 3 J, but the decision vector gives [0-9.]+ J"),
        (put("F", -1, 0, 99.0), r": time is recorded as 99 s"),
        (put("X", 0, 0, 1.0), r"row 0: time is recorded as "),
        (put("G", 0, 0, -0.99), r"row 0: position of shoulder_pan_joint is recorded as 1 % of its limit, but .* 14\."),
        (put("G", 0, -1, -0.999), r"row 0: tool speed is recorded as 0\.1 % of its limit"),
    ],
)
def test_a_changed_number_of_a_chosen_row_is_refused_by_name(changed, change, says):
    file = changed(change)
    for use in (lambda front: front.choices(), lambda front: front.problem, lambda front: front.rollouts):
        with pytest.raises(InvalidInputError, match=says) as caught:
            use(Front.load(file))
        assert str(caught.value).startswith(f"{file}: row ")
    for command in (("show",), ("capacity",), ("export", "--out", file.with_name("x.csv")), ("certify",), ("report",)):
        done = trajevo(command[0], file, *command[1:])
        assert done.returncode == 2
        assert "the file is damaged or was changed" in done.stderr


def test_any_row_that_is_picked_is_compared(front, changed):
    row = 1
    assert row not in np.linspace(0, len(front) - 1, 4).round()
    between = 0.5 * (front.F[0, 0] + front.F[2, 0])
    back = Front.load(changed(put("F", row, 0, between)))
    assert back.problem is not None
    with pytest.raises(InvalidInputError, match="row 1: time is recorded"):
        back.pick(row)
    with pytest.raises(InvalidInputError, match="row 1: time is recorded"):
        _ = back.rollouts


def test_rounding_of_another_machine_is_no_damage(changed, front):
    def rounded(content):
        for name in "FG":
            content[name] = (np.array(content[name]) * (1.0 + 1e-8)).tolist()

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Front.load(changed(rounded)).choices()


@pytest.mark.parametrize("versions", [{"trajevo": "0.1.0"}, {"trajevo": "0.1.0", FORMULAS[0]: "1"}])
def test_other_formulas_are_told_and_read(changed, front, versions):
    def older(content):
        content["run"]["versions"] = versions
        for row in content["F"]:
            row[1] *= 1.008

    back = Front.load(changed(older))
    with pytest.warns(UserWarning, match=r"front\.json: recorded by trajevo 0\.1\.0 .*: energy differs by 0\.79 %"):
        assert back.knee().F["energy"] == pytest.approx(1.008 * front.knee().F["energy"], rel=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # told once
        back.choices()


@pytest.mark.parametrize(("objective", "factor"), [("time", 1.02), ("time", 0.98), ("energy", 1.3), ("energy", 0.7)])
def test_other_formulas_excuse_no_more_than_they_were_off(changed, objective, factor):
    """One per cent, and 20 where values were sums over samples."""

    def older(content):
        del content["run"]["versions"][FORMULAS[0]]
        for row in content["F"]:
            row[["time", "energy"].index(objective)] *= factor

    with pytest.raises(InvalidInputError, match=f"{objective} is recorded"):
        Front.load(changed(older)).least("time")


def test_the_same_formulas_excuse_nothing(changed):
    with pytest.raises(InvalidInputError, match="row 0: energy is recorded"):
        Front.load(changed(lambda content: content["F"][0].__setitem__(1, 1.00001 * content["F"][0][1]))).pick(0)


def test_a_problem_that_cannot_be_made_is_told_and_the_numbers_are_read(changed, front):
    def gone(content):
        content["problem"]["settings"]["robot"] = {"name": "no/such/robot.urdf"}

    back = Front.load(changed(gone))
    with pytest.warns(UserWarning, match=r"front\.json: the numbers are as recorded, not checked: .*no such URDF file"):
        assert back.knee().F == front.knee().F
    with pytest.raises(TrajevoError, match="no such URDF file"):
        _ = back.problem


def test_a_problem_that_differs_is_told_with_both_values(changed, front):
    file = changed(lambda content: content["problem"]["limits"]["velocity"].__setitem__(0, 99.0))
    with pytest.raises(InvalidInputError, match=r"differs .*: limits\.velocity: \(99\.0, .* on record, \(3\.15, "):
        _ = Front.load(file).problem


def test_decision_vectors_that_cannot_be_evaluated_are_refused(tmp_path):
    def raising(rollout):
        raise KeyError("no such table")

    problem = small_problem()
    made = optimise(problem, seed=1, generations=3, population=8, progress=False, polish=False)
    made.save(tmp_path / "front.json")
    own = problem.objectives[0]
    problem.objectives = (type(own)("time", "s", "test", raising), problem.objectives[1])
    with pytest.raises(InvalidInputError, match="cannot evaluate their decision vectors: 'no such table'"):
        Front.load(tmp_path / "front.json", problem=problem).knee()


def test_settings_that_came_later_have_their_defaults(changed, front):
    """A front that was recorded before a limit had a parameter is read, unless the problem at hand uses it."""
    file = changed(lambda content: content["problem"]["settings"].pop("tool_height"))
    assert Front.load(file).problem.settings["tool_height"] is None
    other = ViaPointProblem(**ARGUMENTS | {"samples": 7})
    with pytest.raises(InvalidInputError, match=r"settings\.samples: 6 on record, 7 at hand"):
        _ = Front.load(file, problem=other).problem


def test_checking_compiles_nothing_and_takes_milliseconds(changed, front):
    """In a process of its own, in which nothing is imported or made yet but the front and its problem."""
    import subprocess
    import sys

    file = changed(lambda content: None)
    code = (
        "import sys, time; from trajevo import Front; front = Front.load(sys.argv[1]); front._made; front.pick(0)\n"
        "other = Front.load(sys.argv[1], problem=front.problem); other._made\n"
        "began = time.process_time(); other.choices(); other.problem; print(time.process_time() - began)\n"
        "print('numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(file)], capture_output=True, text=True, check=True)
    seconds, compiled = done.stdout.split()
    assert compiled == "False"
    assert float(seconds) < 0.1  # of CPU; 3 ms on an idle machine
