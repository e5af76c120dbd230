"""
Which robot
===========

Three arms at one task with a common front: filled what no motion of any arm beats, pale an arm that is never the best.
"""

from trajevo import choose_robot, plots

choice = choose_robot("which_robot", ["ur5", "ur10", "xarm7"], payload=False, progress=False)
plots.robot_fronts(choice, objectives=("time", "energy"), width=120)

# %%
# With the price as a third objective the slowest arm is worth having, as it is the cheapest.

plots.robot_fronts(choice, width=120)
