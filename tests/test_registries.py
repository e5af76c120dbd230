"""What holds for everything that is chosen by name: described, of use on a small problem, and its name kept."""

import inspect
import json
import os
import pickle
import re
from importlib.metadata import EntryPoint
from typing import get_args

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Interpolant, LimitKind, LimitParameter, Objective, ViaPointProblem, export, load_robot, optimise
from trajevo.base import plugins
from trajevo.errors import UnknownNameError
from trajevo.exporters.export import EXPORTERS, NAMED_EXPORTERS, is_exported
from trajevo.formulation.constraints.constraint import Guarantee
from trajevo.formulation.constraints.kinds import KINDS, NAMED_KINDS, parameters_of
from trajevo.formulation.objectives import NAMED_OBJECTIVES, OBJECTIVES, objectives_of, total_time
from trajevo.formulation.task_file import task_model
from trajevo.solvers.evolutionary.algorithms import NAMED_ALGORITHMS
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS, THROUGH_POINTS

REGISTRIES = (NAMED_OBJECTIVES, NAMED_KINDS, NAMED_INTERPOLANTS, NAMED_EXPORTERS, NAMED_ALGORITHMS)
UR5 = {"name": "ur5", "tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}}
#: A drive that tells all from which its limits follow.
DRIVE = {
    "peak_torque": 150.0,
    "continuous_torque": 60.0,
    "gear_ratio": 101.0,
    "winding_resistance": 0.5,
    "torque_constant": 0.13,
    "thermal_resistance": 1.5,
    "thermal_time_constant": 900.0,
    "greatest_rise": 80.0,
}
DRIVEN = UR5 | {"drives": {"shoulder_lift_joint": DRIVE}}
POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.0, 1.2, -1.7, -1.2, 0.3], [1.0, -1.4, 1.4, -1.4, -1.5, 0.0]]
SI = re.compile(r"(?:rad|kg|m|s|N|J|W|K|1|\{joint\}|\{effort\}|or| )(?:\^\d)?(?:[*/](?:rad|kg|m|s|N|J|W|K)(?:\^\d)?)*")

#: A value for every parameter without a default.
GIVEN = {
    "overshoot": 0.5,
    "via_error": 0.01,
    "tool_speed": 2.0,
    "tool_height": 0.05,
    "effort_rate": 500.0,
    "manipulability": 0.02,
    "least_singular_value": 0.05,
    "longest_time": 9.0,
    "peak_power": 300.0,
    "scene": {"clearance": 0.01, "obstacles": [{"shape": "sphere", "radius": 0.1, "position": [0.0, 0.0, 1.5]}]},
}


def small(**arguments) -> ViaPointProblem:
    return ViaPointProblem(**{"robot": DRIVEN, "points": POINTS, "constraints": ()} | arguments)


def middle(problem) -> np.ndarray:
    return np.linspace(0.7, 1.3, 3)[:, None] * 0.5 * (problem.xl + problem.xu)


def asked_for(kind: LimitKind) -> dict:
    """Arguments that make a limit hold."""
    if kind.by_name:
        return {"constraints": (kind.name,)}
    return {p.name: GIVEN[p.name] for p in kind.parameters if p.default is None}


@pytest.mark.parametrize("registry", REGISTRIES, ids=lambda registry: registry.kind)
def test_names_are_plain_and_help_is_one_line(registry):
    for name, found in registry.own.items():
        assert re.fullmatch(r"[a-z][a-z0-9_/-]*", name)
        assert getattr(found, "name", name) == name
        described = getattr(found, "help", None) or inspect.getdoc(found).splitlines()[0]
        assert described
        assert "\n" not in described
        assert registry.fits(found)
        assert registry.find(name) is found
    assert list(registry.own) == registry.names()[: len(registry.own)]
    with pytest.raises(UnknownNameError, match=f"unknown {registry.kind} 'nothing'; known: "):
        registry.find("nothing")


@pytest.mark.parametrize("name", OBJECTIVES)
def test_every_objective_has_a_unit_and_works(name):
    objective = OBJECTIVES[name]
    assert SI.fullmatch(objective.unit), objective.unit
    assert objective.reference
    payload = {"constraints": ("effort",), "payload": 1.0} if "payload variable" in objective.needs else {}
    drive = {"gear_ratio": 100.0, "torque_constant": 0.1, "winding_resistance": 0.5}
    driven = {"robot": UR5 | {"drives": dict.fromkeys(small().robot.joint_names, drive)}}
    problem = small(objectives=(name,), **payload, **(driven if "drives" in objective.needs else {}))
    assert problem.objective_names == (name,)
    assert "{" not in problem.objectives[0].unit
    F = problem.evaluate(middle(problem))[0] if payload else problem.evaluate(middle(problem))
    assert np.isfinite(F).all()
    assert F.shape == (3, 1)
    rollout = problem.rollout(middle(problem))
    assert problem.objectives[0].function(rollout).shape == (3,)


