"""The particle posterior over people with a window or none, b sessions at once."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np

from isiw.change import AGAINST_A_CURVE, Misfit
from isiw.checks import MOST_OF_A_KIND, Checked, NonNegative, Share, SmallestAmplitude, whole
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.lazy import Later
from isiw.models.particles.compiled import Asking, Crowd, Law
from isiw.models.particles.jumps import law_of
from isiw.models.particles.latents import Latents, latents_of
from isiw.models.particles.misfit import against_level
from isiw.models.particles.mixture import log_sum
from isiw.models.particles.noise import recruits
from isiw.models.particles.posterior import SwarmPosterior, singles
from isiw.models.particles.predictions import PersonSample, drawn_mep_mv
from isiw.models.particles.prior import Prior
from isiw.models.particles.swarm import Moving, Swarm
from isiw.models.protocol import AtIntensity, Observation, PriorPerson
from isiw.models.shared.draws import NOTED, SIMULATED, seeds, stream
from isiw.models.shared.history import ORDER
from isiw.models.windows import EXCLUDED_AT, SampledHypotheses, SampledProfiles, grid_of, profile_grid, sampled_estimate
from isiw.types import Array, ArrayLike, FloatArray, Singles
from isiw.window import Window

LEAST_SAMPLES = 20
"""Of fewer samples no quantile is told."""


@dataclass(frozen=True)
class ParticleModel(Checked):
    """A particle posterior over profile, recruitment and noise; the default model.

    Args:
        prior: the prior over people.
        particles: how many particles a person has.
        thinned: how many of the particles represent the posterior when every candidate ISI is scored.
        moves: how often particles move, and when they are resampled.
        detection_limit_mv: an amplitude of 0 lies below this [mV].
        amplitude_step_mv: the step of the converter or display that amplitudes come from [mV]; an amplitude then stands
            for the interval of a step about it. None to have it found in the amplitudes, 0 for none.
        response_threshold_mv: a response that was seen lies above this [mV].
        unusual_kept: the part of their probability that unusual starts and widths of the window, intensities, drifts
            and changes keep where the next ISI is chosen; the reported estimate keeps all of it.

    Raises:
        InvalidValueError: fewer than two particles or more than a memory holds, or an invalid number.
    """

    prior: Prior = field(default_factory=Prior)
    particles: Annotated[int, partial(whole, least=2, most=MOST_OF_A_KIND)] = 1000
    thinned: Annotated[int, partial(whole, least=1, most=MOST_OF_A_KIND)] = 192
    moves: Moving = field(default_factory=Moving)
    detection_limit_mv: SmallestAmplitude = 0.005
    amplitude_step_mv: NonNegative | None = None
    response_threshold_mv: SmallestAmplitude = 0.02
    unusual_kept: Share = 0.2

    @cached_property
    def prior_where_asking(self) -> Prior:
        """The prior that ISIs are chosen with."""
        return self.prior.as_usual(self.unusual_kept)

    @property
    def pairs_pct_rmt(self) -> float:
        """The intensity of the pairs' pulse [% RMT]; see `LearnsCurves`."""
        usual = max(self.prior.intensities, key=lambda law: law.share)
        return self.prior.intensity_pct_rmt or usual.pct_rmt.median

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> ParticlePosterior:
        """The posterior before the first trial."""
        self.prior.profile.require_space(space)
        law = law_of(self.prior, space)
        swarm = Swarm.of(law, people, self.particles, seed)
        return ParticlePosterior(self, space, seed, swarm, law, law_of(self.prior_where_asking, space))

    def update(self, posterior: ParticlePosterior, observation: Observation) -> ParticlePosterior:
        """The posterior after one more trial."""
        return posterior.after(observation)

    def simulate(self, space: DesignSpace, seed: int, isi_ms: ArrayLike) -> PriorPerson:
        """Draw one person from the prior, and an MEP at each ISI; see `SimulatesPeople`."""
        law, isis_ms = law_of(self.prior, space), np.asarray(isi_ms, dtype=np.float32)
        latents = law.draws(1, seeds(seed, SIMULATED, 1))
        mep_mv = drawn_mep_mv(law.meanings(*latents, -1), isis_ms, stream(seed, SIMULATED + 1))
        sample = PersonSample(law.meanings(*latents, len(mep_mv)), space)
        return PriorPerson(Window.from_mask(space.grid_ms, sample.window_masks(grid_of(space))[0, 0]), mep_mv)


