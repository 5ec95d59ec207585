"""Hyperparameters of the Gaussian process, and how well each of a few of them explains the trials.

The transformed MEP is a constant, a Gaussian process of the ISI, and Gaussian noise; trials of TMS alone lack the
process. With an amplitude or without one, hyperparameters lie on a grid of equal steps in prior SDs, weighted by prior
times marginal likelihood [Rasmussen2006, equation 2.30], in which a process that could explain anything pays for it.

A second Gaussian process describes the log variance by ISI [Kersting2007]. It is fitted to squared leave-one-out
residuals by Newton's method on their Gaussian likelihood, which is concave in the log variance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.lazy import botorch, scipy, torch
from isiw.models.gp.places import Hyperparameters, Places, Tensor
from isiw.models.gp.prior import ProcessSettings, Standardisation, correlations, regression
from isiw.models.gp.weights import TINY, Weights, features, functions
from isiw.models.shared.history import PersonTrials
from isiw.types import FloatArray

LOG_VARIANCE_SD = 0.6
"""Prior SD of the log variance about its mean: the noise SD varies by a factor of e^0.3 either way."""

LENGTH_MS = 80.0
"""Over which the log variance varies [ms]; longer than profiles do, since variances are harder to learn than means."""

MEAN_SD = 3.0
"""Prior SD of the mean log variance, which is practically unknown."""

MAX_LOG_VARIANCE = 4.0
"""The relative log variance stays within this, so that no trial is ignored and none is trusted completely."""

LEAST_SQUARE = 1e-3
"""Squared residuals are at least this share of their mean."""

NEWTON_STEPS = 12
MAX_STEP = 2.0
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class NoiseProfile:
    """Relative noise variance by ISI; its logarithm has mean 0 over the trials."""

    isi_ms: Tensor  # where it was learnt, (n,)
    pull: Tensor  # by how much each of them raises the log variance, (n,)

    def log_variance(self, isi_ms: Tensor) -> Tensor:
        """Relative log variance at some ISIs [ms], same shape (t,)."""
        if not len(self.isi_ms):
            return torch.zeros_like(isi_ms)
        mean = (_covariance(self.isi_ms, self.isi_ms) @ self.pull).mean()
        log_variance = _covariance(isi_ms, self.isi_ms) @ self.pull - mean
        return log_variance.clamp(-MAX_LOG_VARIANCE, MAX_LOG_VARIANCE)


def equal_noise() -> NoiseProfile:
    """The same noise everywhere."""
    nothing = torch.empty(0, dtype=torch.float64)
    return NoiseProfile(nothing, nothing)


def _covariance(one: Tensor, other: Tensor) -> Tensor:
    steps = (one.unsqueeze(-1) - other) / LENGTH_MS
    return MEAN_SD**2 + LOG_VARIANCE_SD**2 * torch.exp(-0.5 * steps.square())


def leave_one_out(covariance: Tensor, residuals: Tensor) -> Tensor:
    """Distance of each value from what all others predict [SD], (n,) [Rasmussen2006, equations 5.10–5.12]."""
    inverse = torch.cholesky_inverse(torch.linalg.cholesky(covariance))
    return (inverse @ residuals) / inverse.diagonal().sqrt()


def noise_profile(isi_ms: Tensor, surprise_at: Callable[[Tensor], Tensor]) -> NoiseProfile:
    """The most likely noise profile, found in turns with the leave-one-out residuals that it leads to."""
    covariance = _covariance(isi_ms, isi_ms)
    profile = NoiseProfile(isi_ms, torch.zeros_like(isi_ms))
    for _ in range(ROUNDS):
        log_variance = profile.log_variance(isi_ms)
        squares = surprise_at(log_variance).square() * log_variance.exp()
        profile = NoiseProfile(isi_ms, _most_likely_pull(covariance, squares))
    return profile


def _most_likely_pull(covariance: Tensor, squares: Tensor) -> Tensor:
    """Where likelihood and prior of the log variance balance, as covariance times this, shape (n,)."""
    pull = torch.zeros_like(squares)
    identity = torch.eye(len(squares), dtype=squares.dtype)
    # Only ratios are learnt, and no residual is so small that its logarithm would matter more than all others.
    relative = (squares / squares.mean().clamp_min(TINY)).clamp_min(LEAST_SQUARE)
    for _ in range(NEWTON_STEPS):
        log_variance = covariance @ pull
        curvature = 0.5 * relative * torch.exp(-log_variance)
        target = torch.linalg.solve(
            identity + curvature.unsqueeze(-1) * covariance, curvature * (1.0 + log_variance) - 0.5
        )
        change = target - pull
        # Far from the balance a full step would overshoot.
        pull = pull + change * (MAX_STEP / (covariance @ change).abs().amax().clamp_min(TINY)).clamp_max(1.0)
    return pull


LEAST_PIVOT = 1e-6
"""A covariance in standardised units whose Cholesky factor has smaller pivots is singular but for rounding."""

LEVEL_SD = 1.0
"""Prior SD of the constant about the mean of all trials, in standardised units."""


class Trials(NamedTuple):
    """Trials of one person on a scale: ISIs [ms], standardised MEPs, those of TMS alone; shapes (n,), (n,), (m,)."""

    isi_ms: Tensor
    values: Tensor
    alone: Tensor
    isi_sd_ms: Tensor  # (n,)


@dataclass(frozen=True, eq=False)
class Fit:
    """A few processes, and how believable each is."""

    settings: ProcessSettings
    scale: Standardisation
    told: PersonTrials
    processes: Hyperparameters  # (q,)
    log_prior: Tensor  # added to each one's log marginal likelihood, (q,)
    noise: NoiseProfile = field(default_factory=equal_noise)
    trouble: str | None = None
    places: Places | None = None  # of the processes; None if they may leave their constants everywhere

    @cached_property
    def trials(self) -> Trials:
        """The trials on the scale of the process."""
        told, scaled = self.told, self.scale.standardised
        isi_ms = torch.as_tensor(told.isi_ms)
        sd_ms = torch.zeros_like(isi_ms) if told.isi_sd_ms is None else torch.as_tensor(told.isi_sd_ms)
        return Trials(isi_ms, scaled(told.mep_mv), scaled(told.baseline_mv), sd_ms)

    @cached_property
    def log_joint(self) -> Tensor:
        """Log prior and log marginal likelihood of each process, shape (q,)."""
        if self.weights is not None:
            return self.log_prior + self.weights.log_marginal
        return self.log_prior + self.log_marginal(self.processes, self.noise.log_variance(self.trials.isi_ms))

    @cached_property
    def weights(self) -> Weights | None:
        """What the trials say of processes that leave their constants within windows; None of others."""
        if self.places is None:
            return None
        return self._weights(self.processes, self.places, self.noise.log_variance(self.trials.isi_ms))

    def _weights(self, processes: Hyperparameters, places: Places, log_variance: Tensor) -> Weights:
        trials, own = self.trials, processes.noise.square().unsqueeze(-1)
        # Where a tap changes nothing, it does not change the noise either.
        changed = log_variance * (processes.amplitude > 0).unsqueeze(-1) + 2.0 * places.log_growth(trials.isi_ms)
        # What an ISI is off by moves a trial along the flank [McHutchon2011].
        variance = own * changed.exp() + (places.slope(trials.isi_ms) * trials.isi_sd_ms).square()
        tapped = features(functions(self.settings.kernel, self.settings.windows), places, trials.isi_ms)
        alone = tapped.new_zeros(len(tapped), len(trials.alone), tapped.shape[-1])
        alone[..., -1] = 1.0
        about = trials.values - places.mean(trials.isi_ms)
        told = Weights(
            features=torch.cat((tapped, alone), dim=-2),
            values=torch.cat((about, trials.alone.expand(len(about), -1)), dim=-1),
            variance=torch.cat((variance, own.expand(-1, len(trials.alone))), dim=-1),
            level_sd=LEVEL_SD,
        )
        return told.with_strays(self.settings.windows.stray)

    @property
    def log_evidence(self) -> float:
        """Log marginal likelihood of the trials, as a density of log amplitudes [nat]."""
        told = np.concatenate((self.told.mep_mv, self.told.baseline_mv))
        return float(self.log_joint.logsumexp(0)) + self.scale.log_jacobian(told)

    @property
    def log_totals(self) -> Tensor:
        """Log joint probability of the trials and of "the tap changes something", and "nothing", shape (2,)."""
        present = self.processes.amplitude > 0
        return torch.stack([self.log_joint[which].logsumexp(0) for which in (present, ~present)])

    @property
    def best(self) -> int:
        """The most believable process that has an amplitude."""
        return int(torch.where(self.processes.amplitude > 0, self.log_joint, -torch.inf).argmax())

    def log_marginal(self, processes: Hyperparameters, log_variance: Tensor) -> Tensor:
        """Log marginal likelihood of the trials without windows' places, (q,); -inf where covariances are singular."""
        values = torch.cat((self.trials.values, self.trials.alone))
        factor, failed = torch.linalg.cholesky_ex(self._covariance(processes, log_variance))
        pivots = factor.diagonal(dim1=-2, dim2=-1)
        sound = (failed == 0) & (pivots > LEAST_PIVOT).all(-1)
        white = torch.linalg.solve_triangular(factor, values.unsqueeze(-1), upper=False).squeeze(-1)
        log_density = -0.5 * white.square().sum(-1) - pivots.log().sum(-1)
        constant = 0.5 * len(values) * math.log(2 * math.pi)
        return torch.where(sound, log_density - constant, -torch.inf)

    def _covariance(self, processes: Hyperparameters, log_variance: Tensor) -> Tensor:
        """Of all values, those of TMS alone behind the others, shape (q, n + m, n + m)."""
        trials = self.trials
        lengths, which = torch.unique(processes.length_ms, return_inverse=True)
        correlation = correlations(self.settings.kernel, lengths, trials.isi_ms)
        profile = processes.amplitude.square()[:, None, None] * correlation[which]
        # Where a tap changes nothing, it does not change the noise either.
        relative = (log_variance * (processes.amplitude > 0).unsqueeze(-1)).exp()
        alone = len(trials.alone)
        padded = torch.nn.functional.pad(profile, (0, alone) * 2)
        relative = torch.nn.functional.pad(relative, (0, alone), value=1.0)
        return LEVEL_SD**2 + padded + torch.diag_embed(processes.noise.square().unsqueeze(-1) * relative)

    def surprise(self, log_variance: Tensor) -> Tensor:
        """Leave-one-out residuals of the trials with a tap under the best process [SD], shape (n,)."""
        pick = torch.tensor([self.best])
        best = self.processes.picked(pick)
        if self.places is not None:
            return self._weights(best, self.places.picked(pick), log_variance).surprise[0, : len(log_variance)]
        values = torch.cat((self.trials.values, self.trials.alone))
        return leave_one_out(self._covariance(best, log_variance)[0], values)[: len(log_variance)]

    def level(self, noise: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and variance of the constant given the trials of TMS alone, of the shape of their noise SD."""
        alone = self.trials.alone
        variance = 1.0 / (LEVEL_SD**-2 + len(alone) / noise.square())
        return variance * alone.sum() / noise.square(), variance

    def conditioned(self, told: PersonTrials) -> Fit:
        """The same processes on other trials; their hyperparameters, scale and noise profile stay."""
        return _sound(replace(self, told=told))

    def regression(self, picks: Tensor) -> botorch.models.SingleTaskGP:
        """Some of the processes as BoTorch models, from ISIs [ms] to standardised MEPs."""
        chosen, trials = self.processes.picked(picks), self.trials
        places = None if self.places is None else self.places.picked(picks)
        relative = self.noise.log_variance(trials.isi_ms).exp()
        if self.weights is not None:
            own = self.weights.variance[picks][..., : len(trials.isi_ms)]
            relative = own / chosen.noise.square().unsqueeze(-1)
        level, data = self.level(chosen.noise), (trials.isi_ms, trials.values, relative)
        return regression(self.settings.kernel, chosen, level, *data, places=places)


def fit(settings: ProcessSettings, scale: Standardisation, told: PersonTrials, space: DesignSpace = VALVE_SPACE) -> Fit:
    """Weigh processes by one person's trials; of hyperparameters that are not learnt, that one process.

    The space is where windows are sought, if profiles are windows'.
    """
    if settings.profile == "window":
        processes, places, log_prior = settings.windows.processes(space)
        return _with_noise(_sound(Fit(settings, scale, told, processes, log_prior, places=places)))
    if (fixed := settings.fixed) is not None:
        columns = torch.tensor([[fixed.length_ms] * 2, [fixed.amplitude, 0.0], [fixed.noise] * 2], dtype=torch.float64)
        return _sound(Fit(settings, scale, told, Hyperparameters(*columns), settings.prior.log_hypotheses))
    found = _sound(Fit(settings, scale, told, *settings.prior.grid()))
    if found.trouble:
        return found
    found = _with_noise(found)
    return found if settings.hyperparameters == "marginalised" else _most_likely(found)


def _with_noise(found: Fit) -> Fit:
    """The fit with a noise profile, if noise depends on the ISI."""
    if found.settings.noise != "by-isi" or found.trouble or not len(found.told.isi_ms):
        return found
    profile = noise_profile(found.trials.isi_ms, found.surprise)
    return _with_same_totals(found, replace(found, noise=profile))


def _sound(found: Fit) -> Fit:
    """The fit, or the prior's medians if none of its processes has a likelihood."""
    if bool(found.log_joint.isfinite().any()):
        return found
    medians = found.settings.prior.at(torch.zeros((2, 3), dtype=torch.float64))
    return replace(
        found,
        processes=medians._replace(amplitude=medians.amplitude * torch.tensor([1.0, 0.0], dtype=torch.float64)),
        log_prior=found.settings.prior.log_hypotheses,
        noise=equal_noise(),
        places=None,
        trouble="The covariance of the trials is singular under all hyperparameters. "
        "The medians of their priors, with the same noise at all ISIs, stand in for them.",
    )


def _most_likely(found: Fit) -> Fit:
    """The most likely process in place of all that have an amplitude, and as believable as they are together."""
    prior, log_variance = found.settings.prior, found.noise.log_variance(found.trials.isi_ms)

    def loss(z: FloatArray) -> float:
        point = torch.as_tensor(z).unsqueeze(0)
        return float(0.5 * point.square().sum() - found.log_marginal(prior.at(point), log_variance)[0])

    start = prior.z(found.processes.picked(torch.tensor([found.best])))[0]
    simplex = start + torch.nn.functional.pad(0.5 * torch.eye(3, dtype=torch.float64), (0, 0, 1, 0))
    options: dict[str, object] = {
        "initial_simplex": simplex.numpy(),
        "xatol": 0.05,
        "fatol": 0.02,
        "maxfev": found.settings.max_evaluations,
    }
    result = scipy.optimize.minimize(loss, start.numpy(), method="Nelder-Mead", options=options)  # type: ignore[call-overload]
    trouble = None
    if not result.success:
        trouble = (
            f"The search for the most likely hyperparameters has not ended after {options['maxfev']} evaluations. "
            "The best ones that it met stand in for them."
        )
    flat = torch.where(found.processes.amplitude == 0, found.log_joint, -torch.inf).argmax()
    chosen = (prior.at(torch.as_tensor(result.x).unsqueeze(0)), found.processes.picked(flat.unsqueeze(0)))
    processes = Hyperparameters(*(torch.cat(pair) for pair in zip(*chosen, strict=True)))
    after = replace(found, processes=processes, log_prior=prior.log_hypotheses, trouble=trouble)
    return _with_same_totals(found, after)


def _with_same_totals(before: Fit, after: Fit) -> Fit:
    """Another fit, in which "the tap changes something" and "nothing" are as believable together as they were."""
    # Where "nothing" is impossible, it stays so.
    something, nothing = (before.log_totals - after.log_totals).nan_to_num(0.0)
    gains = torch.where(after.processes.amplitude > 0, something, nothing)
    return _sound(replace(after, log_prior=after.log_prior + gains))