@pytest.mark.parametrize("name", OBJECTIVES)
def test_what_an_objective_needs_is_asked_for(name):
    bare = load_robot("pointing_mechanism")  # it has masses and a tool
    if set(OBJECTIVES[name].needs) - {"masses", "tool", "continuous accelerations"}:
        refused(lambda: objectives_of([name], bare), f"objectives: {name} needs ")
    else:
        assert objectives_of([name], bare)[0].name == name
    if "continuous accelerations" in OBJECTIVES[name].needs:
        infinite = f"objectives: '{name}' is infinite where accelerations of 'hermite' jump; expected others, or the"
        refused(lambda: small(objectives=("time", name), interpolant="hermite"), infinite)


@pytest.mark.parametrize("name", KINDS)
def test_every_limit_names_its_quantity_and_proof_and_works(name):
    kind = KINDS[name]
    without, problem = small(), small(**asked_for(kind))
    assert without.n_ieq_constr == 0
    (constraint,) = problem.constraints
    assert constraint.quantity
    assert constraint.proof in get_args(Guarantee)
    assert constraint.reference
    x = middle(problem)
    rollout = problem.rollout(x)
    assert constraint.function(rollout).shape == (3, len(constraint.names)) == (3, problem.n_ieq_constr)
    if constraint.terms is not None:
        assert constraint.terms(rollout).shape[0] == 3
    again = ViaPointProblem(**json.loads(json.dumps(problem.settings)))
    for other in (again, pickle.loads(pickle.dumps(problem))):
        np.testing.assert_array_equal(other.evaluate(x)[1], problem.evaluate(x)[1])


@pytest.mark.parametrize("name", parameters_of(KINDS))
def test_every_parameter_is_an_argument_a_key_and_checked(name):
    parameter = parameters_of(KINDS)[name]
    assert parameter.help
    assert parameter.unit or parameter.plain
    assert inspect.signature(ViaPointProblem).parameters[name].default == parameter.default
    assert f"{name}: {parameter.help}" in ViaPointProblem.__doc__
    model = task_model()
    keys = model.model_fields if parameter.table else model.model_fields["constraints"].annotation.model_fields
    assert keys[name].default == parameter.default
    kind = next(kind for kind in KINDS.values() if parameter in kind.parameters)
    for bad in ("much", True, float("nan")):
        refused(lambda bad=bad: small(**asked_for(kind) | {name: bad}), f"^{name}: expected ")


@pytest.mark.parametrize("name", THROUGH_POINTS)
def test_every_interpolant_passes_or_nears_its_points(name):
    problem = small(interpolant=name, objectives=("time", "energy"))
    assert isinstance(problem.interpolant, Interpolant)
    assert all(variable.unit for variable in problem.variables)
    x = middle(problem)
    trajectory = problem.decode(x)
    assert len(trajectory) == 3
    assert trajectory.n_joints == 6
    times = problem.via_times(x)
    ends = trajectory.evaluate(times)[:, [0, -1]]
    np.testing.assert_allclose(ends, np.broadcast_to(np.array(POINTS)[[0, -1]], ends.shape), atol=1e-9)


@pytest.fixture(scope="module")
def fronts():
    """One of six joints that turn, one of linear axes."""
    settings = {"seed": 1, "generations": 2, "population": 20, "progress": False, "polish": False}
    square = [[0.0, 0.0], [0.1, 0.05], [0.2, 0.2]]
    linear = ViaPointProblem(robot="feed_drive", points=square, duration_bounds=(2.0, 9.0), constraints=())
    return [optimise(problem, **settings) for problem in (small(), linear)]


@pytest.mark.parametrize("name", EXPORTERS)
def test_every_format_is_written_and_known_again(name, fronts, tmp_path):
    exporter = EXPORTERS[name]
    front = fronts["linear" in exporter.needs]
    file = tmp_path / f"motion.{exporter.ending}"
    assert export(front.knee(), file, format=name, step=0.05) == file
    assert is_exported(file)
    assert exporter.wrote(file, file.read_bytes()[:64])
    if exporter.holds == "front":
        export(front, file, format=name)
    else:
        refused(lambda: export(front, file, format=name), "holds one solution, as front.knee")
    if exporter.si:
        refused(lambda: export(front.knee(), file, format=name, angle="deg"), "is in rad, got 'deg'")


def test_no_two_formats_share_an_ending():
    assert len({exporter.ending for exporter in EXPORTERS.values()}) == len(EXPORTERS)


