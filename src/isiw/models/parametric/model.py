"""The parametric window model: a Gaussian window on a floor, with noise that depends on the level, as a Pyro program.

Its posterior is sampled again from all trials, whatever their order, when it is first used. With and without a window
are two models, weighed by their evidence. The floor is unknown, so that the least-excess rule is applied above
the baseline.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Annotated, Final, Literal, NamedTuple

import numpy as np

from isiw.checks import Checked, SmallestAmplitude, whole
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.excess import least_excess_mv
from isiw.lazy import torch
from isiw.models.parametric.importance import Effort
from isiw.models.parametric.law import Likelihood, Unknowns, WindowPrior, draw_log_mep, levels, log_likelihood
from isiw.models.parametric.sampling import Chains, WindowProgram, sample_person
from isiw.models.parametric.tensors import Tensor, Trials, interpolated, step_generator, table_levels
from isiw.models.protocol import Observation, PriorPerson
from isiw.models.shared.draws import OUTCOMES, SIMULATED, systematic
from isiw.models.shared.history import History, observed, without_known
from isiw.models.windows import Runs, SampledProfiles, profile_grid, sampled_estimate
from isiw.types import Array, ArrayLike, FloatArray, Singles
from isiw.window import Window


@dataclass(frozen=True)
class ParametricModel(Checked):
    """A Gaussian window on a floor, with gamma, log-normal or input-side noise and outliers.

    Args:
        prior: the prior over people.
        likelihood: how MEPs scatter: "gamma", "log-normal", or "input-noise" (a noisy input of a saturating curve).
        method: "fast" samples by importance around all modes; "nuts", for reference, by Pyro's no-U-turn sampler.
        samples: equally weighted samples that represent a posterior.
        effort: how much work a sample with a window is worth.
        chains: how long the no-U-turn sampler runs.
        detection_limit_mv: an amplitude of 0 lies below this [mV].
        response_threshold_mv: a response that was seen lies above this [mV].
    """

    prior: WindowPrior = field(default_factory=WindowPrior)
    likelihood: Likelihood = "input-noise"
    method: Literal["fast", "nuts"] = "fast"
    samples: Annotated[int, partial(whole, least=2)] = 512
    effort: Effort = field(default_factory=Effort)
    chains: Chains = field(default_factory=Chains)
    detection_limit_mv: SmallestAmplitude = 0.005
    response_threshold_mv: SmallestAmplitude = 0.02

    def program(self, space: DesignSpace) -> WindowProgram:
        """The Pyro program of one person."""
        return WindowProgram(self.prior, self.likelihood, space)

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> ParametricPosterior:
        """The posterior before the first trial."""
        return ParametricPosterior(self, space, seed, History.empty(people))

    def update(self, posterior: ParametricPosterior, observation: Observation) -> ParametricPosterior:
        """The posterior after one more trial, which is sampled when it is first used."""
        history = posterior.history
        history = history.appended(self.observed(observation, history.trials))
        return ParametricPosterior(self, posterior.space, posterior.seed, history)

    def observed(self, observation: Observation, order: int) -> History:
        """One trial of each person as a history.

        Args:
            observation: the trial.
            order: its place among the trials, from 0.
        """
        known = self.detection_limit_mv, self.response_threshold_mv
        return observed(without_known(observation), *known, order=order)

    def simulate(self, space: DesignSpace, seed: int, isi_ms: ArrayLike) -> PriorPerson:
        """Draw one person from the prior, and an MEP at each ISI; see `SimulatesPeople`."""
        generator = step_generator(seed, SIMULATED)
        program = self.program(space)
        latents = torch.randn((1, 1, program.latents), generator=generator, dtype=torch.double)
        present = torch.rand((1, 1), generator=generator, dtype=torch.float32) < self.prior.p_window
        person = WindowSample(program.unknowns(latents), present, self.likelihood, space)
        level = person.levels(torch.tensor(np.asarray(isi_ms, dtype=float)))
        log_mep = draw_log_mep(person.unknowns, level, self.likelihood, generator)
        mask = person.window_masks(torch.tensor(space.grid_ms))[0, 0]
        return PriorPerson(Window.from_mask(space.grid_ms, mask.numpy()), log_mep.exp()[0, 0].numpy())

    def sampled(self, space: DesignSpace, seed: int, history: History) -> Samples:
        """Samples of the posterior of b people, drawn for the number of their trials.

        Args:
            space: in whose range a window is sought.
            seed: of the draws, with the number of trials.
            history: the trials.
        """
        fits = [
            sample_person(
                self.program(space),
                Trials.of(history, person),
                self.samples,
                self.effort,
                step_generator(seed, history.trials),
                self.chains if self.method == "nuts" else None,
            )
            for person in range(len(history.columns))
        ]
        return Samples(
            torch.stack([fit.latents for fit in fits]),
            torch.stack([fit.present for fit in fits]),
            np.array([fit.log_evidence for fit in fits]),
            " ".join(fit.trouble for fit in fits if fit.trouble) or None,
        )


SAMPLES_AT_ONCE: Final = 64
"""Samples whose table is worked out at once."""


class Samples(NamedTuple):
    """Equally weighted samples of b people."""

    latents: Tensor  # (b, s, d)
    present: Tensor  # there is any excess, (b, s)
    evidence: FloatArray  # log marginal likelihood of the trials [nat], (b,)
    trouble: str | None = None  # with how they were drawn, and what stands in for it


@dataclass(frozen=True, eq=False)
class WindowSample:
    """Equally weighted samples (b, s), and what they say about the next MEP and about the window."""

    unknowns: Unknowns
    present: Tensor  # there is any excess
    likelihood: Likelihood
    space: DesignSpace  # in whose range a window is sought

    def levels(self, isi_ms: Tensor) -> Tensor:
        """Share of the largest excess at some ISIs, of shape (t,) or (b, 1 or s, t), shape (b, s, t)."""
        return torch.where(self.present.unsqueeze(-1), levels(self.unknowns, isi_ms), 0.0)

    def _excess_mv(self, isi_ms: Tensor) -> Tensor:
        """Expected MEP above the baseline at some ISIs [mV], shapes as for `levels`."""
        return self.unknowns.amplitude_mv.unsqueeze(-1) * self.levels(isi_ms)

    @cached_property
    def least_excess_mv(self) -> Tensor:
        """Excess at the window's edge [mV]; infinite if there is no window, shape (b, s)."""
        middle_ms = self.unknowns.start_ms + 0.5 * self.unknowns.width_ms
        reached_ms = middle_ms.clamp(self.space.low_ms, self.space.high_ms)
        peak_mv = self._excess_mv(reached_ms.unsqueeze(-1)).squeeze(-1)
        return torch.from_numpy(least_excess_mv(peak_mv, self.unknowns.baseline_mv))

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows as 0 or 1, shape (b, s, t)."""
        return (self._excess_mv(isi_ms.double()) >= self.least_excess_mv.unsqueeze(-1)).to(torch.float32)

    def profiles_mv(self, isi_ms: Tensor) -> Tensor:
        """Expected MEP [mV], shape (b, s, t)."""
        return (self.unknowns.baseline_mv.unsqueeze(-1) + self._excess_mv(isi_ms.double())).float()

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP under each sample, shape (b, s, t, y)."""
        return interpolated(self._outcome_table, self.levels(isi_ms.double()).float())

    @cached_property
    def _outcome_table(self) -> Tensor:
        """Probability of each outcome at the tables' levels, shape (b, s, l, y)."""
        u = Unknowns(*(field.float() for field in self.unknowns))
        low = torch.quantile(u.floor_mv.log(), 0.05, dim=-1) - 1.0
        high = torch.quantile((u.baseline_mv + u.amplitude_mv).log(), 0.95, dim=-1) + 1.5
        share = torch.linspace(0.0, 1.0, OUTCOMES, dtype=torch.float32).unsqueeze(-1)
        log_mep = (low + share * (high - low))[..., None, None, None].expand(-1, -1, -1, -1, 2)
        # Outcomes come first, and few samples at a time, which a processor's cache holds.
        mass = [
            log_likelihood(
                Unknowns(*(field[None, :, first : first + SAMPLES_AT_ONCE] for field in u)),
                table_levels(),
                log_mep,
                self.likelihood,
            ).softmax(0)
            for first in range(0, u.floor_mv.shape[-1], SAMPLES_AT_ONCE)
        ]
        return torch.cat(mass, dim=2).movedim(0, -1).contiguous()


