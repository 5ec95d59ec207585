"""A Gaussian process on the transformed MEP, fitted again after each trial, and windows from its sample paths.

A profile need be smooth only. The price is trials: the process does not know that there is one window with flat ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np

from isiw.checks import Checked, Positive, whole
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.lazy import botorch, torch
from isiw.models.gp.fit import Fit, fit
from isiw.models.gp.prior import ProcessSettings, Standardisation, Transform, scale_of
from isiw.models.gp.samples import Paths, ProfileSample, draw_paths
from isiw.models.protocol import Observation, Tensor
from isiw.models.shared.history import AmplitudeHistory, FloorTreatment, OfAmplitudes, PersonTrials
from isiw.models.windows import Runs, SampledProfiles, profile_grid, sampled_estimate

PATH_STEP_MS = 4.0
"""Paths are drawn at ISIs this far apart at most, and are straight in between; length scales are 10 ms and more."""


@dataclass(frozen=True)
class GaussianProcess(Checked):
    """A Gaussian process on the transformed MEP.

    It learns from amplitudes only, ignores the SD of an ISI, and takes an amplitude below the detection limit for that
    limit.

    Args:
        process: kernel, noise and hyperparameters.
        transform: `"log"`, `"sqrt"` or `"none"`: of which the MEP the process is.
        floor: what the least-excess rule is applied above. Where the floor is subtracted and TMS alone was not told,
            it is the median of what lies low on each path.
        samples: how many paths represent the posterior.
        detection_limit_mv: an amplitude of 0 lies below this [mV].
    """

    process: ProcessSettings = field(default_factory=ProcessSettings, metadata={"spread": True})
    transform: Transform = "log"
    floor: FloorTreatment = field(default_factory=FloorTreatment, metadata={"spread": True})
    samples: Annotated[int, partial(whole, least=2)] = 256
    detection_limit_mv: Positive = 0.005

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> GaussianProcessPosterior:
        """The posterior before the first trial."""
        return GaussianProcessPosterior(self, space, seed, AmplitudeHistory.nothing(people))

    def update(self, posterior: GaussianProcessPosterior, observation: Observation) -> GaussianProcessPosterior:
        """The posterior after one more trial."""
        return replace(posterior, told=posterior.told.appended(observation), held=None)

    def fit(self, told: PersonTrials) -> Fit:
        """Fit one person's trials."""
        told, fixed = self.seen(told), self.process.fixed
        if fixed is not None:
            scale = Standardisation(self.transform, self.detection_limit_mv, fixed.centre, fixed.unit)
        else:
            meps_mv = np.concatenate((told.mep_mv, told.baseline_mv))
            scale = scale_of(meps_mv, self.transform, self.detection_limit_mv)
        return fit(self.process, scale, told)

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
        return tuple(map(self.model.fit, told))

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

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        """Predictive distribution of the next MEP; see `PredictsOutcomes`."""
        return self._sample.outcome_mass(isi_ms)

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Sampled windows; see `SamplesWindows`."""
        return self._sample.window_masks(isi_ms)

    def profiles_mv(self, isi_ms: Tensor) -> Tensor:
        """Sampled profiles; see `SamplesProfiles`."""
        return self._sample.expected_mep_mv(isi_ms)

    def baselines_mv(self) -> Tensor:
        """Sampled floors; see `SamplesProfiles`. They are 0 unless the floor is `"subtracted"`."""
        return self._sample.floor_mv

    def condition(self, isi_ms: Tensor, mep_mv: Tensor) -> GaussianProcessPosterior:
        """The posterior after one more trial, with the same hyperparameters; see `Conditions`."""
        return replace(self, told=self.told.appended(Observation.of(isi_ms, mep_mv)), held=self.fits)

    def log_evidence(self) -> Tensor:
        """Log marginal likelihood of the trials, as a density of log amplitudes [nat]; see `HasEvidence`.

        It compares these processes, under equal noise and empirical Bayes, with each other only, not with other models.
        """
        return torch.tensor([f.log_evidence for f in self.fits], dtype=torch.float32)

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

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""
        grid = torch.tensor(self.space.grid_ms, dtype=torch.float32)

        def profiles() -> SampledProfiles:
            mep_mv = self.profiles_mv(profile_grid(self.space))
            return SampledProfiles(mep_mv[person], self.baselines_mv()[person])

        return sampled_estimate(Runs.of_masks(self.window_masks(grid)[person]), profiles, self.space)
