"""
Order and postures
==================

In which order the points of a UR5's task are visited, and with which posture each.
"""

from trajevo import load_task, plots

front = load_task("ur5_order").solve(generations=20, population=40, progress=False)
best = front.pick(int(front.F[:, 0].argmin()))
print(best.visits.told_order)
plots.visits(best, width=120)
