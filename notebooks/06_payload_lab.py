# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # The payload lab: what can this robot carry, on this motion, here, and with the load off centre?
#
# The hybrid manipulator of Guo 2016 on the motion of its Table 7, and a UR5 of example-robot-data across a table.

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from trajevo import (
    Payload,
    Pose,
    ToolPlane,
    allowed_centres,
    allowed_regions,
    capacities,
    capacity_front,
    dlcc,
    dlcc_iterative,
    largest_payload,
    load_robot,
    load_task,
    max_payload_problem,
    optimise,
    payload_diagram,
    payload_effort,
    plots,
    price_along_path,
    price_of_uncertainty,
    robust_capacity,
    robust_curve,
    sensitivity,
    slowdown_curve,
    slowdown_for,
    solve_nnc,
    workspace_capacity,
    worst_case,
)
from trajevo.problems import HybridManipulator, hybrid_manipulator

# Set TRAJEVO_FULL=1 for the full size; the default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 150, "population": 100} if FULL else {"generations": 40, "population": 40}
CELLS = 41 if FULL else 11

# %% [markdown]
# ## Along a motion
#
# Effort is affine in the mass, so the largest payload is in closed form; the paper's iteration agrees within its step.

# %%
hybrid = HybridManipulator()
table_7 = hybrid.rollout(hybrid_manipulator.paper_solution())
capacity = dlcc(table_7)
print("iteration:  ", dlcc_iterative(table_7, step=0.05))
print("sensitivity:", sensitivity(table_7))
capacity

# %%
plots.capacity_margins(capacity);

# %% [markdown]
# ## Faster or slower along the same path

# %%
for payload in (10.0, 12.0):
    print(slowdown_for(table_7, payload))
plots.slowdown_curve(slowdown_curve(table_7));

# %% [markdown]
# ## A UR5 across a table
#
# Every solution of its front carries something else; the torque limits are those of the URDF, not the maker's rating.

# %%
task = load_task("ur5_pick_and_place")
front = task.solve(progress=False, **SIZE)
knee, fastest = front.knee(), front.pick("least_time")
print("knee:      ", dlcc(knee))
print("least time:", dlcc(fastest))
carried = capacities(front)
carried

# %% [markdown]
# The page of the front: a click on a solution shows its motion inside its limits and the robot along it;
# `page.solution` is what was clicked, the knee until then.

# %%
page = front.widget(height=760)
page

# %%
page.solution

# %%
plots.front_capacities(carried, knee=knee.index);

# %%
plots.capacity_margins(dlcc(knee))
plots.slowdown_curve(slowdown_curve(knee));

# %% [markdown]
# ## The vendor's diagram, for these motions
#
# The load sits L_xy off the tool's z axis and L_z along it, in the worst direction.

# %%
xy, z = np.linspace(0.0, 0.3, 61), np.linspace(-0.1, 0.3, 61)
efforts = {"knee": payload_effort(knee), "least time": payload_effort(fastest)}
plots.payload_contours({name: payload_diagram(effort, xy, z) for name, effort in efforts.items()})
plots.payload_contours(payload_diagram(payload_effort(table_7), xy, z));

# %% [markdown]
# ## Where may the centre of mass of a known payload lie?
#
# A polyhedron where the inertia about the tool is known; for a point mass in motion effort is quadratic in its place.

# %%
known = efforts["knee"].with_inertia_about_tool(np.diag([0.02, 0.02, 0.02]))
print("allowed 50 mm off the axis with 8 kg:", allowed_centres(known, 8.0).contains([[0.05, 0.0, 0.05]]))
_, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.6), layout="constrained")
plots.allowed_region(allowed_regions(known, [4.0, 8.0, 12.0, 16.0], within=0.3, axis="y"), ax=left)
regions = allowed_regions(payload_effort(table_7), [4.0, 8.0, 10.0, 11.5], within=0.3, axis="y")
plots.allowed_region(regions, ax=right);

# %% [markdown]
# ## A payload that is known only to intervals

