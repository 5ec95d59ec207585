"""A Gaussian process on the transformed MEP, fitted again after each trial, and windows from its sample paths.

A profile need be smooth only. The price is trials: the process does not know that there is one window with flat ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Annotated, Any, NamedTuple

import numpy as np

from isiw.checks import Checked, SmallestAmplitude, whole
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.excess import least_excess_mv
from isiw.lazy import botorch, torch
from isiw.models.gp.fit import Fit, fit
from isiw.models.gp.places import Tensor
from isiw.models.gp.prior import LOG_SCALE_MV, ProcessSettings, Standardisation, Transform, expected_mep_mv, scale_of
from isiw.models.gp.weights import functions, profiles
from isiw.models.protocol import Observation
from isiw.models.shared.draws import NEARLY_NOTHING, systematic
from isiw.models.shared.history import AmplitudeHistory, FloorKind, FloorTreatment, OfAmplitudes, PersonTrials
from isiw.models.windows import Runs, SampledProfiles, grid_of, profile_grid, sampled_estimate
from isiw.types import Array, Singles

PATH_STEP_MS = 5.0
"""Paths are drawn at ISIs this far apart at most, and are straight in between; length scales are 10 ms and more."""


FLOOR_SHARE = 0.15
"""A path is lowest up to this quantile; of a range of 320 ms, at least 28 % lie outside the widest window."""

FLOOR_RISE = 0.25
"""Where TMS alone was not told, the floor is the median of what rises from a path's lowest values by no more than this
share of its height: less would leave out the floor's upper half where paths wander, more would take in the tails of a
window that is wide for its range."""

SEGMENT_RISE = 0.4
"""What is inside by the rule but nowhere rises to this share of a path's height is taken for the path's wandering, and
makes no segment of a window. So a lower second peak is lost."""

PATH_JITTER = 1e-5
"""Share of a process's variance that is added to the diagonal before paths are drawn, for a stable factor."""

FAR_LENGTHS = 100.0
"""Further than this from all trials, only the constant of a process is known."""

MOST_PROBABLE = 0.98
"""Of windows that simulated people were said to have with at least this probability, .991 had an F1 of at
least .5, after 20 trials and after 40 (decision 59)."""

OUTCOMES = 32
"""Values of the transformed MEP on which predictive distributions live."""


class Paths(NamedTuple):
    """Sample paths of one person, on the scale of transformed amplitudes, at the paths' grid (s, m) or (s,)."""

    level: Tensor  # mean of the transformed MEP
    noise_sd: Tensor  # SD of a trial about it
    alone: Tensor  # mean of TMS alone; NaN if there was none
    alone_sd: Tensor
    present: Tensor  # the tap changes something


def draw_paths(found: Fit, isi_ms: Tensor, size: int, rng: np.random.Generator) -> Paths:
    """Draw sample paths, from each process as many as it is believable."""
    picks = torch.as_tensor(systematic(found.log_joint.numpy()[None], size)[0])
    chosen = found.processes.picked(picks)
    present = chosen.amplitude > 0
    changed = found.noise.log_variance(isi_ms) * present.unsqueeze(-1)
    if found.places is None or found.weights is None:
        level, alone = _anywhere(found, picks, isi_ms, rng)
    else:
        places = found.places.picked(picks)
        weights = found.weights.drawn(picks, rng)
        alone = weights[:, -1]
        level = profiles(functions(found.settings.kernel, found.settings.windows), places, weights, isi_ms)
        level += alone.unsqueeze(-1)
        changed = changed + 2.0 * places.log_growth(isi_ms)
    noise_sd = chosen.noise.unsqueeze(-1) * torch.exp(0.5 * changed)
    unit, centre = found.scale.unit, found.scale.centre
    # Outside a window all is as with TMS alone, whether that was told or not.
    known = found.places is not None or len(found.trials.alone) > 0
    return Paths(
        level=centre + unit * level,
        noise_sd=unit * noise_sd,
        alone=centre + unit * alone if known else torch.full_like(alone, torch.nan),
        alone_sd=unit * chosen.noise,
        present=present,
    )


def _anywhere(found: Fit, picks: Tensor, isi_ms: Tensor, rng: np.random.Generator) -> tuple[Tensor, Tensor]:
    """Paths of processes whose profiles may be anywhere, (s, m), and their constants (s,), standardised."""
    chosen = found.processes.picked(picks)
    present = chosen.amplitude > 0
    # The first of a path's numbers is its constant's, which is drawn last.
    z = torch.as_tensor(rng.standard_normal((len(picks), len(isi_ms) + 1))).roll(-1, dims=1)
    drawn = torch.empty_like(z)
    drawn[present] = _profiles(found, picks[present], isi_ms, z[present])
    drawn[~present] = _constants(found, chosen.noise[~present], z[~present, -1]).unsqueeze(-1)
    return drawn[:, :-1], drawn[:, -1]


