"""Exact gradients of every problem and of its limits in terms, against finite differences."""

import copy
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import any_problem, mostly_long
from trajevo.capacity.payload_time import max_payload_problem
from trajevo.capacity.uncertainty import robust_problem
from trajevo.formulation.gradients import own
from trajevo.formulation.registry import list_problems
from trajevo.problems import (
    HybridManipulator,
    PickAndPlace,
    PointingMechanism,
    TimeJerkReparameterisation,
    ViaPointProblem,
)
from trajevo.problems.hybrid_manipulator import CONVENTIONS
from trajevo.robot.payload import LOAD_MODELS
from trajevo.solvers.task import load_task

#: All but the task for several robots, which is no problem of its own.
FILES = (Path(__file__).parents[2] / "problems" / "tasks").glob("*.toml")
TASKS = sorted(file for file in FILES if file.stem != "which_robot")
OBSTACLE = next(file for file in TASKS if file.stem == "xarm7_obstacle")

#: Steps of the differences, as shares of a variable's range.
STEPS = (1e-5, 1e-6, 1e-7)
EVERY_OBJECTIVE = ["time", "energy", "jerk", "acceleration", "unused_payload"]
WIDE = {"mass": (5.0, 9.0), "com": [[-0.3] * 3, [0.3] * 3]}


def with_scene(**scene):
    """The task with an obstacle, its scene changed."""
    settings = load_task(OBSTACLE).problem.settings
    return ViaPointProblem(**settings | {"scene": settings["scene"] | scene})


def hybrid(**arguments):
    return lambda: HybridManipulator(**{"samples": 4} | arguments)


PROBLEMS = {name: lambda name=name: any_problem(name) for name in list_problems()}
PROBLEMS |= {f"task {file.stem}": lambda file=file: load_task(file).problem for file in TASKS}
PROBLEMS |= {
    f"hybrid {each}, {objectives}": hybrid(convention=each, objectives=objectives)
    for each in CONVENTIONS
    for objectives in ("all", "cost")
}
PROBLEMS |= {f"hybrid with a {model} payload": hybrid(payload=7.0, payload_model=model) for model in LOAD_MODELS}
PROBLEMS |= {
    f"payload as a variable, {model}": lambda model=model: max_payload_problem(
        HybridManipulator(payload_model=model), (0.0, 12.0)
    )
    for model in LOAD_MODELS
}
PROBLEMS |= {
    f"robust, {model}": lambda model=model: robust_problem(HybridManipulator(payload_model=model, samples=3), **WIDE)
    for model in ("rigid", "weight_only")
}
PROBLEMS |= {
    f"pointing {name}": lambda name=name: PointingMechanism(interpolant=name)
    for name in ("printed", "quintic", "septic_spline")
}
PROBLEMS |= {
    f"reparam {arguments}": lambda arguments=arguments: TimeJerkReparameterisation(**arguments)
    for arguments in ({"limits": "hull"}, {"encoding": "shape"}, {"path": "s"})
}
PROBLEMS |= {
    f"pick-place {name}": lambda name=name: PickAndPlace(interpolant=name, samples=6)
    for name in ("quintic_spline", "linear_blends", "cubic")
}
PROBLEMS |= {
    f"reparam's smooth form, {limits}": lambda limits=limits: TimeJerkReparameterisation(limits=limits).smooth.problem
    for limits in ("tight", "hull")
}
PROBLEMS |= {
    "five objectives": hybrid(objectives=EVERY_OBJECTIVE),
    "clearance to itself": lambda: with_scene(self_clearance=0.02),
    "no room": lambda: with_scene(clearance=1.0),
}


#: Every third, and the distances of solids, whose derivatives are coal's; `make test-long` takes the others.
OFTEN = {*[*PROBLEMS][::5], "clearance to itself"} - {"task pick_and_place_cell"}


@pytest.fixture(scope="module", params=mostly_long(PROBLEMS, *OFTEN))
def problem(request):
    return PROBLEMS[request.param]()


def rows(problem, count=3):
    shares = np.random.default_rng(5).uniform(0.15, 0.75, (count, problem.n_var))
    return problem.xl + shares * (problem.xu - problem.xl)


def differences(problem, x):
    """Slopes over each variable's range, (B, columns, n_var, quotients): central, ahead and behind, by every step."""
    width, count = problem.xu - problem.xl, len(x)
    steps = np.concatenate([sign * step * np.eye(problem.n_var) for step in STEPS for sign in (1.0, -1.0)])
    moved = (x[:, None] + steps * width).reshape(-1, problem.n_var)
    values = np.concatenate(problem.evaluate(np.concatenate([x, moved]), return_values_of=["F", "G"]), axis=1)
    here, there = values[:count], values[count:].reshape(count, len(STEPS), 2, problem.n_var, -1)
    quotients = []
    for k, step in enumerate(STEPS):
        ahead, behind = there[:, k, 0], there[:, k, 1]
        quotients += [(ahead - behind) / (2.0 * step), (ahead - here[:, None]) / step, (here[:, None] - behind) / step]
    return np.moveaxis(np.stack(quotients, axis=-1), 1, 2)


def by_peaks(problem):
    """The problem with the peaks in place of what is proven of them, whose derivatives certified limits give."""
    other = copy.copy(problem)
    other.constraints = tuple(
        limit if limit.sampled is None or limit.terms is None else replace(limit, function=partial(greatest, limit))
        for limit in problem.constraints
    )
    return other


def greatest(limit, rollout):
    terms = limit.terms(rollout)
    return terms.reshape(len(terms), -1, len(limit.names)).max(axis=1)


@pytest.mark.thinned(3)
@pytest.mark.parametrize("terms", [False, True], ids=["", "in terms"])
def test_gradients_are_finite_differences(problem, terms):
    """One quotient at least agrees: a central one where the value is smooth, a one-sided one where it has a kink."""
    asked = problem.in_terms() if terms else problem
    x = rows(problem)
    F, dF, G, dG = asked.evaluate_with_gradients(x)
    plain = asked.evaluate(x, return_values_of=["F", "G"])
    for ours, theirs in zip((F, G), plain, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-5)
    slopes = np.concatenate([dF, dG], axis=1) * (problem.xu - problem.xl)
    numerical = np.concatenate([differences(asked, x), differences(by_peaks(asked), x)], axis=-1)
    scale = 1.0 + np.abs(np.concatenate([F, G], axis=1)) + np.abs(slopes).max(axis=2)
    error = np.abs(numerical - slopes[..., None]).min(axis=3) / scale[..., None]
    # The direction of a depth is coal's: of a facet where the solid is round.
    names = asked.objective_names + asked.constraint_names
    bounds = np.array([1e-2 if "clearance" in name else 1e-3 for name in names])
    assert (error <= bounds[:, None]).all()
    assert np.median(error) <= 1e-6


def test_a_batch_gives_what_single_rows_give(problem):
    x = rows(problem)
    together = problem.evaluate_with_gradients(x)
    for k in range(len(x)):
        for ours, alone in zip(together, problem.evaluate_with_gradients(x[k : k + 1]), strict=True):
            np.testing.assert_allclose(ours[k], alone[0], rtol=1e-9, atol=1e-12 * np.abs(alone).max(initial=1.0))


def test_gradient_solvers_are_given_the_complex_step(problem):
    for asked in (problem, problem.in_terms()):
        assert all(own(each.function) for each in (*asked.objectives, *asked.constraints))
        assert asked.gradients_by(rows(problem)) == "complex step"
