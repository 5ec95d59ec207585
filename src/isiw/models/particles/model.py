"""The particle posterior over people with a window or none, b sessions at once."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Annotated

from isiw.checks import (
    MOST_OF_A_KIND,
    Checked,
    NonNegative,
    Positive,
    Share,
    whole,
)
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.lazy import Later, torch
from isiw.models.particles.engine import Engine, EngineName, engine_for
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import Latents, latents_of
from isiw.models.particles.likelihood import levels
from isiw.models.particles.noise import draw_log_mep, log_gain, recruits
from isiw.models.particles.posterior import SwarmPosterior
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Prior
from isiw.models.particles.swarm import Moving, Swarm
from isiw.models.protocol import Observation, PriorPerson
from isiw.models.shared.tables import NOTED, SIMULATED, step_generator
from isiw.models.windows import EXCLUDED_AT, SampledHypotheses, SampledProfiles, grid_of, profile_grid, sampled_estimate
from isiw.types import ArrayLike, FloatArray
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
        device: torch device.
        engine: `"compiled"` on the CPU, or `"torch"`; the same seed asks other ISIs with each.

    Raises:
        InvalidValueError: fewer than two particles or more than a memory holds, or an invalid number.
    """

    prior: Prior = field(default_factory=Prior)
    particles: Annotated[int, partial(whole, least=2, most=MOST_OF_A_KIND)] = 1000
    thinned: Annotated[int, partial(whole, least=1, most=MOST_OF_A_KIND)] = 192
    moves: Moving = field(default_factory=Moving)
    detection_limit_mv: Positive = 0.005
    amplitude_step_mv: NonNegative | None = None
    response_threshold_mv: Positive = 0.02
    unusual_kept: Share = 0.2
    device: str = "cpu"
    engine: EngineName = "compiled"

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_device(self.device)

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
        latents = self.prior.sample(people, self.particles, step_generator(self.device, seed, 0), space)
        return ParticlePosterior(self, space, seed, Swarm.of(latents), *_engines(self, space))

    def update(self, posterior: ParticlePosterior, observation: Observation) -> ParticlePosterior:
        """The posterior after one more trial."""
        after = posterior.told(observation)
        generator = step_generator(self.device, posterior.seed, after.trials)
        return replace(after, swarm=after.swarm.moved(posterior.engine, self.moves, generator))

    def simulate(self, space: DesignSpace, seed: int, isi_ms: ArrayLike) -> PriorPerson:
        """Draw one person from the prior, and an MEP at each ISI; see `SimulatesPeople`."""
        generator = step_generator(self.device, seed, SIMULATED)
        latents = self.prior.sample(1, 1, generator, space)
        person = self.prior.person(latents)
        isis_ms = torch.as_tensor(isi_ms, dtype=torch.float32, device=self.device).unsqueeze(0)
        order = torch.arange(isis_ms.shape[-1], dtype=torch.float32, device=self.device)
        changed = self.prior.change(latents).at(order)
        gain, level = log_gain(person.response, order) + changed.log_gain, levels(person, isis_ms) * changed.enhancement
        log_mep = draw_log_mep(person.response, level, generator, gain, changed.shift_pct_rmt) + changed.log_scale
        mask = PersonSample(person.after(len(order)), space).window_masks(grid_of(space, order.device))[0, 0]
        window = Window.from_mask(space.grid_ms, mask.cpu().numpy())
        return PriorPerson(window, log_mep[0, 0].double().exp().cpu().numpy())


