"""
Ten seeds
=========

Hypervolume by generation of ten seeds, without polish: how much luck is in one run.
"""

import matplotlib.pyplot as plt

from trajevo import optimise, plots
from trajevo.problems import PointingMechanism

problem = PointingMechanism()
with plots.style():
    figure, axes = plt.subplots(figsize=(120 / 25.4, 2.4), layout="constrained")
    for seed in range(1, 11):
        front = optimise(problem, generations=60, population=60, seed=seed, polish=False)
        axes.plot(range(1, 61), front.history.hypervolume, label=f"seed {seed}")
    axes.set(xlabel="generation", ylabel="hypervolume / reference box")
    axes.legend(ncols=2)
