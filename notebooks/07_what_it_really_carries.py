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
# # What does this arm really carry, over a shift of 24 hours?
#
# Torque limits of a rigid arm say what it bears for a moment. Motors get warm, lose torque with speed, joints give way, a grip
# slips, a table tips over. Here all of them are asked about one motion of a UR5, and which of them binds.
#
# `ur5_drives` is the arm of example-robot-data with drives, a grip and a stand. **Gear ratio and torque constants are second hand,
# all else of the drives is assumed** (`robots/ur5_drives/SOURCE.md`): the method is real, the numbers are an example.

# %%
import os

import matplotlib.pyplot as plt
import numpy as np

from trajevo import (
    DaskCluster,
    Payload,
    ViaPointProblem,
    capacity_by_pace,
    capacity_study,
    dlcc,
    drive_load,
    energy_balance,
    full_capacity,
    load_robot,
    optimise,
    plots,
    tool_deviation,
)

# Set TRAJEVO_FULL=1 for the full size; the default is a quick look.
FULL = os.environ.get("TRAJEVO_FULL", "0") == "1"
SIZE = {"generations": 100, "population": 80} if FULL else {"generations": 25, "population": 24}

robot = load_robot("ur5_drives")
for name, drive in robot.drives.items():
    print(f"{name:20s} stiffness {drive.stiffness:g} N·m/rad, torque constant {drive.torque_constant:g} N·m/A")

# %% [markdown]
# ## A motion
#
# Over a conveyor, to a box: the fastest of a front of time and mechanical energy.

# %%
points = np.deg2rad([[0, -69, 80, -97, -90, 0], [57, -52, 69, -109, -69, 46], [115, -74, 92, -103, -90, 0]])
held = ["position", "velocity", "acceleration", "jerk", "effort", "torque_at_speed"]
problem = ViaPointProblem(robot=robot, points=points, payload=3.0, objectives=("time", "energy"), constraints=held)
front = optimise(problem, seed=1, progress=False, **SIZE)
motion = front.pick("least_time")
plots.front(front)
print(f"{motion.rollout.trajectory.duration[0]:.3f} s, {len(front)} trade-offs")

# %% [markdown]
# ## Everything that limits it
#
# It makes the motion, stands still for 1 s, and begins anew, for ever. The tool may give way by 2.5 mm under the payload.

# %%
asked = {"deviation": 2.5e-3, "counted": "payload", "dwell": 1.0}
print("torque of the joints alone:", dlcc(motion))
everything = full_capacity(motion, **asked)
everything

# %%
print(tool_deviation(motion, mass=everything.mass, counted="payload"))
for limit in everything.limits:
    print(f"{limit.cause:16s} {limit.mass:8.3f} kg  {limit.place}")

# %% [markdown]
# ## What binds as the cycle shortens
#
# The same path, slower and faster, with the same second at rest.

# %%
paces = capacity_by_pace(motion, **asked)
print(paces)
plots.what_binds(paces, width="page")
# %% [markdown]
# ## A day
#
# The temperature of the warmest winding over 24 h, with the payload that may be carried for ever and with more. A limit by the mean
# square alone knows no time; the temperature tells after how many cycles there is an end.

# %%
cycle = float(motion.rollout.trajectory.duration[0]) + asked["dwell"]
hours = np.geomspace(cycle / 3600.0, 24.0, 25)
cycles = np.unique(np.maximum(1, np.round(hours * 3600.0 / cycle)).astype(int))
forever = everything.by("temperature")
fig, ax = plt.subplots(figsize=(6.0, 3.2), layout="constrained")
for mass in (0.8 * forever, forever, 1.2 * forever):
    rises = [drive_load(motion, mass=mass, dwell=asked["dwell"], cycles=int(count)).peak_rise.max() for count in cycles]
    ax.semilogx(cycles * cycle / 3600.0, rises, label=f"{mass:.2f} kg")
ax.axhline(min(drive.greatest_rise for drive in robot.drives.values()), color="0.5", linestyle=":")
ax.set(xlabel="time since the cold start [h]", ylabel="greatest rise of a winding [K]")
ax.legend()
# %% [markdown]
# ## Speed, load and duty
#
# Every combination is a cell; a Dask cluster computes them, here two processes of this machine (`pip install 'trajevo[cluster]'`). In a
# script, whose processes import it again, leave `engine` out or put all of it under `if __name__ == "__main__":`.

# %%
loads = {"at the tool": Payload(1.0), "150 mm out": Payload(1.0, com=(0.0, 0.0, 0.15))}
speeds = np.linspace(0.4, 1.3, 19 if FULL else 7)
duties = [0.25, 0.5, 0.75, 1.0] if FULL else [0.4, 1.0]
study = capacity_study(
    motion, speeds=speeds, loads=loads, duties=duties, deviation=2.5e-3, counted="payload", engine=DaskCluster(2)
)
print(study)
for load in loads:
    plots.payload_by_duty(study, load=load)

# %%
best = np.unravel_index(study.per_hour.argmax(), study.shape)
print(
    f"most mass in an hour: {study.per_hour[best]:.0f} kg/h, {study.mass[best]:.2f} kg {study.loads[best[1]]} "
    f"at {study.speeds[best[0]]:.2f} of the speed, moving {100 * study.duties[best[2]]:.0f} % of the time, "
    f"limited by {study.cause[best]}"
)

# %% [markdown]
# ## What it draws
#
# Mechanical energy falls along the front, the slower the motion is. What is drawn from the mains rises: windings are heated while they hold
# the arm, and the controller is on.

# %%
balances = {rule: energy_balance(front.pick(rule)) for rule in ("least_time", "knee", "least_energy")}
for rule, balance in balances.items():
    print(f"{rule}: mechanical {front.pick(rule).F['energy']:.1f} J; {balance}")
plots.energy_uses(balances)
# %%
plots.electrical_power(balances["least_time"])
