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
# # Forces and payload: the 5-DOF hybrid manipulator of Guo 2016
#
# Eleven points on a saddle line, twelve interval lengths, four objectives, force limits by Pinocchio's inverse dynamics,
# and on top the question what the motion can carry.

# %%
import os

import numpy as np

from trajevo import capacity_front, dlcc, dlcc_iterative, minimise_weighted, optimise, plots
from trajevo.problems import HybridManipulator, hybrid_kinematics, hybrid_manipulator

# The paper's size takes seconds per run; set TRAJEVO_FULL=1 for it. The default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 200, "population": 100} if FULL else {"generations": 25, "population": 60}
STARTS = 20 if FULL else 2
PAYLOADS = [0.0, 4.0, 8.0, 10.0, 11.0, 11.5, 11.853, 12.1] if FULL else [0.0, 8.0, 10.0, 11.0, 11.853]

# %% [markdown]
# ## The front, and the paper's weighted best

# %%
problem = HybridManipulator(payload=10.0)
front = optimise(problem, seed=1, progress=False, **SIZE)
best = front.weighted()
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
best

# %%
plots.front(front, mark={"weighted": best, "knee": front.knee()});

# %%
plots.parallel_coordinates(front, mark=best)
plots.profiles(best);

# %% [markdown]
# ## Table 9, side by side
# F_c on Table 7's times under the three conventions, the optimum by SLSQP from random starts, the best that NSGA-II alone
# holds from random starts, and the best of the polished front. The paper prints 3.093 for NSGA-II and a mean of 3.220 for
# its gradient method.

# %%
print(f"{'convention':12} {'Table 7':>10} {'SLSQP':>10} {'starts there':>13} {'NSGA-II':>10} {'polished':>10}")
for convention in hybrid_manipulator.CONVENTIONS:
    candidate = HybridManipulator(convention=convention)
    table_7 = hybrid_manipulator.cost(candidate.evaluate(hybrid_manipulator.paper_solution())[0])[0]
    optimum = minimise_weighted(candidate, candidate.paper_weights, seed=1, starts=STARTS)
    there = int((optimum.costs < optimum.cost + 1e-5).sum())
    alone = hybrid_manipulator.cost(optimise(candidate, seed=1, starts="random", polish=False, progress=False, **SIZE).F).min()
    polished = hybrid_manipulator.cost(optimise(candidate, seed=1, progress=False, **SIZE).F).min()
    print(
        f"{convention:12} {table_7:10.6f} {optimum.cost:10.6f} {there:6d} of {STARTS:3d} {alone:10.6f} {polished:10.6f}"
    )

# %% [markdown]
# ## What can the motion of Table 7 carry?
# Effort is affine in the payload's mass, so the answer has a closed form. The paper's iteration agrees within its step.

# %%
rollout = problem.rollout(hybrid_manipulator.paper_solution())
dlcc(rollout)

# %%
iterated = dlcc_iterative(rollout, step=0.05)
print("iteration:  ", iterated)
plots.dlcc_iteration(iterated)
plots.effort_utilisation(rollout);

# %%
for model in ("rigid", "weight_only", "tool_axis"):
    print(dlcc(HybridManipulator(payload_model=model).rollout(hybrid_manipulator.paper_solution())))

# %% [markdown]
# ## Payload against time
# Re-optimised for the least time at each payload.

# %%
curve = capacity_front(HybridManipulator(payload_bounds=(0.0, 13.0)), PAYLOADS, seed=1, starts=2)
for payload, time in zip(curve.payloads, curve.times, strict=True):
    print(f"{payload:7.3f} kg in {time:.4f} s")
plots.payload_curve(curve);

# %% [markdown]
# ## How well does the tool follow the saddle?

# %%
motion = rollout.trajectory.sample(2000)
error = hybrid_kinematics.tracking_error(hybrid_kinematics.forward_kinematics(motion.q[0])[0])
print(f"greatest {1e3 * error.max():.4f} mm, standard deviation {1e3 * error.std():.4f} mm (paper: 0.2933, 0.0840)")
plots.tracking_error(motion.t[0], error)
plots.desired_path(hybrid_kinematics.saddle_line(np.linspace(0, 10, 100)), ax=plots.tool_path(rollout));
