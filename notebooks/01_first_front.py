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
# # A first front: the X-Y pointing mechanism of Sun 2020
#
# Two joints, five directions to point at, four segment times to choose. Fast, gentle and smooth pull against each
# other; NSGA-II finds the trade-offs. Everything inside trajevo is SI; pictures and tables of this problem are in degrees.

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from trajevo import optimise, plots, stop_and_go
from trajevo.problems import PointingMechanism, pointing_mechanism

# The paper's size takes seconds per run; set TRAJEVO_FULL=1 for it. The default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 200, "population": 150} if FULL else {"generations": 25, "population": 40}

# %% [markdown]
# ## The problem
# The path points of Table 4, the limits of Table 2, the objectives of eq. (25).

# %%
problem = PointingMechanism()
problem

# %% [markdown]
# ## The run
# NSGA-II with Table 3's settings, then steps by gradients to where the limits are. The front holds every feasible point of the run that no other dominates; every limit
# was checked at the exact peak of the polynomials, not at samples.

# %%
front = optimise(problem, seed=1, progress=False, **SIZE)
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
plots.hypervolume(front);

# %% [markdown]
# ## Which one?
# The knee, beside the solution the paper chose (its segment times on the same curve).

# %%
knee = front.knee()
table_4 = problem.evaluate(pointing_mechanism.paper_solution())[0][0]
plots.front(front, mark={"knee": knee, "Table 4": table_4});

# %%
plots.front_3d(front, mark={"knee": knee, "Table 4": table_4})
plots.parallel_coordinates(front, mark={"knee": knee, "Table 4": table_4});

# %% [markdown]
# ## The motion at the knee

# %%
knee

# %%
plots.profiles(knee)
plots.tool_path(knee);

# %% [markdown]
# ## The paper's Table 4
# The segment times of Table 4 on four curves. On the printed one joint 1 exceeds its own limit of 10 deg/s, and velocity
# and jerk jump at the middle point; the smooth form of the same idea has neither fault.

# %%
print(f"{'curve':14} {'T [s]':>7} {'S2 [deg/s2]':>12} {'S3 [deg/s3]':>12} {'peak v [deg/s]':>15} {'velocity jump':>14} feasible")
for name in pointing_mechanism.INTERPOLANTS:
    candidate = PointingMechanism(interpolant=name)
    F, G = candidate.evaluate(pointing_mechanism.paper_solution())
    motion = candidate.decode(pointing_mechanism.paper_solution())
    print(
        f"{name:14} {F[0, 0]:7.3f} {np.degrees(F[0, 1]):12.6f} {np.degrees(F[0, 2]):12.6f} "
        f"{np.degrees(motion.peak(1).max()):15.6f} {np.degrees(np.abs(motion.jump(1)).max()):14.6f} {bool(G.max() <= 0)}"
    )

# %% [markdown]
# ## Is the hybrid curve a good one?
# Four interpolants, the same settings: the splines with the highest continuity dominate the paper's curve, and stopping
# at every point with a septic polynomial is faster than the printed hybrid can be.

# %%
fig, ax = plt.subplots(figsize=(7, 4.5), layout="constrained")
for name in pointing_mechanism.INTERPOLANTS:
    found = optimise(PointingMechanism(interpolant=name), seed=1, progress=False, **SIZE)
    ax.plot(found.F[:, 0], np.degrees(found.F[:, 2]), ".", markersize=3, label=f"{name}: {found.F[0, 0]:.2f} s")
for style, profile in (("--", "septic"), (":", "double_s"), ("-.", "trapezoid")):
    baseline = stop_and_go(problem.interpolant.points, problem.robot.limits, profile=profile)
    ax.axvline(baseline.duration[0], color="grey", linestyle=style, label=f"stop and go, {profile}: {baseline.duration[0]:.2f} s")
ax.set(xlabel="time [s]", ylabel="jerk [deg/s³]", ylim=(0, 40))
ax.legend();
