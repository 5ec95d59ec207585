"""The particle posterior over people with a window or none, b sessions at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

from isiw.checks import MOST_OF_A_KIND, check_numbers, check_probabilities, check_wholes
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.lazy import torch
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import Latents
from isiw.models.particles.likelihood import levels
from isiw.models.particles.noise import Response, draw_log_mep, log_gain, recruits
from isiw.models.particles.posterior import SwarmPosterior
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Person, Prior
from isiw.models.particles.shapes import Shape
from isiw.models.particles.swarm import Moving, Swarm, taken
from isiw.models.protocol import Observation, PriorPerson, Tensor
from isiw.models.randomness import SIMULATED, step_generator, systematic
from isiw.models.windows import EXCLUDED_AT, SampledHypotheses, SampledProfiles, profile_grid, sampled_estimate
from isiw.types import ArrayLike, FloatArray
from isiw.window import Enhancement, Window, WindowEstimate

__all__ = ["ParticleModel", "ParticlePosterior"]

LEAST_SAMPLES = 20
"""Of fewer samples no quantile is told."""


@dataclass(frozen=True)
class ParticleModel:
    """A particle posterior over profile, recruitment and noise; the default model.

    Args:
        prior: the prior over people.
        particles: how many particles a person has.
        thinned: how many of them represent the posterior where every candidate ISI is scored.
        moves: how often particles move, and when they are resampled.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        response_threshold_mv: what a told response is known to be above [mV].
        unusual_kept: the part of their probability that unusual starts and widths of the window keep where the next ISI
            is chosen; what is believed and reported keeps all of it.
        device: torch device.

    Raises:
        InvalidValueError: fewer than two particles or more than a memory holds, or an invalid number.
    """

    prior: Prior = field(default_factory=Prior)
    particles: int = 1000
    thinned: int = 192
    moves: Moving = field(default_factory=Moving)
    detection_limit_mv: float = 0.005
    response_threshold_mv: float = 0.02
    unusual_kept: float = 1 / 3
    device: str = "cpu"

    def __post_init__(self) -> None:
        check_wholes(self, "particles", least=2, most=MOST_OF_A_KIND)  # half of them move at a time
        check_wholes(self, "thinned", least=1, most=MOST_OF_A_KIND)
        check_numbers(self, "detection_limit_mv", "response_threshold_mv", above=0)
        check_probabilities(self, "unusual_kept")
        _require_device(self.device)

    @cached_property
    def prior_where_asking(self) -> Prior:
        """The prior that ISIs are chosen with."""
        return replace(self.prior, profile=self.prior.profile.as_usual(self.unusual_kept))

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> ParticlePosterior:
        """The posterior before the first trial.

        Args:
            space: the design space.
            seed: seed of all randomness.
            people: how many people.

        Raises:
            InvalidValueError: the prior's places count from another event than the space.
        """
        self.prior.profile.require_space(space)
        latents = self.prior.sample(people, self.particles, step_generator(self.device, seed, 0), space)
        return ParticlePosterior(self, space, seed, Swarm.of(latents))

    def update(self, posterior: ParticlePosterior, observation: Observation) -> ParticlePosterior:
        """The posterior after one more trial."""
        after = posterior.told(observation)
        generator = step_generator(self.device, posterior.seed, after.trials)
        target = WindowTarget(self.prior, posterior.space)
        return replace(after, swarm=after.swarm.moved(target, self.moves, generator))

    def simulate(self, space: DesignSpace, seed: int, isi_ms: ArrayLike) -> PriorPerson:
        """Draw one person from the prior, and an MEP at each ISI; see `SimulatesPeople`."""
        generator = step_generator(self.device, seed, SIMULATED)
        person = self.prior.person(self.prior.sample(1, 1, generator, space))
        isis_ms = torch.as_tensor(isi_ms, dtype=torch.float32, device=self.device).unsqueeze(0)
        gain = log_gain(person.response, torch.arange(isis_ms.shape[-1], dtype=torch.float32, device=self.device))
        log_mep = draw_log_mep(person.response, levels(person, isis_ms), generator, gain)
        grid_ms = torch.as_tensor(space.grid_ms.copy(), dtype=torch.float32, device=self.device)
        mask = PersonSample(person, space).window_masks(grid_ms)[0, 0]
        window = Window.from_mask(space.grid_ms, mask.cpu().numpy())
        return PriorPerson(window, log_mep[0, 0].double().exp().cpu().numpy())


@dataclass(frozen=True, eq=False)
class ParticlePosterior(SwarmPosterior[ParticleModel, Latents]):
    """What is believed about b people.

    Args:
        model: the model's settings.
        space: the design space.
        seed: seed of all randomness.
        swarm: the particles.
    """

    @cached_property
    def as_usual(self) -> ParticlePosterior:
        """The same with the prior that ISIs are chosen with; see `ExpectsTheUsual`."""
        latents, usual = self.swarm.latents, self.model.prior_where_asking
        ratio = usual.log_place(latents.values, self.space) - self.model.prior.log_place(latents.values, self.space)
        return replace(self, swarm=self.swarm.times(torch.where(latents.present, ratio, 0.0)))

    @cached_property
    def sample(self) -> PersonSample:
        """The particles that represent all of them where every candidate ISI is scored."""
        picks = systematic(self.swarm.log_weights, self.model.thinned)
        return PersonSample(_each(self.person, lambda x: taken(x, picks)), self.space, self.trials)

    def prediction_mv(self, level: float, person: int = 0) -> tuple[FloatArray, FloatArray]:
        """Between which amplitudes the next MEP lies; see `PredictsMeps`."""
        isi_ms = profile_grid(self.space).to(self.device)
        shares = 0.5 + 0.5 * torch.tensor([-level, level], dtype=torch.float32, device=isi_ms.device)
        low_mv, high_mv = self.sample.mep_quantiles_mv(isi_ms, shares)[person].T.double().cpu().numpy()
        return low_mv, high_mv

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""
        one = slice(person, person + 1)
        picks = systematic(self.swarm.log_weights[one], self.model.particles)
        latents = Latents(*(taken(x[one], picks) for x in self.swarm.latents))
        sample = PersonSample(self.model.prior.person(latents), self.space)
        grid = torch.tensor(self.space.grid_ms, dtype=torch.float32, device=latents.values.device)
        thinned = PersonSample(_each(self.sample.person, lambda x: x[one]), self.space)
        profiles_mv = thinned.expected_mep_mv(profile_grid(self.space).to(grid.device))
        profiles = SampledProfiles(profiles_mv[0], thinned.baselines_mv()[0])
        hypotheses = SampledHypotheses(self.model.prior.hypothesis(latents)[0], self.model.prior.hypotheses)
        estimate = sampled_estimate(sample.window_masks(grid)[0], profiles, self.space, hypotheses)
        return replace(
            estimate,
            largest_excluded=self._with_shift(estimate.largest_excluded, latents),
            unusual=self.model.prior.unusual(latents, self.space),
        )

    def _with_shift(self, excluded: Enhancement | None, latents: Latents) -> Enhancement | None:
        """The same, with the shift of the input that recruitment curves exclude."""
        shift_pct_rmt = self.model.prior.shift_pct_rmt(latents)[recruits(latents.noise)]
        if excluded is None or len(shift_pct_rmt) < LEAST_SAMPLES:
            return excluded
        return excluded._replace(shift_pct_rmt=float(torch.quantile(shift_pct_rmt, EXCLUDED_AT)))


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


def _each(person: Person, function: Callable[[Tensor], Tensor]) -> Person:
    """The same of every field of a person."""
    shape, response = map(function, person.shape), map(function, person.response)
    return Person(Shape(*shape), Response(*response), function(person.present))