@dataclass(frozen=True, eq=False)
class ParticlePosterior(SwarmPosterior[ParticleModel]):
    """The posterior of b people."""

    usual: Law  # the prior that ISIs are chosen with
    stronger_pct_rmt: float = 0.0  # by how much the next pulse is stronger than the pairs'

    @cached_property
    def as_usual(self) -> ParticlePosterior:
        """The same with the prior that ISIs are chosen with; see `ExpectsTheUsual`."""
        return replace(self, swarm=self.swarm.as_usual(self.law, self.usual))

    def after(self, observation: Observation) -> ParticlePosterior:
        """The posterior after one more trial; a pulse given alone first may be of another curve than the pairs.

        From where the levels of both are said not to fit, those who have learnt from such pulses are left out.
        """
        given = self.swarm.before_pairs and bool(np.isnan(observation.isi_ms).all())
        doubted = given and observation.shift_pct_rmt is not None
        own = replace(self, swarm=self.swarm.doubting(self.model.prior.other_curve)) if doubted else self._by_levels()
        learnt = super(ParticlePosterior, own).after(observation)
        if learnt.swarm.halves == 1 or given:
            return learnt
        told, people = learnt.swarm.whole_history, range(0, len(learnt.swarm.history.columns), learnt.swarm.halves)
        against = np.array([against_level(told, row) or 0.0 for row in people])
        return replace(learnt, swarm=learnt.swarm.unheeding(against >= AGAINST_A_CURVE))

    def _by_levels(self) -> ParticlePosterior:
        """The same with the law of pulses given alone by levels in place of these, where this is the first other trial.

        A change that was noted since then comes before all that is learnt again.
        """
        if not self.swarm.ends_with_given:
            return self
        before = self.model.prior
        model = replace(self.model, prior=replace(before, changes=replace(before.changes, noted=())))
        law, usual = self._laws(model, by_levels=True)
        swarm = self.swarm.by_levels(self.law, law, self.seed, before.other_curve)
        if swarm is None:
            return self
        begun = replace(self, model=model, swarm=swarm, law=law, usual=usual)
        begun = begun.noting_change() if before.changes.noted else begun
        for trial in self.swarm.others:
            trial.columns[:, 0, ORDER] = begun.swarm.trials
            begun = replace(begun, swarm=begun.swarm.after(trial, begun.law, model.moves, self.seed))
        return begun

    def _laws(self, model: ParticleModel, *, by_levels: bool) -> tuple[Law, Law]:
        """A model's prior, and the one that ISIs are chosen with."""
        priors = model.prior, model.prior_where_asking
        law, usual = (law_of(prior, self.space, by_levels=by_levels) for prior in priors)
        return law, usual

    def noting_change(self) -> ParticlePosterior:
        """The posterior if somebody has seen that something changes now; see `NotesChanges`."""
        trials, before, latents = self.swarm.trials, self.model.prior.changes, self.swarm.latents
        if not trials or trials in before.noted:  # several notes at one trial are one change
            return self
        changes = before.noting(trials)
        model = replace(self.model, prior=replace(self.model.prior, changes=changes))
        rng = stream(self.seed, NOTED + len(changes.noted))
        kind, noted = changes.where_noted(latents.change.shape, rng)
        # Particles that nothing has touched so far stand for those, too, in which something changes now.
        untouched = self.model.prior.untouched(latents, trials)
        share, left = changes.noted_share / before.untouched(trials), 1.0 - changes.noted_share
        chosen = untouched & (rng.random(kind.shape) < share / (share + left))
        values, own = self.swarm.crowd.values.copy(), np.flatnonzero(latents_of("changed", "change"))
        values[..., own] = np.where(chosen[..., np.newaxis], noted, values[..., own])
        kinds = latents.with_kind("change", np.where(chosen, kind, latents.change)).kinds
        law, usual = self._laws(model, by_levels=self.swarm.given is not None)
        log_weights = self.swarm.log_weights + np.where(untouched, math.log(share + left), math.log(left))
        log_weights -= log_sum(log_weights)[:, np.newaxis]
        nothing, log_likelihood = law.nothing_known(*kind.shape), self.swarm.crowd.log_likelihood
        swarm = replace(self.swarm, crowd=Crowd(values, kinds, log_weights, log_likelihood, nothing))
        return replace(self, model=model, swarm=swarm, law=law, usual=usual)

    @cached_property
    def sample(self) -> PersonSample:
        """The particles that represent all of them where every candidate ISI is scored."""
        _, fields = self.swarm.picked(self.law, self.model.thinned)
        return PersonSample(fields, self.space, self.swarm.trials, self.stronger_pct_rmt)

    def reductions(self, isi_ms: Array, *, of_window: bool) -> Singles:
        """How much the next MEP is expected to tell; see `ForeseesReductions`."""
        usual = None if self.swarm.chosen_by is None else self.usual
        how = Asking(of_window, usual, self.stronger_pct_rmt)
        return self.law.ask(self.swarm.crowd, singles(isi_ms), self.model.thinned, self.swarm.trials, how)

    def at_intensity(self, shift_pct_rmt: float) -> AtIntensity:
        """What recruitment curves expect of a stronger pulse, of which other noise says nothing (decision 45)."""
        curved, weights = recruits(self.swarm.latents.noise), self.swarm.log_weights
        share = float(np.exp(weights[curved]).sum() / len(weights))
        if not share:
            return AtIntensity(self, 0.0)
        kept = np.where(curved, weights, -np.inf)
        kept -= log_sum(kept)[:, np.newaxis]
        return AtIntensity(replace(self, swarm=self.swarm.weighing(kept), stronger_pct_rmt=shift_pct_rmt), share)

    def prediction_mv(self, level: float, person: int = 0) -> tuple[FloatArray, FloatArray]:
        """Between which amplitudes the next MEP lies; see `PredictsMeps`."""
        shares = 0.5 + 0.5 * np.array([-level, level])
        low_mv, high_mv = self.sample.mep_quantiles_mv(profile_grid(self.space), shares)[person].T
        return low_mv, high_mv

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""
        prior, swarm = self.model.prior, self.swarm
        crowd = swarm.weighed.of_person(person)
        picks, windows = self.law.estimate(crowd, self.model.particles, swarm.trials)
        latents = swarm.named(crowd).taken(picks)

        def profiles() -> SampledProfiles:
            few = swarm.picked(self.law, self.model.thinned, person)[1]
            sample = PersonSample(few, self.space, swarm.trials)
            return SampledProfiles(sample.expected_mep_mv(profile_grid(self.space))[0], sample.baselines_mv()[0])

        estimate = sampled_estimate(
            windows,
            profiles,
            self.space,
            SampledHypotheses(prior.hypothesis(latents)[0], prior.hypotheses),
            lambda: _excluded_shift_pct_rmt(prior, latents),
        )
        return estimate.noting(
            unusual=Later(lambda: prior.unusual(latents, self.space)),
            change=Later(lambda: prior.change(latents).named(swarm.trials, swarm.stood_for)),
            time_alone=Later(lambda: float((prior.of_time(latents, swarm.trials) & ~latents.present).mean())),
            misfit=Later(
                lambda: Misfit(swarm.bets.worth(person), against_level(swarm.whole_history, person * swarm.halves))
            ),
        )


def _excluded_shift_pct_rmt(prior: Prior, latents: Latents) -> float | None:
    """The shift of the input that recruitment curves exclude [% RMT]; None where few particles have one."""
    shift_pct_rmt = prior.shift_pct_rmt(latents)[recruits(latents.noise)]
    return float(np.quantile(shift_pct_rmt, EXCLUDED_AT)) if len(shift_pct_rmt) >= LEAST_SAMPLES else None
