"""What a notebook shows: one line of text for everything, and a little HTML for what people look at."""

import inspect
import warnings
from dataclasses import replace

import numpy as np
import pytest

import trajevo as t
from tests.base.test_shown import Reader
from tests.helpers import small_problem
from trajevo.formulation.objectives import Objective, total_time
from trajevo.problems import HybridManipulator, PickAndPlace, PointingMechanism, TimeJerkReparameterisation
from trajevo.problems import hybrid_manipulator as guo
from trajevo.study.bench.adapters.adapter import adapter
from trajevo.trajectory.interpolants.septic import State

SMALL = {"seed": 1, "generations": 3, "population": 12, "progress": False}
BOX = [[-0.02, -0.02, 0.03], [0.02, 0.02, 0.07]]

#: Longest line, and greatest size of the HTML of one object.
LINE, SIZE = 200, 30_000

#: Classes of the facade without examples among the results below -> one.
OTHERS = {
    "BaseMap": lambda: t.BaseMap(
        ("x", "y"), *np.eye(2), "time", "s", *np.ones((2, 2, 2)), np.ones((2, 2, 4)), small_problem()
    ),
    "BenchRival": lambda: adapter("scipy-slsqp"),
    "BSpline": lambda: t.BSpline(points(), duration_bounds=(1.0, 2.0)),
    "CartesianBox": lambda: t.CartesianBox(1, [0.0, 0.05, 0.05]),
    "DaskCluster": lambda: t.DaskCluster(2),
    "EvolutionaryAlgorithm": lambda: t.EvolutionaryAlgorithm("mine", lambda problem, sizes: None, "nothing" * 99),
    "Exporter": lambda: t.Exporter("mine", "txt", "nothing", lambda solution, step, angle: ""),
    "HermiteSpline": lambda: t.HermiteSpline(points(), duration_bounds=(1.0, 2.0)),
    "ImprovedQuarticBSpline": lambda: t.ImprovedQuarticBSpline(points(), duration_bounds=(1.0, 2.0)),
    "InProcess": t.InProcess,
    "LimitKind": lambda: t.LimitKind("mine", "nothing", lambda robot: ()),
    "LimitParameter": lambda: t.LimitParameter("most", "rad", "a number"),
    "LinearBlends": lambda: t.LinearBlends(points(), duration_bounds=(1.0, 2.0)),
    "Drive": lambda: t.Drive(peak_torque=150.0, gear_ratio=101.0, source="a data sheet"),
    "FrontBound": lambda: t.bound_front(t.optimise(small_problem(), **SMALL, polish=False), gap=0.5),
    "Grip": lambda: t.Grip(force_per_finger=100.0, friction=0.3),
    "Stand": lambda: t.Stand(mass=60.0, com=(0.0, 0.0, 0.2), footprint=((0.3, 0, 0), (0, 0.3, 0), (-0.3, -0.3, 0))),
    "Load": lambda: t.Load(t.Payload(2.0, (0.0, 0.0, 0.05)), 0, 1),
    "Motion": lambda: PointingMechanism().decode(np.full(4, 5.0)).sample(50),
    "Passing": lambda: t.Passing(1, stop=True),
    "Pose": lambda: t.Pose([0.1, 0.2, 0.3], np.eye(3)),
    "Processes": lambda: t.Processes(2),
    "RobotChoice": lambda: t.choose_robot("which_robot", ["z1"], progress=False),
    "SepticPolynomial": lambda: t.SepticPolynomial(State(np.zeros(3)), State(np.ones(3)), duration_bounds=(1.0, 2.0)),
    "QuarticCubicQuartic": lambda: t.QuarticCubicQuartic(points(), duration_bounds=(1.0, 2.0)),
    "QuinticSpline": lambda: t.QuinticSpline(points(), duration_bounds=(1.0, 2.0)),
    "SinglePolynomial": lambda: t.SinglePolynomial(points(), duration_bounds=(1.0, 2.0)),
    "SepticSpline": lambda: t.SepticSpline(points(), duration_bounds=(1.0, 2.0)),
    "ToolPlane": lambda: t.ToolPlane.around(t.Pose([0.1, 0.2, 0.3], np.eye(3)), "xz", reach=0.5, cells=5),
    "ToolSegment": lambda: t.ToolSegment(0, 1, tool="line"),
    "TrajevoError": lambda: t.TrajevoError("x" * 10),
    "Variable": lambda: t.Variable("dt_1", "s", 1.0, 2.0),
}


