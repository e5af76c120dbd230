"""Draws the pictures of pages that show what their lines compute: `python docs/images/draw.py [NAME ...]`."""

import sys
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

from trajevo import (
    Dynamics,
    Payload,
    Pose,
    QuinticSpline,
    Rollout,
    ToolPlane,
    ViaPointProblem,
    ViaPoints,
    allowed_regions,
    base_map,
    capacity_front,
    choose_robot,
    load_problem,
    load_robot,
    load_task,
    max_payload_problem,
    optimise,
    payload_diagram,
    payload_effort,
    plots,
    polish,
    price_along_path,
    price_of_uncertainty,
    solve_nnc,
    workspace_capacity,
)
from trajevo.formulation.constraints.clearance import clearance_along, scene_of
from trajevo.plots.paper import key, log_ticks, panels
from trajevo.plots.pareto import quantities
from trajevo.problems import HybridManipulator

HERE = Path(__file__).parent
UNLIMITED = {"acceleration": np.inf, "jerk": np.inf}
POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]


def page(columns, height):
    """Panels side by side, as wide as a page; height in mm."""
    return plt.subplots(1, columns, figsize=(170 / 25.4, height / 25.4), layout="constrained")[1]


def draw_what_binds():
    """What a UR5-like arm carries by each limit as its cycle shortens, as the gallery draws it."""
    example = HERE.parent / "gallery" / "payload" / "plot_what_binds.py"
    exec(compile(example.read_text(encoding="utf-8"), example.name, "exec"), {})


def draw_placement():
    """Least times of the task ur5_base over the places of its base, and the fronts of the given place and of all."""
    task = load_task("ur5_base")
    settings = {key: value for key, value in task.problem.settings.items() if key != "base"}
    fronts = [optimise(each, task.search) for each in (load_problem("via-points", **settings), task.problem)]
    left, right = page(2, 68)
    plots.base_map(base_map(task.problem, cells=31, at=fronts[1].least("time")), ax=left)
    for found, label in zip(fronts, ("given place", "best of all places"), strict=True):
        right.plot(*found.F.T, ".", markersize=2.5, label=label)
    right.set(xlabel="time [s]", ylabel="energy [J]")
    key(right)


def draw_tilt():
    """Fronts of the task ur5_tilt with the base upright and tilted, and the least share of a limit over tilts."""
    task = load_task("ur5_tilt")
    settings = {key: value for key, value in task.problem.settings.items() if key != "base"}
    fronts = [optimise(each, task.search) for each in (load_problem("via-points", **settings), task.problem)]
    left, right = page(2, 68)
    plots.base_map(base_map(task.problem, axes=("pitch", "roll"), cells=15, objective="effort_ratio"), ax=left)
    for found, label in zip(fronts, ("upright", "tilted"), strict=True):
        right.plot(found.F[:, 0], 100.0 * found.F[:, 1], ".", markersize=2.5, label=label)
    right.set(xlabel="time [s]", ylabel="share of a torque limit [%]")
    key(right)


def draw_payload_diagram():
    """How far off the tool a UR5 can carry what, on two motions, and where the centre of mass may lie."""
    robot = load_robot("ur5", limits=UNLIMITED, tool="tool0")
    spline = QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.3, 5.0))
    motions = [Rollout(Dynamics(robot, Payload(1.0)), spline(np.array([[time, time]]))) for time in (0.6, 1.0)]
    fast, slow = (payload_effort(motion) for motion in motions)
    offsets = np.linspace(0.0, 0.4, 61)
    left, right = page(2, 98)
    named = {"1.2 s": payload_diagram(fast, offsets, offsets), "2 s": payload_diagram(slow, offsets, offsets)}
    plots.payload_contours(named, ax=left)
    known = fast.with_inertia_about_tool(np.diag([0.05] * 3))
    plots.allowed_region(allowed_regions(known, [2.0, 4.0, 6.0, 8.0, 10.0, 12.0], within=0.5, axis="y"), ax=right)


def draw_payload_time():
    """Payload against time of the hybrid manipulator, and with energy."""
    problem = HybridManipulator(payload_model="weight_only", payload_bounds=(0.0, 13.0), duration_bounds=(0.002, 3.0))
    curve = capacity_front(problem, [0.0, 4.0, 6.0, 8.0, 9.0, 10.0, 11.0, 11.5, 12.0, 12.2, 12.4], seed=1)
    loaded = max_payload_problem(problem, objectives=["time"])
    left, right = page(2, 58)
    plots.payload_curve(curve, at_rest=loaded.payload_range[1], ax=left)
    found = solve_nnc(loaded, seed=1, points=15).F
    greatest = loaded.payload_range[1]
    left.plot(found[:, 0], greatest - found[:, 1], "s", mfc="none", color="C2", label="normal constraints")
    left.set_xlim(2.0, 7.0)
    left.legend(loc="lower right")
    with_energy = max_payload_problem(problem, objectives=["time", "energy"])
    plots.payload_front(optimise(with_energy, seed=1, generations=200), ax=right)


