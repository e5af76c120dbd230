"""
Where a UR5 should stand
========================

Least time of the task ``ur5_base``, which carries 3 kg over three points, from every place of the robot's base, each
solved by gradients. Hatched places miss a point.
"""

from trajevo import base_map, load_task, plots

plots.base_map(base_map(load_task("ur5_base").problem, cells=15), width=120)
