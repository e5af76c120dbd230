"""Studies: a run for every combination of factor levels, on one machine or a cluster, and the results.

Tables and pictures are made by :mod:`trajevo.study.report`, single plots by :mod:`trajevo.study.plots`.
"""

from trajevo.study.cluster import DaskCluster
from trajevo.study.collection import collect
from trajevo.study.definition import Study, load_study
from trajevo.study.engines import InProcess, Processes
from trajevo.study.results import StudyResults
from trajevo.study.run import StudyStanding, run_study, study_standing

__all__ = [
    "DaskCluster",
    "InProcess",
    "Processes",
    "Study",
    "StudyResults",
    "StudyStanding",
    "collect",
    "load_study",
    "run_study",
    "study_standing",
]