def points():
    return t.ViaPoints(np.linspace(0.0, 1.0, 8).reshape(4, 2))


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """Objects as they stand at the end of a notebook's cells."""
    task = t.load_task("xarm7_obstacle")
    problems = PointingMechanism(), PickAndPlace(payload=2.5)
    pointing, puma = (t.optimise(one, **SMALL, polish=False) for one in problems)
    table = HybridManipulator().rollout(guo.paper_solution())
    effort = t.payload_effort(table)
    study = t.Study("pointing", repeats=2, factors={"interpolant": ["printed", "quintic"]}, **without_progress())
    folder = tmp_path_factory.mktemp("study")
    ur5 = t.load_robot("ur5", tool="tool0", limits={"acceleration": np.inf, "jerk": np.inf})
    plane = t.ToolPlane.around(t.Pose([0.0, 0.11, 0.3], np.diag([1.0, -1.0, -1.0])), "xz", reach=0.9, cells=3)
    return {
        "task": task,
        "checked": t.check(task.problem),
        "robot": ur5,
        "front": pointing,
        "other front": puma,
        "nothing": pointing[0:0],
        "knee": pointing.knee(),
        "solution": puma[0],
        "problem": HybridManipulator(),
        "along a path": TimeJerkReparameterisation(path="gemini"),
        "capacity": t.dlcc(table),
        "iterated": t.dlcc_iterative(table, step=1.0),
        "capacities": t.capacities(puma),
        "sensitivity": t.sensitivity(table),
        "slowdown": t.slowdown_for(table, 10.0),
        "slowdowns": t.slowdown_curve(table, [0.0, 5.0, 12.0]),
        "diagram": t.payload_diagram(effort, np.linspace(0, 0.3, 5), np.linspace(-0.1, 0.3, 5)),
        "robust": t.robust_capacity(effort, com=BOX),
        "worst": t.worst_case(effort, mass=(2.5, 3.5), com=BOX),
        "robust curve": t.robust_curve(effort, com=(0.0, 0.0, 0.05), within=0.1),
        "workspace": t.workspace_capacity(ur5, plane),
        "certificate": t.certify(table),
        "verification": t.verify(pointing.knee()),
        "study": study,
        "standing": t.run_study(study, folder, progress=False),
        "results": t.collect(folder),
    }


def without_progress():
    return {name: value for name, value in SMALL.items() if name != "progress"}


def reached(things):
    """Every object of trajevo that these hold, by public names, and these."""
    found, seen, left = [], set(), list(things)
    while left:
        one = left.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if type(one).__module__.startswith("trajevo"):
            found.append(one)
            held = getattr(one, "__dict__", {})
            left += [value for name, value in held.items() if not name.startswith("_")]
        if isinstance(one, dict):
            left += list(one.values())[:20]
        elif isinstance(one, tuple | list):
            left += one[:20]
    return found


def test_whatever_a_notebook_holds_prints_as_one_short_line(shown):
    objects = reached(shown.values())
    longest = {type(one).__name__: repr(one) for one in sorted(objects, key=lambda one: len(repr(one)))}
    assert len(longest) > 60
    assert {name: told for name, told in longest.items() if len(told) > LINE or "\n" in told} == {}


def test_every_public_class_has_an_example_that_prints_as_one_short_line(shown):
    found = [*reached(shown.values()), *(make() for make in OTHERS.values())]
    public = {name: getattr(t, name) for name in t.__all__ if inspect.isclass(getattr(t, name))}
    examples = {name: [one for one in found if isinstance(one, kind)] for name, kind in public.items()}
    assert [name for name, ones in examples.items() if not ones] == []
    longest = {name: max(map(repr, ones), key=len) for name, ones in examples.items()}
    assert {name: told for name, told in longest.items() if len(told) > LINE or "\n" in told} == {}


