"""
Which algorithm, over five seeds
================================

Hypervolume by generation of three algorithms: the median of five seeds within its quartiles.
"""

from tempfile import TemporaryDirectory

from trajevo import Study, collect, run_study
from trajevo.study import plots as study_plots

with TemporaryDirectory() as folder:
    study = Study(
        "pointing",
        seed=1,
        repeats=5,
        generations=40,
        population=60,
        polish=False,
        factors={"algorithm": ["nsga2", "sms-emoa", "spea2"]},
    )
    run_study(study, folder, progress=False)
    axes = study_plots.hypervolume_bands(collect(folder), "algorithm", width=120)
    axes.set_ylim(0.42, None)
