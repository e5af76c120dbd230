"""
One row of points, four curves
==============================

The least time of a PUMA 560 through four points under the same limits, for four interpolants. Freer curves are
faster.
"""

import matplotlib.pyplot as plt

from trajevo import minimise_weighted, plots
from trajevo.formulation.problem import Weights
from trajevo.problems import ViaPointProblem
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS

with plots.style():
    figure, axes = plt.subplots(2, 1, figsize=(170 / 25.4, 4.2), layout="constrained", sharex=True)
    for interpolant in ("cubic", "quintic_spline", "septic_spline", "bspline"):
        problem = ViaPointProblem(
            robot="puma560",
            points=TABLE_1_JOINTS,
            interpolant=interpolant,
            objectives=("time",),
            constraints=("velocity", "acceleration", "jerk"),
        )
        motion = minimise_weighted(problem, Weights((1.0,)), seed=1, starts=3).rollout.trajectory.sample(400)
        name = f"{interpolant}: {motion.t[0, -1]:.3f} s"
        axes[0].plot(motion.t[0], motion.q[0, :, 1], label=name)
        axes[1].plot(motion.t[0], motion.a[0, :, 1], label=name)
    axes[0].set_ylabel("joint 2 [rad]")
    axes[1].set(xlabel="time [s]", ylabel="joint 2 [rad/s²]")
    axes[0].legend(ncols=2)
