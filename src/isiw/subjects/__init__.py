"""Simulated people: the cohorts on which strategies are compared, and the truth about each person."""

from isiw.subjects.cohorts import COHORTS, cohort
from isiw.subjects.days import another_day
from isiw.subjects.labs import LABS, Lab, lab
from isiw.subjects.measured import MEASURED_KIM, WIDTHS_KIM_MS, MeasuredPerson
from isiw.subjects.profiles import PeakProfile, Profile, TwoPeakProfile
from isiw.subjects.responses import EmgFloor, GainResponse, RecruitmentResponse, ResponseCurve, TrialNoise
from isiw.subjects.subject import Drift, Responder, Response, SimulatedSubject

__all__ = [
    "COHORTS",
    "LABS",
    "MEASURED_KIM",
    "WIDTHS_KIM_MS",
    "Drift",
    "EmgFloor",
    "GainResponse",
    "Lab",
    "MeasuredPerson",
    "PeakProfile",
    "Profile",
    "RecruitmentResponse",
    "Responder",
    "Response",
    "ResponseCurve",
    "SimulatedSubject",
    "TrialNoise",
    "TwoPeakProfile",
    "another_day",
    "cohort",
    "lab",
]
