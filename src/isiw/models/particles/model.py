"""The particle posterior: sequential Monte Carlo over people, b sessions at once.

Every trial multiplies the particles' weights by its likelihood. When the effective sample size falls, the particles are
resampled, and moved by Markov chain steps (resample-move: Gilks and Berzuini, J. R. Stat. Soc. B 63, 2001).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import torch

from isiw.checks import MOST_OF_A_KIND, check_numbers, check_probabilities, check_wholes
from isiw.design import DesignSpace
from isiw.models.particles.diagnostics import Health, distinct_share, ess_share, trouble_of
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import Latents
from isiw.models.particles.likelihood import levels, total_log_likelihood
from isiw.models.particles.moves import Mover
from isiw.models.particles.noise import NoiseKind, Response, draw_log_mep, log_gain
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Person, Prior
from isiw.models.particles.shapes import Shape
from isiw.models.protocol import Observation, SimulatedPerson, Tensor
from isiw.models.randomness import SIMULATED, step_generator, systematic
from isiw.models.shared.history import History, observed
from isiw.models.windows import EXCLUDED_AT, SampledHypotheses, SampledProfiles, profile_grid, sampled_estimate
from isiw.types import ArrayLike, FloatArray
from isiw.window import Enhancement, Window, WindowEstimate

__all__ = ["Moving", "ParticleModel", "ParticlePosterior"]

LEAST_SAMPLES = 20
"""Of fewer samples no quantile is told."""


@dataclass(frozen=True)
class Moving:
    """How often particles move, and when they are resampled.

    Args:
        sweeps: sweeps of Markov chain moves after each trial; up to four times as many among the first 25, whose
            history is short and tells apart the particles most.
        max_trial_sweeps: sweeps times trials are at most this many, so that a tell stays fast late in a session; where
            there are more trials, one sweep follows every second, third or later one, and each resampling.
        min_ess: effective sample size, as a share of the particles, below which they are resampled.

    Raises:
        InvalidValueError: an invalid number.
    """

    sweeps: int = 2
    max_trial_sweeps: int = 240
    min_ess: float = 0.5

    def __post_init__(self) -> None:
        check_wholes(self, "sweeps", "max_trial_sweeps", least=0)
        check_probabilities(self, "min_ess")

    def sweeps_after(self, trials: int, *, resampled: bool = True) -> int:
        """How many sweeps follow a trial: more where the history is short, fewer where it has become long.

        Args:
            trials: how long the history is.
            resampled: whether particles were resampled, so that some are alike.
        """
        if 0 < self.max_trial_sweeps < trials and self.sweeps:
            return int(resampled or trials % math.ceil(2 * trials / self.max_trial_sweeps) == 0)
        early = min(4.0, max(1.0, 25 / max(1, trials)))
        return min(int(self.sweeps * early), max(1, self.max_trial_sweeps // max(1, trials)))


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
    device: str = "cpu"

    def __post_init__(self) -> None:
        check_wholes(self, "particles", least=2, most=MOST_OF_A_KIND)  # half of them move at a time
        check_wholes(self, "thinned", least=1, most=MOST_OF_A_KIND)
        check_numbers(self, "detection_limit_mv", "response_threshold_mv", above=0)

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
        size, device = latents.present.shape, latents.present.device
        return ParticlePosterior(
            model=self,
            space=space,
            seed=seed,
            latents=latents,
            log_weights=torch.full(size, -math.log(self.particles), device=device),
            log_likelihood=torch.zeros(size, device=device),
            evidence=torch.zeros(people, device=device),
            history=History.empty(people, device),
        )

    def update(self, posterior: ParticlePosterior, observation: Observation) -> ParticlePosterior:
        """The posterior after one more trial."""
        after = self.reweighted(posterior, observation)
        generator = step_generator(self.device, posterior.seed, after.trials)
        ess = ess_share(after.log_weights)
        worn = ess < self.moves.min_ess
        after = self._resampled(after, worn, generator)
        mover = Mover(WindowTarget(self.prior, posterior.space), after.history, generator)
        sweeps = self.moves.sweeps_after(after.trials, resampled=bool(worn.any()))
        moved = mover.sweeps(sweeps, after.latents, after.log_likelihood)
        health = Health(ess, moved.shifts, moved.jumps, distinct_share(moved.log_likelihood))
        return replace(after, latents=moved.latents, log_likelihood=moved.log_likelihood, health=health)

    def simulate(self, space: DesignSpace, seed: int, isi_ms: ArrayLike) -> SimulatedPerson:
        """Draw one person from the prior, and a MEP at each ISI; see `SimulatesPeople`."""
        generator = step_generator(self.device, seed, SIMULATED)
        person = self.prior.person(self.prior.sample(1, 1, generator, space))
        isis_ms = torch.as_tensor(isi_ms, dtype=torch.float32, device=self.device).unsqueeze(0)
        gain = log_gain(person.response, torch.arange(isis_ms.shape[-1], dtype=torch.float32, device=self.device))
        log_mep = draw_log_mep(person.response, levels(person, isis_ms), generator, gain)
        grid_ms = torch.as_tensor(space.grid_ms.copy(), dtype=torch.float32, device=self.device)
        mask = PersonSample(person, space).window_masks(grid_ms)[0, 0]
        window = Window.from_mask(space.grid_ms, mask.cpu().numpy())
        return SimulatedPerson(window, log_mep[0, 0].double().exp().cpu().numpy())

    def reweighted(self, posterior: ParticlePosterior, observation: Observation) -> ParticlePosterior:
        """The same particles, weighted by one more trial as well.

        Args:
            posterior: what is believed before it.
            observation: the trial.
        """
        known = self.detection_limit_mv, self.response_threshold_mv
        trial = observed(observation, *known, order=posterior.trials).to(self.device, torch.float32)
        gain = total_log_likelihood(posterior.person, trial)
        return replace(
            posterior,
            log_weights=torch.log_softmax(posterior.log_weights + gain, dim=-1),
            log_likelihood=posterior.log_likelihood + gain,
            evidence=posterior.evidence + torch.logsumexp(posterior.log_weights + gain, dim=-1),
            history=posterior.history.appended(trial),
        )

    def _resampled(self, posterior: ParticlePosterior, worn: Tensor, generator: torch.Generator) -> ParticlePosterior:
        """Resample those people whose effective sample size has fallen (b,); nobody else notices."""
        # Systematic picks are ordered; shuffled, both halves of the particles represent the posterior.
        shuffled = torch.randperm(self.particles, generator=generator, device=generator.device)
        if not bool(worn.any()):
            return posterior
        worn = worn.unsqueeze(-1)
        kept = torch.arange(self.particles, device=shuffled.device)
        picks = torch.where(worn, systematic(posterior.log_weights, self.particles)[:, shuffled], kept)
        return replace(
            posterior,
            latents=Latents(*(_take(x, picks) for x in posterior.latents)),
            log_weights=torch.where(worn, -math.log(self.particles), posterior.log_weights),
            log_likelihood=_take(posterior.log_likelihood, picks),
        )


@dataclass(frozen=True, eq=False)
class ParticlePosterior:
    """What is believed about b people.

    Args:
        model: the model's settings.
        space: the design space.
        seed: seed of all randomness.
        latents: the particles, fields of shape (b, p).
        log_weights: their normalised log weights, shape (b, p).
        log_likelihood: of the history under each of them, shape (b, p).
        evidence: log marginal likelihood of the history [nat], shape (b,).
        history: the trials so far.
        health: how the particles took the last trial; None before the first.
    """

    model: ParticleModel
    space: DesignSpace
    seed: int
    latents: Latents
    log_weights: Tensor
    log_likelihood: Tensor
    evidence: Tensor
    history: History
    health: Health | None = None

    @property
    def trouble(self) -> str | None:
        """What is wrong with the particles; see `ReportsTrouble`."""
        return None if self.health is None else trouble_of(self.health)

    @property
    def trials(self) -> int:
        """How many trials of each person it has been told."""
        return self.history.isi_ms.shape[-1]

    @cached_property
    def person(self) -> Person:
        """What the particles mean."""
        return self.model.prior.person(self.latents)

    @cached_property
    def _thinned(self) -> PersonSample:
        picks = systematic(self.log_weights, self.model.thinned)
        return PersonSample(_each(self.person, lambda x: _take(x, picks)), self.space, self.trials)

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP; see `PredictsOutcomes`."""
        return self._thinned.outcome_mass(isi_ms.to(self.log_weights.device))

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows; see `SamplesWindows`."""
        return self._thinned.window_masks(isi_ms.to(self.log_weights.device))

    def profiles_mv(self, isi_ms: Tensor) -> Tensor:
        """Sampled profiles; see `SamplesProfiles`."""
        return self._thinned.expected_mep_mv(isi_ms.to(self.log_weights.device))

    def baselines_mv(self) -> Tensor:
        """Sampled baselines; see `SamplesProfiles`."""
        return self._thinned.baselines_mv()

    def condition(self, isi_ms: Tensor, mep_mv: Tensor) -> ParticlePosterior:
        """The same particles, weighted by an imagined trial; see `Conditions`."""
        return self.model.reweighted(self, Observation.of(isi_ms, mep_mv))

    def log_evidence(self) -> Tensor:
        """Log marginal likelihood of the trials [nat]; see `HasEvidence`."""
        return self.evidence

    def prediction_mv(self, level: float, person: int = 0) -> tuple[FloatArray, FloatArray]:
        """Between which amplitudes the next MEP lies; see `PredictsMeps`."""
        isi_ms = profile_grid(self.space).to(self.log_weights.device)
        shares = 0.5 + 0.5 * torch.tensor([-level, level], device=isi_ms.device)
        low_mv, high_mv = self._thinned.mep_quantiles_mv(isi_ms, shares)[person].T.double().cpu().numpy()
        return low_mv, high_mv

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""
        one = slice(person, person + 1)
        picks = systematic(self.log_weights[one], self.model.particles)
        latents = Latents(*(_take(x[one], picks) for x in self.latents))
        sample = PersonSample(self.model.prior.person(latents), self.space)
        grid = torch.tensor(self.space.grid_ms, dtype=torch.float32, device=picks.device)
        thinned = PersonSample(_each(self._thinned.person, lambda x: x[one]), self.space)
        profiles_mv = thinned.expected_mep_mv(profile_grid(self.space).to(picks.device))
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
        shift_pct_rmt = self.model.prior.shift_pct_rmt(latents)[latents.noise == NoiseKind.RECRUITMENT]
        if excluded is None or len(shift_pct_rmt) < LEAST_SAMPLES:
            return excluded
        return excluded._replace(shift_pct_rmt=float(torch.quantile(shift_pct_rmt, EXCLUDED_AT)))


def _take(values: Tensor, picks: Tensor) -> Tensor:
    index = picks.unsqueeze(-1).expand(-1, -1, values.shape[-1]) if values.dim() > picks.dim() else picks
    return torch.gather(values, 1, index)


def _each(person: Person, function: Callable[[Tensor], Tensor]) -> Person:
    """The same of every field of a person."""
    shape, response = map(function, person.shape), map(function, person.response)
    return Person(Shape(*shape), Response(*response), function(person.present))