def _profiles(found: Fit, picks: Tensor, isi_ms: Tensor, z: Tensor) -> Tensor:
    """Paths of processes with an amplitude, one for each pick, then their constants, standardised, shape (s, m + 1)."""
    if not len(picks):
        return z
    which, member = torch.unique(picks, return_inverse=True)
    # Far from all trials a process is its constant, and a deviation that they tell nothing of.
    far_ms = isi_ms[-1:] + FAR_LENGTHS * found.processes.length_ms[which].amax()
    with torch.no_grad():
        posterior: Any = found.regression(which).posterior(torch.cat((isi_ms, far_ms)).unsqueeze(-1))
        mean, covariance = posterior.mean.squeeze(-1), posterior.distribution.covariance_matrix
    surplus = torch.full_like(mean[0], PATH_JITTER)
    # The deviation is taken away again.
    surplus[-1] -= 1.0
    variance = found.processes.amplitude[which].square()
    factor = torch.linalg.cholesky(covariance + torch.diag_embed(torch.outer(variance, surplus)))
    drawn: Tensor = mean[member] + (factor[member] @ z.unsqueeze(-1)).squeeze(-1)
    return drawn


def _constants(found: Fit, noise: Tensor, z: Tensor) -> Tensor:
    """Draws of the constant where a tap changes nothing, in standardised units, shape (s,)."""
    mean, variance = found.level(noise)
    precision = 1.0 / variance + len(found.trials.values) / noise.square()
    pull = mean / variance + found.trials.values.sum() / noise.square()
    return pull / precision + z / precision.sqrt()


@dataclass(frozen=True, eq=False)
class ProfileSample:
    """Equally weighted paths of b people, (b, s, ...), and what they say about profile, window and the next MEP."""

    isi_ms: Tensor  # of the paths' grid, evenly spaced, (m,)
    paths: Paths
    transform: Transform
    floor: FloorKind  # above which the least-excess rule is applied

    @cached_property
    def _expected_mv(self) -> Tensor:
        """Expected MEP on the paths' grid [mV], shape (b, s, m)."""
        return expected_mep_mv(self.paths.level, self.paths.noise_sd, self.transform)

    @cached_property
    def floor_mv(self) -> Tensor:
        """The level above which the rule is applied [mV], shape (b, s): expected MEP of TMS alone, or 0."""
        if self.floor != "subtracted":
            return torch.zeros_like(self.paths.alone)
        told = expected_mep_mv(self.paths.alone, self.paths.alone_sd, self.transform)
        expected = self._expected_mv
        low = expected.quantile(FLOOR_SHARE, dim=-1, keepdim=True)
        lying = expected <= low + FLOOR_RISE * (expected.amax(-1, keepdim=True) - low)
        guessed = torch.where(lying, expected, torch.nan).nanmedian(dim=-1).values
        return torch.where(told.isnan(), guessed, told)

    @cached_property
    def _edge_level_mv(self) -> Tensor:
        """Expected MEP at the window's edge [mV], shape (b, s, 1); infinite if there is no window."""
        floor_mv = self.floor_mv
        peak_mv = self._expected_mv.amax(-1) - floor_mv
        level_mv = floor_mv + torch.as_tensor(least_excess_mv(peak_mv, floor_mv)).to(floor_mv)
        return torch.where(self.paths.present, level_mv, torch.inf).unsqueeze(-1)

    @cached_property
    def _cleared_mv(self) -> Tensor:
        """Expected MEP on the paths' grid, at the floor where a path merely wanders [mV], shape (b, s, m)."""
        expected, floor_mv = self._expected_mv, self.floor_mv.unsqueeze(-1)
        inside = expected >= self._edge_level_mv
        run = torch.nn.functional.pad(inside[..., 1:] & ~inside[..., :-1], (1, 0)).cumsum(-1)
        tops = torch.zeros_like(expected).scatter_reduce(-1, run, torch.where(inside, expected, 0.0), "amax")
        wanders = tops.gather(-1, run) < floor_mv + SEGMENT_RISE * (expected.amax(-1, keepdim=True) - floor_mv)
        return torch.where(inside & wanders, floor_mv, expected)

    def expected_mep_mv(self, isi_ms: Tensor) -> Tensor:
        """Expected MEP [mV] at some ISIs [ms] (shape (t,)), shape (b, s, t)."""
        return self._between(self._expected_mv, isi_ms)

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows as 0 or 1, shape (b, s, t)."""
        return (self._between(self._cleared_mv, isi_ms) >= self._edge_level_mv).to(self.paths.level.dtype)

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next transformed MEP under each path, shape (b, s, t, y)."""
        level, noise_sd = (self._between(x, isi_ms).unsqueeze(-1) for x in (self.paths.level, self.paths.noise_sd))
        reach = 2.5 * noise_sd
        low, high = (level - reach).amin((1, 2, 3)), (level + reach).amax((1, 2, 3))
        share = torch.linspace(0.0, 1.0, OUTCOMES, dtype=level.dtype)
        outcomes = (low.unsqueeze(-1) + share * (high - low).unsqueeze(-1))[:, None, None, :]
        # One person at a time and in place, which a processor's cache holds.
        mass = level.new_empty((*level.shape[:-1], OUTCOMES))
        for own, outcome, middle, sd in zip(mass, outcomes, level, noise_sd, strict=True):
            torch.sub(outcome, middle, out=own).div_(sd).square_().mul_(-0.5)
            own.sub_(own.amax(-1, keepdim=True)).clamp_min_(NEARLY_NOTHING).exp_()
            own.div_(own.sum(-1, keepdim=True))
        return mass

    def _between(self, values: Tensor, isi_ms: Tensor) -> Tensor:
        """Values on the paths' grid, shape (b, s, m), interpolated at ISIs [ms] of shape (t,)."""
        step_ms = self.isi_ms[1] - self.isi_ms[0]
        position = ((isi_ms - self.isi_ms[0]) / step_ms).clamp(0.0, len(self.isi_ms) - 1.0).to(values.dtype)
        left = position.floor().long().clamp_max(len(self.isi_ms) - 2)
        # Several times as quick as indexing with brackets.
        between: Tensor = torch.lerp(values.index_select(-1, left), values.index_select(-1, left + 1), position - left)
        return between


