"""
Which interpolant, over five seeds
==================================

What half of the seeds reach, within a band from one to three quarters: a study of two factors collected into
attainment surfaces.
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
        factors={"interpolant": ["smooth", "quintic"]},
    )
    run_study(study, folder, progress=False)
    results = collect(folder)
    study_plots.attainment(results, "interpolant", objectives=("time", "acceleration"), width=120)
