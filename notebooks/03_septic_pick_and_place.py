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
# # Pick and place with the PUMA 560: what is a septic worth?
#
# Raji 2022 moves a PUMA 560 through four points with one polynomial of degree 7 and leaves its multi-objective
# optimisation as future work. Here are the printed motion, its rivals on equal terms, and that optimisation.

# %%
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from trajevo import animate, dlcc, optimise, overshoot, plots, rivals_of, rivals_table
from trajevo.problems import PickAndPlace, ViaPointProblem, pick_and_place, puma_kinematics

FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 100, "population": 100} if FULL else {"generations": 15, "population": 40}

# %% [markdown]
# ## The printed motion
# 2, 4 and 3 s between take, lift, unload and place. It passes the points, and swings far beyond them in between.

# %%
problem = PickAndPlace(payload=2.5)
printed = problem.rollout(pick_and_place.paper_solution())
beyond = overshoot(printed.trajectory, problem.interpolant.points)[0]
print("overshoot [rad]:", dict(zip(problem.robot.joint_names, beyond.round(5).tolist())))
print("tool height at the points [m]:", puma_kinematics.forward_kinematics(problem.interpolant.points.positions)[:, 2, 3].round(4))
time, jerk, energy = problem.evaluate(pick_and_place.paper_solution())[0][0]
print(f"{time:.0f} s, Σ RMS jerk {jerk:.4f} rad/s³, {energy:.1f} J")
plots.profiles(printed, via_times=problem.via_times(pick_and_place.paper_solution())[0])
plots.stick_figure(printed);

# %% [markdown]
# ## Rivals on equal terms
# Each interpolant as fast as the limits of velocity, acceleration, jerk and torque allow.

# %%
rivals = rivals_of(problem)
headers, rows = rivals_table(rivals)
for row in [headers, *rows]:
    print("".join(f"{cell:>18}" if i == 0 else f"{cell:>12}" for i, cell in enumerate(row)))
plots.plot_rivals(rivals);

# %% [markdown]
# ## The future work: time, jerk and energy

# %%
front = optimise(problem, seed=0, progress=False, **SIZE)
knee = front.knee()
front

# %% [markdown]
# The page of the front: a click on a solution shows its motion inside its limits and the robot along it;
# `page.solution` is what was clicked, the knee until then.

# %%
page = front.widget(height=760)
page

# %%
page.solution

# %%
knee

# %%
dominating = (front.F <= problem.evaluate(pick_and_place.paper_solution())[0]).all(axis=1).sum()
print(f"{dominating} points dominate the printed times")
plots.front(front, mark={"knee": knee, "printed times": problem.evaluate(pick_and_place.paper_solution())[0][0]});

# %% [markdown]
# ## What can it carry?

# %%
for label, motion in {"printed": printed, "knee": knee, "fastest": front.least("time")}.items():
    print(f"{label}: {dlcc(motion)}")
plots.effort_utilisation(front.least("time"));

# %% [markdown]
# ## The arm in real time
# One HTML file with meshcat's viewer inside, to be opened in any browser without network.

# %%
page = animate(knee, Path(tempfile.mkdtemp()) / "knee.html")
print(f"{page.name}: {page.stat().st_size / 1e6:.2f} MB")

# %% [markdown]
# ## Less swing
# A spline that may leave the points by half a radian only, by the general problem for any robot.

# %%
calm = ViaPointProblem(
    robot="puma560",
    points=problem.settings["points"],
    interpolant="quintic_spline",
    objectives=("time", "jerk"),
    constraints=("position", "velocity", "acceleration", "jerk", "effort"),
    overshoot=0.5,
    payload=2.5,
)
calm_front = optimise(calm, seed=0, progress=False, **SIZE)
print(f"{len(calm_front)} points, fastest {calm_front.F[0, 0]:.3f} s")
plots.profiles(calm_front.knee())
plt.show()
