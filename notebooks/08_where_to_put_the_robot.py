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
# # Where to put the robot, which robot, in which order?
#
# The best trade-off of a motion is decided before the motion: where the base stands, which arm is bought, which posture reaches a
# point, in which order points are visited. Here all four are decided together with the motion, on the same limits and with the same
# certificates.

# %%
import os

from trajevo import (
    ViaPointProblem,
    base_map,
    certify,
    choose_robot,
    export,
    largest_payload,
    load_task,
    optimise,
    plots,
)

# Set TRAJEVO_FULL=1 for the full size; the default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 80, "population": 60} if FULL else {"generations": 15, "population": 24}

# %% [markdown]
# ## Where should it stand?
#
# A UR5 takes 3 kg from a belt over a scale to a box. Its base may move on a plate, and be raised by 250 mm. First from the place that was
# given, then from all places at once.

# %%
task = load_task("ur5_base")
settings = {name: value for name, value in task.problem.settings.items() if name != "title"}
given = optimise(ViaPointProblem(**settings | {"base": None}), seed=1, progress=False, **SIZE)
moved = task.solve(progress=False, **SIZE)
before, after = given.pick("least_time"), moved.pick("least_time")
print(f"from the given place: {before.F}")
print(f"from the best place:  {after.F}")
print(f"where that is: {after.base}")
print(f"{100.0 * (1.0 - after.F['time'] / before.F['time']):.0f} % less time")
plots.front(moved, mark={"knee": moved.knee(), "least time": after})

# %% [markdown]
# What another place would cost: the least time from every place of the plate, at the height of the fastest. Hatched places miss a point.

# %%
least = base_map(task.problem, cells=21 if FULL else 7, at=after)
print(least)
plots.base_map(least)

# %% [markdown]
# ## Which posture?
#
# Each pose of the tool is reached by up to eight postures: shoulder left or right, elbow up or down, wrist flipped or not. Five poses have
# 32,768 ways through them; which one is taken is a variable of every individual.

# %%
postures = load_task("ur5_postures").solve(progress=False, **SIZE)
quick, frugal = postures.pick("least_time"), postures.pick("least_energy")
for one in (quick, frugal):
    print(one.F, "; ".join(one.postures))
plots.visits(quick)

# %% [markdown]
# ## In which order?
#
# Twelve bolts and marks of a flange in whichever order is best, with one mark before two of the bolts and the other after one.

# %%
ordered = load_task("ur5_order").solve(progress=False, **SIZE)
best = ordered.pick("least_time")
print(best.F, best.order)
place = {point: k for k, point in enumerate(best.order)}
print("precedence kept:", place[11] < place[5] < place[12] and place[11] < place[8])
plots.visits(best)

# %% [markdown]
# ## Which robot?
#
# Five arms at one task, with their prices: one front over all of them. The UR10 is never the best, and the Z1 does not reach.

# %%
choice = choose_robot("which_robot", progress=False, **SIZE)
choice

# %%
plots.robot_fronts(choice, objectives=("time", "energy"), width="page")

# %%
for name in choice.objective_names:
    member = choice.least(name)
    print(f"least {name}: {member.robot}, {member.solution}")

# %% [markdown]
# ## Robots and places together
#
# The same points for two arms, each of which may stand where it likes: who is how fast, and who carries how much?

# %%
anywhere = {
    "points": settings["points"],
    "base": {"moving": {"x": [-0.45, 0.15], "y": [-0.3, 0.3], "z": [0.0, 0.25]}},
    "duration_bounds": settings["duration_bounds"],
    "objectives": ["time", "price"],
    "payload": {"mass": 1.0, "com": [0.0, 0.0, 0.05]},
}
arms = [
    {"name": "ur5", "tool": "tool0", "price": "24000 EUR", "limits": {"acceleration": 14.0, "jerk": 140.0}},
    {"name": "xarm7", "price": "11000 EUR", "limits": {"acceleration": 20.0, "jerk": 500.0}},
]
free = choose_robot(anywhere, arms, seed=1, progress=False, **SIZE)
for arm in free.robots:
    fastest = arm.front.pick("least_time")
    print(f"{arm.name}: {fastest.F['time']:.3f} s from {fastest.base}; largest payload {arm.carried} kg")

# %% [markdown]
# ## Proven, and on its way to the controller
#
# The fastest motion keeps every limit at every instant, from the place that was found for it. A larger payload needs another motion, and
# another place.

# %%
certificate = certify(after)
print(certificate)
print(export(after, "motion.yaml", format="ros2"))

# %%
heaviest = largest_payload(task.problem, seed=1, starts=2)
print(heaviest)
