"""Acquisition functions: from a posterior and candidate ISIs to scores."""

from __future__ import annotations

from isiw.acquisition.botorch import BotorchAcquisition
from isiw.acquisition.fixed import EvenSpacing, IncrementalSweep, OwnProposal, RandomIsi, SobolIsi
from isiw.acquisition.improvement import KnowledgeGradient, LogExpectedImprovement, Thompson, UpperConfidenceBound
from isiw.acquisition.information import Alternating, MutualInformation, WindowGain, WindowInformation
from isiw.acquisition.levelset import IntegratedFeasibility, Straddle
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.twostep import TwoStep
from isiw.acquisition.variance import EdgeVariance, IntegratedVariance, ProfileVariance

__all__ = [
    "AcquisitionFunction",
    "Alternating",
    "BotorchAcquisition",
    "EdgeVariance",
    "EvenSpacing",
    "IncrementalSweep",
    "IntegratedFeasibility",
    "IntegratedVariance",
    "KnowledgeGradient",
    "LogExpectedImprovement",
    "MutualInformation",
    "OwnProposal",
    "ProfileVariance",
    "RandomIsi",
    "SobolIsi",
    "Straddle",
    "Thompson",
    "TwoStep",
    "UpperConfidenceBound",
    "WindowGain",
    "WindowInformation",
]
