"""
What a little more of each limit would buy
==========================================

Along a front some limits bind, and each has a price: seconds gained for one per cent more of it. Multipliers of the
optimum at each solution give them.
"""

from trajevo import Robot, ViaPointProblem, optimise, plots

arm = Robot.from_limits(
    velocity=[1.6, 1.9, 1.9],  # rad/s
    acceleration=[6.0, 7.0, 6.0],  # rad/s²
    jerk=[60.0, 80.0, 60.0],  # rad/s³
    names=["base", "shoulder", "elbow"],
)
points = [[0.0, 0.5, -0.3], [0.8, -0.4, 0.6], [0.2, 0.9, 0.1], [1.0, 0.0, 0.5]]  # rad
problem = ViaPointProblem(robot=arm, points=points, objectives=("time", "jerk"), duration_bounds=(0.05, 5.0))
front = optimise(problem, seed=1, generations=40)
plots.exchange_rates(front.sensitivities("time", most=12))
