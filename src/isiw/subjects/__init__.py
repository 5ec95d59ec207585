"""Simulated people: the cohorts on which strategies are compared, and the truth about each person."""

from isiw.subjects.changes import Change, Plasticity, TapResponse
from isiw.subjects.cohorts import COHORTS, another_day, cohort
from isiw.subjects.measured import LABS, MEASURED_KIM, WIDTHS_KIM_MS, Lab, MeasuredPerson, lab
from isiw.subjects.responses import (
    EmgFloor,
    GainResponse,
    OpposedProfile,
    PeakProfile,
    Profile,
    RecruitmentResponse,
    ResponseCurve,
    TrialNoise,
    TwoPeakProfile,
)
from isiw.subjects.subject import Drift, Responder, Response, SimulatedSubject
from isiw.subjects.thresholds import THRESHOLD_COHORTS, HotSpot, StimulatedPerson, StimulatedResponder, threshold_cohort

__all__ = [
    "COHORTS",
    "LABS",
    "MEASURED_KIM",
    "THRESHOLD_COHORTS",
    "WIDTHS_KIM_MS",
    "Change",
    "Drift",
    "EmgFloor",
    "GainResponse",
    "HotSpot",
    "Lab",
    "MeasuredPerson",
    "OpposedProfile",
    "PeakProfile",
    "Plasticity",
    "Profile",
    "RecruitmentResponse",
    "Responder",
    "Response",
    "ResponseCurve",
    "SimulatedSubject",
    "StimulatedPerson",
    "StimulatedResponder",
    "TapResponse",
    "TrialNoise",
    "TwoPeakProfile",
    "another_day",
    "cohort",
    "lab",
    "threshold_cohort",
]
