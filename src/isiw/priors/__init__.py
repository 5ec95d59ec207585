"""Priors learnt from earlier sessions: of a lab's own people, and of the same person another day."""

from isiw.priors.days import DayToDay, after, moved, recalled
from isiw.priors.differing import Difference, differences
from isiw.priors.file import check_lab_output, load, read_lab_prior, write_lab_prior
from isiw.priors.lab import LabPrior, LearntSession, compared, densities, learn

__all__ = [
    "DayToDay",
    "Difference",
    "LabPrior",
    "LearntSession",
    "after",
    "check_lab_output",
    "compared",
    "densities",
    "differences",
    "learn",
    "load",
    "moved",
    "read_lab_prior",
    "recalled",
    "write_lab_prior",
]
