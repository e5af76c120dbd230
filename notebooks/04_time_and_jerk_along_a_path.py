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
# # Time and jerk along a fixed path: the airfoil of Paing 2021
#
# A path that must not move, limits of velocity, acceleration and jerk for each axis, a longest time. What is free is when
# the tool is where: u(t), a B-spline with 16 control points. The trade-off between time and ∫‖jerk‖² is wanted, all of it.

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from trajevo import optimise, plots, solve_nnc, weighting_factors
from trajevo.problems import TimeJerkReparameterisation, gemini_and_s

# The paper's tolerance takes seconds; set TRAJEVO_FULL=1 for it. The default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
TOLERANCE = 0.01 if FULL else 0.1
GENERATIONS = 100 if FULL else 30

# %% [markdown]
# ## The paper's method under the paper's limits
# `"hull"` are the bounds (20)-(25): the greatest derivatives of the whole path times those of u(t). The front is found by
# normal constraints, divide and conquer, and SQP.

# %%
hull = solve_nnc(TimeJerkReparameterisation(path="gemini", limits="hull"), tolerance=TOLERANCE)
best = hull.utopia()
omega = weighting_factors(hull)[best.index]
fastest, smoothest = hull.F[0], hull.F[-1]
print(f"{len(hull)} points in {hull.run.seconds:.1f} s, from {fastest[0]:.4f} s to {smoothest[0]:.4f} s")
print(f"best trade-off: {best.F['time']:.5f} s at ω = {omega:.4f} (paper: 4.52 s, 0.52)")
print(f"time saved against the smoothest {100 * (1 - best.F['time'] / smoothest[0]):.1f} % (paper: 43 %)")
print(f"jerk saved against the fastest {100 * (1 - best.F['jerk'] / fastest[1]):.1f} % (paper: 81 %)")
plots.path(best, points=gemini_and_s.gemini_points());

# %% [markdown]
# ## Limits that are as tight as they are proven
# The hull takes the path's worst curvature everywhere. `"tight"` bounds the true velocity, acceleration and jerk of every
# axis, to one part in a million and from above.

# %%
tight = solve_nnc(TimeJerkReparameterisation(path="gemini"), tolerance=TOLERANCE)
print(f"least time {fastest[0]:.4f} s with the hull, {tight.F[0, 0]:.4f} s with tight limits")
plots.profiles(best)
plots.profiles(tight.least("time"));

# %% [markdown]
# The page of the front: a click on a solution shows its motion inside its limits and the robot along it;
# `page.solution` is what was clicked, the knee until then.

# %%
page = tight.widget(height=760)
page

# %%
page.solution

# %% [markdown]
# ## Evolution on the same problem
# With rises of u(t) as variables and the least time of each in closed form every individual is feasible. And since
# ∫‖jerk‖² falls with the fifth power of the time, each u(t) is a whole curve of the front: `encoding="shape"` evolves
# these curves.

# %%
evolved = {
    encoding: optimise(
        TimeJerkReparameterisation(path="gemini", encoding=encoding), seed=1, generations=GENERATIONS, progress=False
    )
    for encoding in ("plain", "shape")
}
for encoding, front in evolved.items():
    print(f"{encoding}: {len(front)} points in {front.run.seconds:.1f} s, least time {front.F[0, 0]:.4f} s")

# %% [markdown]
# ## All fronts in one picture
# The paper's baseline u = t / T needs a path that is at rest at both ends, so it is laid anew.

# %%
linear = optimise(
    TimeJerkReparameterisation(path="gemini", interpolant="linear"), seed=1, generations=10, progress=False
)
fronts = {
    "u = t / T, the path laid anew": linear,
    "hull, normal constraints": hull,
    "tight, evolved and polished": evolved["plain"],
    "tight, the same on shapes": evolved["shape"],
    "tight, normal constraints": tight,
}
plots.fronts(fronts, mark={"ω* of the hull": best, "ω* of the tight limits": tight.utopia()});

# %%
plots.parameter({"fastest": tight.least("time"), "ω*": tight.utopia(), "smoothest": tight.least("jerk")});

# %% [markdown]
# ## Is the baseline any good on the S-shaped path?
# The paper says that its method is 3 % faster with 75 % less jerk. It prints no coordinates; on an S of two arcs:

# %%
s = solve_nnc(TimeJerkReparameterisation(path="s", limits="hull"), tolerance=TOLERANCE)
straight = optimise(TimeJerkReparameterisation(path="s", interpolant="linear"), seed=1, generations=10, progress=False)
proposed, baseline = s.utopia().F, straight.utopia().F
print(f"{100 * (1 - proposed['time'] / baseline['time']):.1f} % faster, {100 * (1 - proposed['jerk'] / baseline['jerk']):.1f} % less jerk")
plots.path(s.utopia())
plots.fronts({"u = t / T": straight, "hull": s}, mark={"ω*": s.utopia(), "ω* of u = t / T": straight.utopia()});

# %% [markdown]
# ## Points of your own
# Any points, any limits; a CSV file such as `x [mm], y [mm]` will do as well, and so will the joints of a robot.

# %%
angle = np.linspace(0.0, 2.0 * np.pi, 25)
flower = 0.03 * (1.0 + 0.3 * np.cos(5.0 * angle))[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
own = TimeJerkReparameterisation(
    path=flower, velocity="100 mm/s", acceleration="1000 mm/s^2", jerk="30000 mm/s^3", longest_time=10.0
)
knee = optimise(own, seed=1, generations=GENERATIONS, progress=False).knee()
knee

# %%
plots.path(knee, points=flower)
plt.show()