@dataclass(frozen=True)
class GaussianProcess(Checked):
    """A Gaussian process on the transformed MEP.

    It learns from amplitudes only, and takes an amplitude below the detection limit for that limit. Profiles that may
    be anywhere ignore the SD of an ISI.

    Args:
        process: kernel, noise and hyperparameters.
        transform: `"log"`, `"sqrt"` or `"none"`: of which the MEP the process is.
        floor: what the least-excess rule is applied above. Where the floor is subtracted and TMS alone was not told,
            it is the median of what lies low on each path.
        samples: how many paths represent the posterior.
        detection_limit_mv: an amplitude of 0 lies below this [mV].

    Raises:
        InvalidValueError: an invalid setting, or a window's profile of something else than the log MEP.
    """

    process: ProcessSettings = field(default_factory=ProcessSettings, metadata={"spread": True})
    transform: Transform = "log"
    floor: FloorTreatment = field(default_factory=FloorTreatment, metadata={"spread": True})
    samples: Annotated[int, partial(whole, least=2)] = 256
    detection_limit_mv: SmallestAmplitude = 0.005

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.process.profile == "window" and self.transform != "log":
            raise InvalidValueError(
                "a window's profile is one of the log MEP",
                got=self.transform,
                expected="log",
                remedy='Set profile to "anywhere" for other transforms.',
            )

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> GaussianProcessPosterior:
        """The posterior before the first trial."""
        return GaussianProcessPosterior(self, space, seed, AmplitudeHistory.nothing(people))

    def update(self, posterior: GaussianProcessPosterior, observation: Observation) -> GaussianProcessPosterior:
        """The posterior after one more trial."""
        return replace(posterior, told=posterior.told.appended(observation), held=None)

    def fit(self, told: PersonTrials, space: DesignSpace) -> Fit:
        """Fit one person's trials.

        Args:
            told: the trials.
            space: where windows are sought.
        """
        told, fixed = self.seen(told), self.process.fixed
        if self.process.profile == "window":
            scale = Standardisation("log", self.detection_limit_mv, math.log(LOG_SCALE_MV), 1.0)
        elif fixed is not None:
            scale = Standardisation(self.transform, self.detection_limit_mv, fixed.centre, fixed.unit)
        else:
            meps_mv = np.concatenate((told.mep_mv, told.baseline_mv))
            scale = scale_of(meps_mv, self.transform, self.detection_limit_mv)
        return fit(self.process, scale, told, space)

    def seen(self, told: PersonTrials) -> PersonTrials:
        """Trials as they are fitted: small MEPs are 0 if the floor is `"zeroed"`."""
        return replace(
            told, mep_mv=self.floor.excess_mv(told.mep_mv), baseline_mv=self.floor.excess_mv(told.baseline_mv)
        )


