"""Before any window: the resting motor threshold and the hot spot [Kim2020, 4.2.1]."""

from isiw.strategy.threshold.bayes import BayesThreshold, FiveOfTen, MaximumLikelihood, RecruitmentBelief
from isiw.strategy.threshold.pulses import IntensityRange, Pulse, ThresholdEstimate, ThresholdMethod
from isiw.strategy.threshold.search import ThresholdSearch, list_threshold_methods, make_threshold_search

__all__ = [
    "BayesThreshold",
    "FiveOfTen",
    "IntensityRange",
    "MaximumLikelihood",
    "Pulse",
    "RecruitmentBelief",
    "ThresholdEstimate",
    "ThresholdMethod",
    "ThresholdSearch",
    "list_threshold_methods",
    "make_threshold_search",
]
