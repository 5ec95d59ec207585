"""What every posterior of particles answers, whatever a particle's latents mean."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from isiw.design import DesignSpace
from isiw.models.particles.compiled import Law
from isiw.models.particles.swarm import Moving, Swarm
from isiw.models.protocol import Observation
from isiw.models.shared.history import History, observed
from isiw.types import Array, FloatArray, Singles


class _Model(Protocol):
    """What is asked of a model's settings."""

    @property
    def detection_limit_mv(self) -> float: ...
    @property
    def response_threshold_mv(self) -> float: ...
    @property
    def moves(self) -> Moving: ...


class _Sample(Protocol):
    """What equally weighted particles say about the next MEP and about the window."""

    def outcome_mass(self, isi_ms: Singles) -> Singles: ...
    def window_masks(self, isi_ms: Singles) -> Singles: ...
    def expected_mep_mv(self, isi_ms: Singles) -> Singles: ...
    def baselines_mv(self) -> Singles: ...


M = TypeVar("M", bound=_Model)


@dataclass(frozen=True, eq=False)
class SwarmPosterior(ABC, Generic[M]):
    """The posterior of b people."""

    model: M
    space: DesignSpace
    seed: int
    swarm: Swarm
    law: Law

    @cached_property
    @abstractmethod
    def sample(self) -> _Sample:
        """The particles that represent all of them where every candidate ISI is scored."""

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt."""
        return self.swarm.trials + self.swarm.stood_for

    @cached_property
    def pairs(self) -> int:
        """Number of them that were pairs of stimuli; see `CountsPairs`."""
        return int((~np.isnan(self.swarm.history.isi_ms[0])).sum())

    @property
    def trouble(self) -> str | None:
        """What is wrong with the particles; see `ReportsTrouble`."""
        return self.swarm.trouble

    def after(self, observation: Observation) -> Self:
        """The posterior after one more trial."""
        swarm = self.swarm.after(self._trial(observation), self.law, self.model.moves, self.seed)
        return replace(self, swarm=swarm)

    def condition(self, isi_ms: Array, mep_mv: Array) -> Self:
        """The same particles, weighed by an imagined trial; see `Conditions`."""
        return replace(self, swarm=self.swarm.conditioned(self._trial(Observation.of(isi_ms, mep_mv)), self.law))

    def _trial(self, observation: Observation) -> History:
        known = self.model.detection_limit_mv, self.model.response_threshold_mv
        return observed(observation, *known, order=self.swarm.trials)

    def outcome_mass(self, isi_ms: Array) -> Singles:
        """Predictive distribution of the next MEP; see `PredictsOutcomes`."""
        return self.sample.outcome_mass(singles(isi_ms))

    def window_masks(self, isi_ms: Array) -> Singles:
        """Sampled windows; see `SamplesWindows`."""
        return self.sample.window_masks(singles(isi_ms))

    def profiles_mv(self, isi_ms: Array) -> Singles:
        """Sampled profiles; see `SamplesProfiles`."""
        return self.sample.expected_mep_mv(singles(isi_ms))

    def baselines_mv(self) -> Singles:
        """Sampled baselines; see `SamplesProfiles`."""
        return self.sample.baselines_mv()

    def log_evidence(self) -> FloatArray:
        """Log marginal likelihood of the trials [nat]; see `HasEvidence`."""
        return self.swarm.evidence


def singles(values: Array) -> Singles:
    """As the engine takes numbers: in single precision, side by side."""
    return np.ascontiguousarray(values, dtype=np.float32)