# %%
box = [[-0.02, -0.02, 0.03], [0.02, 0.02, 0.07]]
print(robust_capacity(efforts["knee"], com=box))
print(worst_case(efforts["knee"], mass=(2.5, 3.5), com=box))
plots.robust_mass(robust_curve(efforts["knee"], com=(0.0, 0.0, 0.05), within=0.1));

# %% [markdown]
# What that costs in time, the motion optimised again for every payload of the intervals, and slowed along its path.

# %%
loaded = task.problem.with_payload(Payload(12.0, (0.0, 0.0, 0.05)))
tolerances = np.linspace(0.0, 0.06, 7 if FULL else 4)
again = price_of_uncertainty(loaded, tolerances, seed=1, starts=1)
same_path = price_along_path(loaded.rollout(again.X[:1]), tolerances)
plots.uncertainty_price({"optimised again": again, "the same path": same_path});

# %% [markdown]
# ## Payload as an objective
#
# The front of time and payload, evolved and polished, and by normal constraints, and the curve of least times, each payload
# optimised again from its neighbour's motion. Weight only, as the paper has it; intervals up to 3 s.

# %%
wide = HybridManipulator(payload_model="weight_only", payload_bounds=(0.0, 13.0), duration_bounds=(0.002, 3.0))
problem = max_payload_problem(wide, objectives=["time"])
evolved, exact = optimise(problem, seed=1, progress=False, **SIZE), solve_nnc(problem, seed=1, points=6 if FULL else 4)
masses = [0.0, 4.0, 8.0, 10.0, 11.0, 11.5, 12.0, 12.3, 12.44] if FULL else [0.0, 8.0, 11.0, 12.0, 12.44]
curve = capacity_front(wide, masses, seed=1, starts=1)
print("largest payload of any motion found:", largest_payload(wide, seed=1, starts=2))
for time in (2.5, 3.0, 4.0, 6.19) if FULL else (3.0, 6.19):
    print(f"within {time:4} s:", largest_payload(wide, within=time, seed=1, starts=1))
ax = plots.payload_curve(curve, at_rest=problem.payload_range[1])
ax.plot(evolved.F[:, 0], evolved.X[:, -1], ".", label="evolved and polished")
ax.plot(exact.F[:, 0], exact.X[:, -1], "s", mfc="none", label="normal constraints")
ax.set(xlim=(2.0, 8.0))
ax.legend();

# %%
with_energy = optimise(max_payload_problem(wide, objectives=["time", "energy"]), seed=1, progress=False, **SIZE)
plots.payload_front(with_energy);

# %% [markdown]
# ## Over the workspace
#
# What is held at rest at every tool position of a plane, tool down, in the best posture found; hatched where the tool
# does not get. The hybrid manipulator holds the same everywhere, so it is shown accelerated.

# %%
free = {"acceleration": np.inf, "jerk": np.inf}
ur5 = load_robot("ur5", tool="tool0", limits=free)
panda = load_robot(
    "panda", tool="panda_hand", limits=free, lock={"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
)
down = np.diag([1.0, -1.0, -1.0])
middle = wide.interpolant.points.positions[5]
position, rotation = (values[0] for values in wide.robot.tool_poses(middle[None]))
maps = {
    "UR5": workspace_capacity(ur5, ToolPlane.around(Pose([0.0, 0.11, 0.3], down), "xz", reach=0.9, cells=CELLS)),
    "Panda": workspace_capacity(panda, ToolPlane.around(Pose([0.0, 0.0, 0.4], down), "xz", reach=0.9, cells=CELLS)),
    "hybrid manipulator": workspace_capacity(
        wide.robot,
        ToolPlane.around(Pose(position, rotation), "xy", reach=0.4, cells=CELLS),
        acceleration=(5.0, -5.0, 0.0),
        start=middle,
    ),
}
_, axes = plt.subplots(1, 3, figsize=(16.0, 5.0), layout="constrained")
for panel, (name, found) in zip(axes, maps.items(), strict=True):
    plots.workspace_capacity(found, ax=panel)
    print(f"{name}: {found}")