# --- what other packages register

MINE = Objective("lateness", "s", "test", total_time, help="when it ends")
PATIENCE = LimitKind("patience", "", lambda limited: None, (LimitParameter("longest_time", "s", ""),))
SEEDS = LimitKind("seeds", "", lambda limited: None, (LimitParameter("samples", "1", ""),))
ANGLES = LimitKind("angles", "", lambda limited: None, (LimitParameter("held", "1", ""),))
PAIR = LimitKind("pair", "", lambda limited: None, (LimitParameter("least", "m", ""), LimitParameter("most", "m", "")))


@pytest.fixture
def register(monkeypatch):
    """Register things of this file by the names that they are given."""

    def registering(group, *pairs):
        points = [EntryPoint(name, value if ":" in value else f"{__name__}:{value}", group) for name, value in pairs]
        others = plugins.entry_points
        monkeypatch.setattr(
            plugins, "entry_points", lambda group: points if group == points[0].group else others(group=group)
        )

    return registering


def test_names_of_trajevo_s_own_mean_its_own(register):
    register(NAMED_OBJECTIVES.group, ("time", "MINE"))
    assert NAMED_OBJECTIVES.find("time") is OBJECTIVES["time"]
    assert NAMED_OBJECTIVES.names() == list(OBJECTIVES)


def test_packages_are_read_once_and_one_that_is_installed_meanwhile_is_found(tmp_path, monkeypatch):
    read, entry_points = [], plugins.metadata.entry_points
    monkeypatch.setattr(plugins.metadata, "entry_points", lambda: (read.append(1), entry_points())[1])
    os.utime(tmp_path, (0, 0))  # some file systems tell no instants apart that are milliseconds apart
    monkeypatch.syspath_prepend(tmp_path)
    for _ in range(3):
        assert "lateness" not in NAMED_OBJECTIVES.names() + NAMED_KINDS.names()
    assert len(read) == 1
    about = tmp_path / "late-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: late\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{NAMED_OBJECTIVES.group}]\nlateness = {__name__}:MINE\n")
    assert NAMED_OBJECTIVES.find("lateness") is MINE
    assert len(read) == 2


def test_two_packages_of_one_name_are_told(register):
    register(NAMED_OBJECTIVES.group, ("lateness", "MINE"), ("lateness", "math:sqrt"))
    refused(
        lambda: NAMED_OBJECTIVES.find("lateness"),
        "trajevo.objectives: two packages register 'lateness', as .*; uninstall one",
    )
    register(NAMED_OBJECTIVES.group, ("lateness", "MINE"), ("lateness", "MINE"))  # one package, found twice
    assert NAMED_OBJECTIVES.find("lateness") is MINE


def test_what_cannot_be_used_is_told_where_it_is_asked_for_and_warned_of_in_lists(register):
    register(NAMED_OBJECTIVES.group, ("lateness", "MINE"), ("late", "MINE"), ("wrong", "math:sqrt"), ("lost", "no:no"))
    refused(lambda: NAMED_OBJECTIVES.find("late"), "objective 'late': .*MINE is named 'lateness'; the two must agree")
    refused(lambda: NAMED_OBJECTIVES.find("wrong"), "objective 'wrong': math:sqrt is not a trajevo.Objective")
    refused(lambda: NAMED_OBJECTIVES.find("lost"), "objective 'lost': no:no cannot be imported: No module named 'no'")
    with pytest.warns(UserWarning, match="is named|is not|cannot be imported") as told:
        assert list(NAMED_OBJECTIVES.all()) == [*OBJECTIVES, "lateness"]
    assert len(told) == 3


@pytest.mark.parametrize("name", ["patience", "seeds", "angles"])
def test_parameters_that_are_taken_are_refused(register, name):
    register(NAMED_KINDS.group, (name, name.upper()))
    taken = {"patience": "longest_time", "seeds": "samples", "angles": "held"}[name]
    refused(task_model, f"parameter '{taken}'.* needs another name, which is taken")


def test_a_limit_with_two_parameters_needs_both(register):
    register(NAMED_KINDS.group, ("pair", "PAIR"))
    refused(lambda: small(most=1.0), "most: expected least with it, which the limit 'pair' needs too")


def test_limits_that_are_asked_for_in_the_wrong_way_are_told(register):
    refused(lambda: small(constraints=("tool_speed",)), "'tool_speed' is switched on by giving 'tool_speed'")
    refused(lambda: small(effort_margin=0.1), "effort_margin: expected 'effort' among the constraints")
    refused(lambda: small(tool_sped=1.0), "ViaPointProblem takes no 'tool_sped'; did you mean 'tool_speed' or")
