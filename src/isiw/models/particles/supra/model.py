"""The particle posterior for TMS above the motor threshold.

Each particle has a segment in which the tap enhances the MEP, one in which it depresses it, or either, or none
[Kim2020, 8.1.3].
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Annotated

from isiw.checks import MOST_OF_A_KIND, Checked, SmallestAmplitude, whole
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.models.particles.posterior import SwarmPosterior, singles
from isiw.models.particles.supra.jumps import law_of
from isiw.models.particles.supra.predictions import SupraSample
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.particles.swarm import Moving, Swarm
from isiw.models.protocol import Observation
from isiw.models.windows import Runs, SampledProfiles, grid_of, profile_grid, sampled_estimate
from isiw.types import Array, Singles
from isiw.window import Window


@dataclass(frozen=True)
class SupraModel(Checked):
    """A particle posterior over enhancement, depression and recruitment.

    Args:
        prior: the prior over people.
        particles: how many particles a person has.
        thinned: how many of the particles represent the posterior when every candidate ISI is scored.
        moves: how often particles move, and when they are resampled.
        detection_limit_mv: an amplitude of 0 lies below this [mV].
        response_threshold_mv: a response that was seen lies above this [mV].
    """

    prior: SupraPrior = field(default_factory=SupraPrior)
    particles: Annotated[int, partial(whole, least=2, most=MOST_OF_A_KIND)] = 2000
    thinned: Annotated[int, partial(whole, least=1, most=MOST_OF_A_KIND)] = 192
    moves: Moving = field(default_factory=Moving)
    detection_limit_mv: SmallestAmplitude = 0.005
    response_threshold_mv: SmallestAmplitude = 0.02

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> SupraPosterior:
        """The posterior before the first trial."""
        law = law_of(self.prior, space)
        return SupraPosterior(self, space, seed, Swarm.of(law, people, self.particles, seed), law)

    def update(self, posterior: SupraPosterior, observation: Observation) -> SupraPosterior:
        """The posterior after one more trial."""
        return posterior.after(observation)


@dataclass(frozen=True, eq=False)
class SupraPosterior(SwarmPosterior[SupraModel]):
    """The posterior of b people."""

    @cached_property
    def sample(self) -> SupraSample:
        """The particles that represent all of them where every candidate ISI is scored."""
        return SupraSample(self.swarm.picked(self.law, self.model.thinned)[1], self.space, self.trials)

    def depressed_masks(self, isi_ms: Array) -> Singles:
        """Sampled depressed segments; see `SamplesDepression`."""
        return self.sample.depressed_masks(singles(isi_ms))

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person, and the segment in which the tap depresses the MEP."""

        def profiles() -> SampledProfiles:
            mep_mv = self.sample.expected_mep_mv(profile_grid(self.space))
            return SampledProfiles(mep_mv[person], self.baselines_mv()[person])

        own = SupraSample(self.swarm.picked(self.law, self.model.particles, person)[1], self.space, 0)
        enhanced, depressed = (Runs.of_masks(masks[0]) for masks in own.masks(grid_of(self.space)))
        estimate = sampled_estimate(enhanced, profiles, self.space)
        probability = len(depressed.found) / len(depressed.pairs)
        segment = Window.from_mask(self.space.grid_ms, depressed.best[0]) if probability >= 0.5 else None
        return estimate.noting(depressed=segment, depressed_probability=probability)