@dataclass(frozen=True, eq=False)
class GaussianProcessPosterior(OfAmplitudes):
    """The posterior of b people; `held` are fits whose hyperparameters stay, one a person, or None."""

    model: GaussianProcess
    space: DesignSpace
    seed: int
    told: AmplitudeHistory
    held: tuple[Fit, ...] | None = None

    @property
    def pairs(self) -> int:
        """Number of pairs of stimuli among them; see `CountsPairs`."""
        return int((~np.isnan(self.told.isi_ms[0])).sum())

    @property
    def people(self) -> int:
        """Number of people."""
        return self.told.people

    @cached_property
    def fits(self) -> tuple[Fit, ...]:
        """The processes of each person, and how believable they are."""
        told = [self.told.person(person) for person in range(self.people)]
        if self.held is not None:
            return tuple(f.conditioned(self.model.seen(t)) for f, t in zip(self.held, told, strict=True))
        return tuple(self.model.fit(trials, self.space) for trials in told)

    @cached_property
    def _sample(self) -> ProfileSample:
        low_ms, high_ms = self.space.low_ms, self.space.high_ms
        points = math.ceil((high_ms - low_ms) / PATH_STEP_MS) + 1
        isi_ms = torch.linspace(low_ms, high_ms, points, dtype=torch.float64)
        drawn = [
            draw_paths(f, isi_ms, self.model.samples, np.random.default_rng((self.seed, self.trials, person)))
            for person, f in enumerate(self.fits)
        ]
        stacked = (torch.stack(field) for field in zip(*drawn, strict=True))
        paths = Paths(*(x if x.dtype == torch.bool else x.float() for x in stacked))
        return ProfileSample(isi_ms.float(), paths, self.model.transform, self.model.floor.floor)

    def outcome_mass(self, isi_ms: Array) -> Singles:
        """Predictive distribution of the next MEP; see `PredictsOutcomes`."""
        return self._sample.outcome_mass(torch.tensor(isi_ms)).numpy()

    def window_masks(self, isi_ms: Array) -> Singles:
        """Sampled windows; see `SamplesWindows`."""
        return self._sample.window_masks(torch.tensor(isi_ms)).numpy()

    def profiles_mv(self, isi_ms: Array) -> Singles:
        """Sampled profiles; see `SamplesProfiles`."""
        return self._sample.expected_mep_mv(torch.tensor(isi_ms)).numpy()

    def baselines_mv(self) -> Singles:
        """Sampled floors; see `SamplesProfiles`. They are 0 unless the floor is `"subtracted"`."""
        return self._sample.floor_mv.numpy().copy()

    def condition(self, isi_ms: Array, mep_mv: Array) -> GaussianProcessPosterior:
        """The posterior after one more trial, with the same hyperparameters; see `Conditions`."""
        return replace(self, told=self.told.appended(Observation.of(isi_ms, mep_mv)), held=self.fits)

    def log_evidence(self) -> Singles:
        """Log marginal likelihood of the trials, as a density of log amplitudes [nat]; see `HasEvidence`.

        It compares these processes, under equal noise and empirical Bayes, with each other only, not with other models.
        """
        return np.array([f.log_evidence for f in self.fits], dtype=np.float32)

    @property
    def trouble(self) -> str | None:
        """The fault of the last fit, of all people; see `ReportsTrouble`."""
        return " ".join(dict.fromkeys(f.trouble for f in self.fits if f.trouble)) or None

    def botorch_model(self, person: int = 0) -> botorch.models.SingleTaskGP:
        """The most believable process of one person; see `HasBotorchModel`.

        Its outcomes are transformed, standardised MEPs. Where the noise depends on the ISI, fantasies of BoTorch have
        the mean noise of the trials.
        """
        found = self.fits[person]
        return found.regression(torch.tensor(found.best))

    @cached_property
    def _windows(self) -> Singles:
        """Sampled windows of all people on the space's grid, (b, s, t)."""
        return self.window_masks(grid_of(self.space))

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""

        def profiles() -> SampledProfiles:
            mep_mv = self.profiles_mv(profile_grid(self.space))
            return SampledProfiles(mep_mv[person], self.baselines_mv()[person])

        windows = Runs.of_masks(self._windows[person])
        return sampled_estimate(windows, profiles, self.space, most_probable=MOST_PROBABLE)
