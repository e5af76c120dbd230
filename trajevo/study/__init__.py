"""Studies: the product of factors, each cell a run of its own, on one machine or a cluster, and what comes out.

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