@dataclass(frozen=True, eq=False)
class ParticlePosterior(SwarmPosterior[ParticleModel]):
    """The posterior of b people."""

    usual: Engine  # under the prior that ISIs are chosen with

    @cached_property
    def as_usual(self) -> ParticlePosterior:
        """The same with the prior that ISIs are chosen with; see `ExpectsTheUsual`."""
        latents = self.swarm.latents
        log_usual = self.usual.log_usual(latents._replace(log_blocks=None))  # the kept ones are of the other prior
        return replace(self, swarm=self.swarm.times(log_usual - self.engine.log_usual(latents)))

    def noting_change(self) -> ParticlePosterior:
        """The posterior if somebody has seen that something changes now; see `NotesChanges`."""
        trials, before, latents = self.trials, self.model.prior.changes, self.swarm.latents
        if not trials or trials in before.noted:  # several notes at one trial are one change
            return self
        changes = before.noting(trials)
        model = replace(self.model, prior=replace(self.model.prior, changes=changes))
        generator = step_generator(self.model.device, self.seed, NOTED + len(changes.noted))
        kind, noted = changes.where_noted((len(latents.change), self.model.particles), generator)
        # Particles that nothing has touched so far stand for those, too, in which something changes now.
        untouched = self.model.prior.untouched(latents, trials)
        share, left = changes.noted_share / before.untouched(trials), 1.0 - changes.noted_share
        chance = torch.rand(kind.shape, generator=generator, dtype=torch.float32, device=generator.device)
        chosen = untouched & (chance < share / (share + left))
        values = latents.values.clone()
        own = latents_of("changed", "change", device=values.device)
        values[..., own] = torch.where(chosen.unsqueeze(-1), noted, values[..., own])
        latents = Latents(values, latents.kinds).with_kind("change", torch.where(chosen, kind, latents.change))
        swarm = replace(self.swarm, latents=latents).times(
            torch.where(untouched, math.log(share + left), math.log(left))
        )
        engine, usual = _engines(model, self.space)
        return replace(self, model=model, swarm=swarm, engine=engine, usual=usual)

    @cached_property
    def sample(self) -> PersonSample:
        """The particles that represent all of them where every candidate ISI is scored."""
        return self._sample(self.swarm.picked(self.model.thinned))

    def _sample(self, latents: Latents) -> PersonSample:
        return PersonSample(self.engine.meaning(latents, self.trials), self.space, self.trials)

    def prediction_mv(self, level: float, person: int = 0) -> tuple[FloatArray, FloatArray]:
        """Between which amplitudes the next MEP lies; see `PredictsMeps`."""
        isi_ms = profile_grid(self.space).to(self.device)
        shares = 0.5 + 0.5 * torch.tensor([-level, level], dtype=torch.float32, device=isi_ms.device)
        low_mv, high_mv = self.sample.mep_quantiles_mv(isi_ms, shares)[person].T.double().cpu().numpy()
        return low_mv, high_mv

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""
        one, prior = self.swarm.of_person(person), self.model.prior
        latents = one.picked(self.model.particles)

        def profiles() -> SampledProfiles:
            sample = self._sample(one.picked(self.model.thinned))
            return SampledProfiles(
                sample.expected_mep_mv(profile_grid(self.space).to(self.device))[0], sample.baselines_mv()[0]
            )

        estimate = sampled_estimate(
            self._sample(latents).runs(grid_of(self.space, self.device)),
            profiles,
            self.space,
            SampledHypotheses(prior.hypothesis(latents)[0], prior.hypotheses),
            lambda: _excluded_shift_pct_rmt(prior, latents),
        )
        return estimate.noting(
            unusual=Later(lambda: prior.unusual(latents, self.space)),
            change=Later(lambda: prior.change(latents).named(self.trials)),
            time_alone=Later(lambda: float((prior.of_time(latents, self.trials) & ~latents.present).double().mean())),
        )


def _engines(model: ParticleModel, space: DesignSpace) -> tuple[Engine, Engine]:
    """What computes with a model's prior, and with that which ISIs are chosen with."""
    priors = model.prior, model.prior_where_asking
    engine, usual = (engine_for(model.engine, WindowTarget(prior, space), model.device) for prior in priors)
    return engine, usual


def _excluded_shift_pct_rmt(prior: Prior, latents: Latents) -> float | None:
    """The shift of the input that recruitment curves exclude [% RMT]; None where few particles have one."""
    shift_pct_rmt = prior.shift_pct_rmt(latents)[recruits(latents.noise)]
    return float(torch.quantile(shift_pct_rmt, EXCLUDED_AT)) if len(shift_pct_rmt) >= LEAST_SAMPLES else None


def _require_device(name: str) -> None:
    if name == "cpu":  # is always there; settings are read where torch is not needed, too
        return
    try:
        torch.Generator(device=name)
    except (RuntimeError, TypeError) as error:
        raise InvalidValueError(
            "there is no such torch device here",
            got=name,
            expected="such as cpu, cuda or mps",
            remedy="Leave the device out to use the cpu.",
        ) from error