def test_what_notebooks_show_is_small_safe_and_in_the_colours_of_the_page(shown):
    for name, one in shown.items():
        text = one._repr_html_()
        assert len(text.encode()) <= SIZE, name
        found = Reader(text)
        assert found.texts[0].strip(), name
        for tag, attributes in found.tags:
            assert tag not in ("script", "style", "link", "img", "iframe", "a"), name
            assert not any(key.startswith("on") or key in ("href", "src", "class", "id") for key in attributes), name
            for key in ("fill", "stroke"):
                assert attributes.get(key, "none") in ("none", "currentColor"), name
            assert "background" not in attributes.get("style", ""), name
            assert set(attributes.get("style", "").replace("color:inherit", "").split("color:")[1:]) == set(), name


def texts_of(one):
    return Reader(one._repr_html_()).texts


def test_a_front_shows_its_choices_in_the_units_of_its_problem(shown):
    front = shown["front"]
    knee, texts = front.knee(), texts_of(front)
    assert "acceleration [deg/s²]" in texts
    start = next(k for k, text in enumerate(texts) if "knee" in text.split(", "))
    values = [knee.F["time"], *np.degrees([knee.F["acceleration"], knee.F["jerk"]])]
    assert texts[start + 1 : start + 5] == [str(knee.index), *(f"{value:.5g}" for value in values)]
    assert "<svg" in front._repr_html_()


def test_a_solution_shows_where_its_joints_go(shown):
    knee = shown["knee"]
    texts, q = texts_of(knee), np.degrees(knee.trajectory.sample(2).q[0])
    start = texts.index("joint_1")
    speed = np.degrees(knee.trajectory.peak(1)[0, 0])
    assert texts[start + 1 : start + 4] == [f"{q[0, 0]:.4g} deg", f"{q[-1, 0]:.4g} deg", f"{speed:.4g} deg/s"]
    assert knee._repr_html_().count("<svg") == 2
    closest = max(knee.G, key=knee.G.get)
    assert texts[texts.index("used") + 1] == closest


def test_a_capacity_shows_what_each_joint_carries(shown):
    capacity = shown["capacity"]
    texts = texts_of(capacity)
    assert str(capacity) in texts
    for name, mass in zip(capacity.joint_names, capacity.per_joint, strict=True):
        assert texts[texts.index(name) + 1] == f"{mass:.5g}"


def test_a_robot_shows_its_limits_with_their_units(shown):
    texts = texts_of(shown["robot"])
    start = texts.index("elbow_joint")
    assert texts[start + 1 : start + 6] == ["-3.142 to 3.142 rad", "3.15 rad/s", "none", "none", "150 N·m"]


def test_limits_that_differ_by_direction_are_both_shown():
    limits = {"effort": {"backward": 60.0, "forward": 80.0}, "acceleration": 10.0, "jerk": 100.0}
    assert "80 / 60 N·m" in texts_of(t.load_robot("ur5", tool="tool0", limits=limits))


def test_a_certificate_and_a_verification_show_every_quantity(shown):
    certificate, verification = shown["certificate"], shown["verification"]
    assert {row.name for row in certificate.by_quantity} <= set(texts_of(certificate))
    assert {row.limit for row in verification.by_limit} <= set(texts_of(verification))


def test_a_study_shows_its_factors_and_results(shown):
    assert "printed, quintic" in texts_of(shown["study"])
    texts = texts_of(shown["results"])
    assert {"interpolant=printed", "interpolant=quintic", "least jerk [deg/s³]"} <= set(texts)
    assert "4 cells: 4 finished" in texts_of(shown["standing"])


def test_names_from_files_stay_text():
    evil = "<script>alert(1)</script>"
    objectives = (
        Objective(evil, "s", evil, total_time),
        Objective("b&b", "s", "x", lambda rollout: -total_time(rollout)),
    )
    front = t.optimise(small_problem(objectives=objectives), **SMALL, polish=False)
    robot = replace(t.load_robot("pointing_mechanism"), name=evil, reference=evil)
    for one in (front, front[0], front.problem, robot):
        text = one._repr_html_()
        assert "<script" not in text
        assert evil in "".join(Reader(text).texts)


def test_a_solution_without_its_problem_says_so(tmp_path):
    front = t.optimise(small_problem(), **SMALL, polish=False)
    front.save(tmp_path / "front.json")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        alone = t.Front.load(tmp_path / "front.json").knee()
    assert any("no motion: " in text and "pass it as problem=" in text for text in texts_of(alone))
