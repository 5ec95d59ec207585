"""Models of a person's responses, each in a module of its own, behind the protocols that are gathered here."""

from __future__ import annotations

from isiw.models.protocol import (
    Conditions,
    ExpectsTheUsual,
    HasBotorchModel,
    HasEvidence,
    NotesChanges,
    Observation,
    Posterior,
    PredictsOutcomes,
    ProposesIsi,
    ReportsTrouble,
    ResponseModel,
    SamplesDepression,
    SamplesProfiles,
    SamplesWindows,
    SimulatesPeople,
)

__all__ = [
    "Conditions",
    "ExpectsTheUsual",
    "HasBotorchModel",
    "HasEvidence",
    "NotesChanges",
    "Observation",
    "Posterior",
    "PredictsOutcomes",
    "ProposesIsi",
    "ReportsTrouble",
    "ResponseModel",
    "SamplesDepression",
    "SamplesProfiles",
    "SamplesWindows",
    "SimulatesPeople",
]
