"""Small problems that the tests can break, and the command line as a user meets it."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import multiprocessing
import subprocess
import sys
import traceback
import warnings
from typing import Any

import numpy as np
import pytest

from tests.benchmarks.differences import central_differences
from trajevo import TrajectoryProblem, TrajevoError, ViaPoints, load_problem, load_robot
from trajevo.base.arrays import Array
from trajevo.cli.main import main
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.formulation.constraints.constraint import Constraint
from trajevo.formulation.constraints.joint_limits import kinematic_limits
from trajevo.formulation.objectives import OBJECTIVES, Objective, summed_rms_jerk, total_time
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS, QuinticSpline

#: Options of a run whose pictures and report nobody looks at: they take ten times as long as a small search.
UNDRAWN = ("--no-pictures", "--report", "none")

POINTS = ViaPoints(np.array([[0.2, 0.1], [0.0, 0.3], [-0.2, 0.0]]))


def small_problem(*, objectives=None, constraints=None, reference_point=None) -> TrajectoryProblem:
    """Two segments of the pointing mechanism, by hand: not registered, so not named in any file."""
    robot = load_robot("pointing_mechanism")
    return TrajectoryProblem(
        dynamics=Dynamics(robot),
        interpolant=QuinticSpline(POINTS, duration_bounds=(1.0, 10.0)),
        objectives=objectives
        or (Objective("time", "s", "test", total_time), Objective("jerk", "rad/s^3", "test", summed_rms_jerk)),
        constraints=kinematic_limits(robot) if constraints is None else constraints,
        reference_point=reference_point,
    )


def failing_when_slow(rollout):
    """An objective that raises as soon as one trajectory of the batch takes longer than 15 s."""
    if (rollout.trajectory.duration > 15.0).any():
        raise KeyError("too slow for this table")
    return rollout.trajectory.duration


def nan_when_slow(rollout):
    """An objective that is NaN for every trajectory that takes longer than 15 s."""
    duration = rollout.trajectory.duration
    return np.where(duration > 15.0, np.nan, duration)


def impossible(robot, by: float) -> Constraint:
    """A limit that every trajectory exceeds by a given share."""
    return Constraint(("patience",), "test", lambda rollout: np.full((len(rollout.trajectory), 1), by))


def without_files(patch: pytest.MonkeyPatch) -> None:
    """Pages without the files of their solutions, which take longer than all else of a page of a small run."""
    patch.setattr("trajevo.page.explorer._FILES", {})


def trajevo(*arguments, cwd=None, files=False) -> subprocess.CompletedProcess[str]:
    """Run the command line in this process, which spares the second that a new one takes to start.

    With ``files`` its pages hold the files of their solutions.
    """
    printed, told, code = io.StringIO(), io.StringIO(), 0
    with (
        contextlib.chdir(cwd or "."),
        contextlib.redirect_stdout(printed),
        contextlib.redirect_stderr(told),
        pytest.MonkeyPatch.context() as patch,
        warnings.catch_warnings(),
    ):
        patch.setattr(sys, "argv", ["trajevo", *map(str, arguments)])
        patch.setenv("MPLBACKEND", "Agg")  # as main will, and taken back afterwards
        if not files:
            without_files(patch)
        warnings.resetwarnings()
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            main()
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        except Exception:  # noqa: BLE001 - what a process would print before it ends
            code = 1
            traceback.print_exc()
    return subprocess.CompletedProcess(arguments, code, printed.getvalue(), told.getvalue())


def trajevo_process(*arguments, cwd=None) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own."""
    command = [sys.executable, "-c", "from trajevo.cli.main import main; main()", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True)


def forked(deed) -> int:
    """Exit code of a copy of this process that does something, or minus the signal that ended it."""
    child = multiprocessing.get_context("fork").Process(target=deed)
    child.start()
    child.join(60.0)
    assert child.exitcode is not None, "it does not end"
    return child.exitcode


def mostly_long(values, *often, several=False):
    """Parameters of a sweep: `make test` takes those that are named, `make test-long` all others.

    With ``several`` each value is a tuple, of one value for each of several parameters.
    """
    assert all(value in values for value in often)
    return [
        value if value in often else pytest.param(*(value if several else (value,)), marks=pytest.mark.long)
        for value in values
    ]


def suited(name: str, given: dict[str, Any]) -> dict[str, Any]:
    """Arguments of a problem with an interpolant, without what is infinite where its accelerations jump."""
    found = given | {"interpolant": name}
    if getattr(NAMED_INTERPOLANTS.find(name), "continuous", 2) > 1:
        return found
    endless = {name for name, one in OBJECTIVES.items() if "continuous accelerations" in one.needs}
    objectives = [one for one in given.get("objectives", ("time", "acceleration")) if one not in endless]
    limits = given.get("constraints", ("position", "velocity", "acceleration"))
    kept = {"objectives": objectives or ["time"], "constraints": [one for one in limits if one != "jerk"]}
    return {key: value for key, value in (found | kept).items() if key != "effort_rate"}


def refused(call, says: str) -> None:
    """Assert that a call is refused with one sentence that matches a pattern."""
    with pytest.raises(TrajevoError, match=says) as caught:
        call()
    assert "\n" not in str(caught.value)


def any_problem(name: str, **arguments: Any) -> TrajectoryProblem:
    """A registered problem; where nothing else is said, any robot through any points is the PUMA 560 of Raji 2022."""
    if name == "via-points" and "points" not in arguments:
        arguments["points"] = TABLE_1_JOINTS
    return load_problem(name, **arguments)


def assert_exact_gradients(problem: TrajectoryProblem, x: Array) -> None:
    """Assert that all gradients are finite differences, at one of the points at least: others may be at a kink."""
    F, dF, G, dG = problem.evaluate_with_gradients(x)
    rough = np.concatenate(central_differences(problem)(x)[1::2], axis=1)
    scale = np.abs(rough).max(axis=2) + 1e-3 * np.concatenate([np.abs(F), 1.0 + np.abs(G)], axis=1)
    off = np.abs(np.concatenate([dF, dG], axis=1) - rough).max(axis=2) > 1e-3 * scale
    assert not off.all(axis=0).any()
    assert problem.gradients_by(x) == "complex step"


def limits_shown(panel) -> set[float]:
    """Limits that a panel of a picture draws, or tells above it where they are far from its curves."""
    drawn = {round(float(line.get_ydata()[0]), 9) for line in panel.lines if line.get_gid() == "limit"}
    told = panel.get_title(loc="right").replace("−", "-").partition("outside: ")[2].split(" ")
    numbers = [float(text.strip("±,")) for text in told if text.strip("±,-.").replace(".", "").isdigit()]
    return drawn | {*numbers} | ({-each for each in numbers} if told[0].startswith("±") else set())


def same_bound(one, other) -> None:
    """Assert that two bounds of a front are the same but for the CPU time that they took."""
    for a, b in ((one, other), (one.below, other.below)):
        assert type(a) is type(b)
        for field in dataclasses.fields(a):
            if field.name not in ("cpu_time", "below"):
                np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))