@dataclass(frozen=True, eq=False)
class ParametricPosterior:
    """The posterior of b people."""

    model: ParametricModel
    space: DesignSpace
    seed: int
    history: History  # the trials so far, in order
    conditioned: Samples | None = None  # by imagined trials

    @cached_property
    def drawn(self) -> Samples:
        """Its samples. They depend on the trials alone: while many are learnt in a row, none are drawn in between."""
        return self.conditioned or self.model.sampled(self.space, self.seed, self.history)

    @property
    def trouble(self) -> str | None:
        """What is wrong with its samples; see `ReportsTrouble`."""
        return self.drawn.trouble

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt."""
        return self.history.trials

    @property
    def pairs(self) -> int:
        """Number of them that were pairs of stimuli; see `CountsPairs`."""
        return int((~np.isnan(self.history.isi_ms[0])).sum())

    @cached_property
    def sample(self) -> WindowSample:
        """The unknowns that the samples stand for."""
        unknowns = self.model.program(self.space).unknowns(self.drawn.latents)
        return WindowSample(unknowns, self.drawn.present, self.model.likelihood, self.space)

    def outcome_mass(self, isi_ms: Array) -> Singles:
        """Predictive distribution of the next MEP; see `PredictsOutcomes`."""
        return self.sample.outcome_mass(torch.tensor(isi_ms)).numpy()

    def window_masks(self, isi_ms: Array) -> Singles:
        """Sampled windows; see `SamplesWindows`."""
        return self.sample.window_masks(torch.tensor(isi_ms)).numpy()

    def profiles_mv(self, isi_ms: Array) -> Singles:
        """Sampled profiles; see `SamplesProfiles`."""
        return self.sample.profiles_mv(torch.tensor(isi_ms)).numpy()

    def baselines_mv(self) -> Singles:
        """Sampled baselines; see `SamplesProfiles`."""
        return self.sample.unknowns.baseline_mv.float().numpy()

    def condition(self, isi_ms: Array, mep_mv: Array) -> ParametricPosterior:
        """The same samples, some more often and some no more, by an imagined trial; see `Conditions`."""
        trial = self.model.observed(Observation.of(isi_ms, mep_mv), self.trials)
        isi, ends = (torch.tensor(column[:, None], dtype=torch.double) for column in (trial.isi_ms, trial.log_mep))
        level = self.sample.levels(isi)
        gain = log_likelihood(self.sample.unknowns, level, ends, self.model.likelihood).squeeze(-1)
        log_mean = torch.logsumexp(gain, dim=-1, keepdim=True)
        picks = torch.from_numpy(systematic(gain.numpy(), gain.shape[-1]))
        latents, present, evidence, trouble = self.drawn
        conditioned = Samples(
            latents.gather(1, picks.unsqueeze(-1).expand_as(latents)),
            present.gather(1, picks),
            evidence + log_mean.squeeze(-1).numpy() - np.log(gain.shape[-1]),
            trouble,
        )
        return replace(self, history=self.history.appended(trial), conditioned=conditioned)

    def log_evidence(self) -> FloatArray:
        """Log marginal likelihood of the trials [nat]; see `HasEvidence`."""
        return self.drawn.evidence

    @cached_property
    def _windows(self) -> Singles:
        """Sampled windows of all people on the space's grid, (b, s, t)."""
        return self.window_masks(self.space.grid_ms)

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""

        def profiles() -> SampledProfiles:
            mep_mv = self.profiles_mv(profile_grid(self.space))
            return SampledProfiles(mep_mv[person], self.baselines_mv()[person])

        return sampled_estimate(Runs.of_masks(self._windows[person]), profiles, self.space)