def draw_price_of_uncertainty():
    """Least times of a UR5 and of the hybrid manipulator by the tolerance of the centre of mass."""
    ur5 = ViaPointProblem(
        robot={"name": "ur5", "tool": "tool0", "limits": {"acceleration": 1e3, "jerk": 1e6}},
        points=POINTS,
        duration_bounds=(0.2, 5.0),
        objectives=["time", "energy"],
        constraints=["position", "velocity", "effort"],
        payload=Payload(8.0, (0.0, 0.0, 0.1)),
    )
    hybrid = HybridManipulator(payload=10.0)
    given = ((ur5, np.linspace(0.0, 0.1, 11), 1.0), (hybrid, np.linspace(0.0, 0.04, 9), 2.5))
    for ax, (problem, tolerances, share) in zip(page(2, 68), given, strict=True):
        alone = price_of_uncertainty(problem, tolerances, seed=1)
        masses = share * tolerances
        both = price_of_uncertainty(problem, tolerances, mass_tolerances=masses, seed=1)
        path = price_along_path(problem.rollout(both.X[:1]), tolerances, mass_tolerances=masses)
        plots.uncertainty_price({"": alone, "mass as well": both, "the same path": path}, ax=ax)
        ax.set_xlabel("tolerance of each coordinate [mm]")


def draw_workspace():
    """What UR5 and Panda hold, the tool pointing down, and what the hybrid manipulator accelerates."""
    down = np.diag([1.0, -1.0, -1.0])
    ur5 = load_robot("ur5", tool="tool0", limits=UNLIMITED)
    panda = load_robot(
        "panda", tool="panda_hand_tcp", limits=UNLIMITED, lock={"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
    )
    problem = HybridManipulator()
    middle = problem.robot.tool_poses(problem.interpolant.points.positions[5:6])[0][0]
    maps = [
        workspace_capacity(ur5, ToolPlane.around(Pose([0.0, 0.11, 0.3], down), "xz", reach=0.9, cells=31)),
        workspace_capacity(panda, ToolPlane.around(Pose([0.0, 0.0, 0.5], down), "xz", reach=0.9, cells=31)),
        workspace_capacity(
            problem.robot, ToolPlane.around(Pose(middle), "xy", reach=0.4, cells=31), acceleration=(5.0, -5.0, 0.0)
        ),
    ]
    for ax, found, name in zip(page(3, 62), maps, ("UR5", "Panda", "hybrid manipulator"), strict=True):
        plots.workspace_capacity(found, ax=ax)
        ax.set_title(name)


def draw_polish():
    """The hybrid manipulator's front before and after."""
    found = polish(optimise(HybridManipulator(convention="printed"), seed=1, polish=False, progress=False))
    names, _ = quantities(found.front)
    pairs = list(combinations(range(4), 2))
    with panels(None, 6, width="page", columns=3, height=40.0) as axes:
        for ax, (i, k) in zip(axes, pairs, strict=True):
            for front, name, looks in ((found.front, "after", "o"), (found.original, "before", "s")):
                F = front.F[front.thinned()]
                ax.plot(F[:, i], F[:, k], looks, ms=1.2, mew=0, label=name, color="C0" if name == "after" else "C1")
            ax.set(xlabel=names[i], ylabel=names[k], xscale="log", yscale="log")
            log_ticks(ax.xaxis)
            log_ticks(ax.yaxis)
        key(axes[0], title=f"hypervolume {found.hypervolume_before:.3f} before, {found.hypervolume_after:.3f} after")


def draw_clearance():
    """Distance to the post over time, planned with it and without it."""
    task = load_task("xarm7_obstacle")
    settings = {key: value for key, value in task.problem.settings.items() if key != "title"}
    ax = page(1, 60)
    for name, scene in (("planned with the post", settings["scene"]), ("planned without it", None)):
        moving = settings["moving"] if scene else []
        problem = ViaPointProblem(**settings | {"scene": scene, "moving": moving})
        best = optimise(problem, seed=1, population=60, generations=80, progress=False).pick("least_time")
        found = clearance_along(best, scene_of(task.problem.constraints))
        ax.plot(found.t[0], 1e3 * found.least(itself=False)[0], label=name)
    ax.axhline(30.0, color="0.4", linestyle="--", linewidth=0.8, label="clearance")
    ax.set(xlabel="time [s]", ylabel="distance to the post [mm]")
    ax.legend()


def draw_which_robot():
    """Three arms at one task, as the gallery draws them first."""
    choice = choose_robot("which_robot", ["ur5", "ur10", "xarm7"], payload=False, progress=False)
    plots.robot_fronts(choice, objectives=("time", "energy"), width=120)


DRAWN = {name.removeprefix("draw_"): one for name, one in list(globals().items()) if name.startswith("draw_")}

if __name__ == "__main__":
    mpl.use("Agg")
    for name in sys.argv[1:] or DRAWN:
        with plots.style():
            DRAWN[name]()
            plt.savefig(HERE / f"{name}.png", dpi=200)
        plt.close("all")
        print(f"written: docs/images/{name}.png")
