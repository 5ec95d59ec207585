"""What every posterior of particles answers, whatever a particle's latents mean."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles.engine import Engine
from isiw.models.particles.swarm import Swarm
from isiw.models.protocol import Observation, Tensor
from isiw.models.shared.history import observed


class _Model(Protocol):
    """What is asked of a model's settings."""

    @property
    def detection_limit_mv(self) -> float: ...
    @property
    def response_threshold_mv(self) -> float: ...


class _Sample(Protocol):
    """What equally weighted particles say about the next MEP and about the window."""

    def outcome_mass(self, isi_ms: Tensor) -> Tensor: ...
    def window_masks(self, isi_ms: Tensor) -> Tensor: ...
    def expected_mep_mv(self, isi_ms: Tensor) -> Tensor: ...
    def baselines_mv(self) -> Tensor: ...


M = TypeVar("M", bound=_Model)


@dataclass(frozen=True, eq=False)
class SwarmPosterior(ABC, Generic[M]):
    """The posterior of b people."""

    model: M
    space: DesignSpace
    seed: int
    swarm: Swarm
    engine: Engine

    @cached_property
    @abstractmethod
    def sample(self) -> _Sample:
        """The particles that represent all of them where every candidate ISI is scored."""

    @property
    def device(self) -> torch.device:
        """Where the particles are."""
        return self.swarm.log_weights.device

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt."""
        return self.swarm.trials

    @cached_property
    def pairs(self) -> int:
        """Number of them that were pairs of stimuli; see `CountsPairs`."""
        return self.trials - int(self.swarm.history.isi_ms[0].isnan().sum())

    @property
    def trouble(self) -> str | None:
        """What is wrong with the particles; see `ReportsTrouble`."""
        return self.swarm.trouble

    def told(self, observation: Observation) -> Self:
        """The same particles, weighted by one more trial as well."""
        known = self.model.detection_limit_mv, self.model.response_threshold_mv
        trial = observed(observation, *known, order=self.trials).to(self.device, torch.float32)
        return replace(self, swarm=self.swarm.told(trial, self.engine))

    def condition(self, isi_ms: Tensor, mep_mv: Tensor) -> Self:
        """The same particles, weighted by an imagined trial; see `Conditions`."""
        return self.told(Observation.of(isi_ms, mep_mv))

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP; see `PredictsOutcomes`."""
        return self.sample.outcome_mass(isi_ms.to(self.device, torch.float32))

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows; see `SamplesWindows`."""
        return self.sample.window_masks(isi_ms.to(self.device, torch.float32))

    def profiles_mv(self, isi_ms: Tensor) -> Tensor:
        """Sampled profiles; see `SamplesProfiles`."""
        return self.sample.expected_mep_mv(isi_ms.to(self.device, torch.float32))

    def baselines_mv(self) -> Tensor:
        """Sampled baselines; see `SamplesProfiles`."""
        return self.sample.baselines_mv()

    def log_evidence(self) -> Tensor:
        """Log marginal likelihood of the trials [nat]; see `HasEvidence`."""
        return self.swarm.evidence
