"""The bootstrap particle filter: the dissertation's PF [Kim2020, 4.3.2], after [Gordon1993].

Particles are ISIs. Each generation is diffused, measured with one MEP a particle, weighted by these MEPs, and
resampled, and nothing is learnt before. The profile is a Gaussian fitted to all MEPs so far, as NR fits it (Fig. 4.13,
4.14).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np

from isiw.checks import Checked, NonNegative, Positive, whole
from isiw.design import DesignSpace
from isiw.dissertation.nonlinear import NonlinearRegression
from isiw.dissertation.regression import FittedCurve, curve_masks
from isiw.estimate import WindowEstimate
from isiw.models.protocol import Observation
from isiw.models.shared.history import AmplitudeHistory, FloorTreatment, OfAmplitudes
from isiw.types import BoolArray, FloatArray, IntArray, Singles
from isiw.window import Window

WindowKind = Literal["expectation", "fit", "particles"]


def normalised(weights: FloatArray) -> FloatArray:
    """Weights that sum to 1; equal ones if all are 0."""
    total = weights.sum(axis=-1, keepdims=True)
    return np.asarray(np.where(total > 0, weights, 1.0) / np.where(total > 0, total, weights.shape[-1]))


def resampled(particles: FloatArray, weights: FloatArray, uniform: FloatArray) -> FloatArray:
    """Particles drawn in proportion to their weights, with replacement."""
    cumulative = weights.cumsum(axis=-1)
    cumulative[:, -1] = 1.0  # whatever rounding made of it
    picks = (uniform[:, :, None] >= cumulative[:, None, :]).sum(axis=-1)
    return np.take_along_axis(particles, picks, axis=-1)


@dataclass(frozen=True)
class BootstrapFilter(Checked):
    """A particle filter over ISIs.

    Args:
        particles: how many particles, and so MEPs a generation (4.4.4).
        diffusion_ms: SD of the noise that is added to each particle before it is measured (4.2); the text gives none.
        lattice_ms: particles lie on multiples of this from the low end of the range (Fig. 4.20) [ms].
        window: what is reported: the posterior `"expectation"` plus and minus a half width (4.3.2), where the `"fit"`
            of a Gaussian has at least 0.135 of its maximum (Fig. 4.13), or from the first to the last of the
            `"particles"` (4.4.4, Fig. 4.29).
        half_width_ms: the half width: three SDs of 25 ms in the text (4.3.2), two of them, 50 ms, in Fig. 4.13.
        floor: what is subtracted from an MEP before it becomes a weight; the text has the MEPs as they are.
    """

    particles: Annotated[int, partial(whole, least=2)] = 30
    diffusion_ms: NonNegative = 10.0
    lattice_ms: Positive = 5.0
    window: WindowKind = "expectation"
    half_width_ms: Positive = 75.0
    floor: FloorTreatment = field(default_factory=lambda: FloorTreatment("raw"), metadata={"spread": True})

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> BootstrapPosterior:
        """The first generation: uniform over the range, diffused, not measured."""
        rng = np.random.default_rng([seed, 1])  # [seed, 0] is the stream of seed
        particles = self.on_lattice(space, rng.uniform(space.low_ms, space.high_ms, (people, self.particles)))
        unknown = np.full_like(particles, np.nan)
        return BootstrapPosterior(
            model=self,
            space=space,
            seed=seed,
            told=AmplitudeHistory.nothing(people),
            plan_ms=self._diffused(space, particles, rng),
            count=np.zeros(people, dtype=np.int64),
            measured_ms=unknown,
            mep_mv=unknown,
            expectation_ms=np.full(people, np.nan),
            spread_ms=particles.std(axis=-1),
            weightless=np.zeros(people, dtype=bool),
            support_ms=np.full((people, 2), np.nan),
            fits=(None,) * people,
            floors_mv=np.full(people, np.nan),
        )

    def update(self, posterior: BootstrapPosterior, observation: Observation) -> BootstrapPosterior:
        """One more particle measured; the next generation if it was the last one of its own."""
        told = posterior.told.appended(observation)
        paired = np.flatnonzero(~np.isnan(told.isi_ms[:, -1]))
        measured_ms, mep_mv = posterior.measured_ms.copy(), posterior.mep_mv.copy()
        measured_ms[paired, posterior.count[paired]] = told.isi_ms[paired, -1]
        mep_mv[paired, posterior.count[paired]] = told.mep_mv[paired, -1]
        count = posterior.count.copy()
        count[paired] += 1
        after = replace(posterior, told=told, count=count, measured_ms=measured_ms, mep_mv=mep_mv)
        complete = count == self.particles
        return self._next_generation(after, complete) if complete.any() else after

    def _next_generation(self, posterior: BootstrapPosterior, complete: BoolArray) -> BootstrapPosterior:
        """The next generation of those people whose present one is complete; the others keep theirs."""
        rng = np.random.default_rng([posterior.seed, 1 + posterior.trials])
        floors_mv = [self.floor.level_mv(posterior.told.person(person)) for person in range(len(complete))]
        weights = self.floor.excess_mv(posterior.mep_mv, np.array(floors_mv)[:, None]).clip(0.0)
        # A particle is where its MEP was measured, which may not be where it was sent.
        particles = self.on_lattice(posterior.space, posterior.measured_ms)
        share = normalised(weights)
        drawn = resampled(particles, share, rng.uniform(size=particles.shape))
        plan_ms = self._diffused(posterior.space, drawn, rng)
        row = complete[:, None]
        return replace(
            posterior,
            plan_ms=np.where(row, plan_ms, posterior.plan_ms),
            count=np.where(complete, 0, posterior.count),
            measured_ms=np.where(row, np.nan, posterior.measured_ms),
            mep_mv=np.where(row, np.nan, posterior.mep_mv),
            expectation_ms=np.where(complete, (share * particles).sum(axis=-1), posterior.expectation_ms),
            spread_ms=np.where(complete, drawn.std(axis=-1), posterior.spread_ms),
            weightless=np.where(complete, ~(weights > 0).any(axis=-1), posterior.weightless),
            support_ms=np.where(row, np.stack((drawn.min(axis=-1), drawn.max(axis=-1)), axis=-1), posterior.support_ms),
            **self._fitted(posterior, complete, rng),
        )

    def _fitted(self, posterior: BootstrapPosterior, complete: BoolArray, rng: np.random.Generator) -> dict[str, Any]:
        """The Gaussians, with what was subtracted before; those of people without a complete generation stay."""
        fits, floors_mv, treatment = list(posterior.fits), posterior.floors_mv.copy(), FloorTreatment()
        for person in np.flatnonzero(complete).tolist():
            trials = posterior.told.person(person)
            floors_mv[person] = treatment.level_mv(trials)
            excess_mv = treatment.excess_mv(trials.mep_mv, floors_mv[person])
            fits[person] = NonlinearRegression().fit(trials.isi_ms, excess_mv, posterior.space, rng)
        return {"fits": tuple(fits), "floors_mv": floors_mv}

    def on_lattice(self, space: DesignSpace, isi_ms: FloatArray) -> FloatArray:
        """The nearest ISIs [ms] of the lattice, inside the range; same shape."""
        last = math.floor((space.high_ms - space.low_ms) / self.lattice_ms + 1e-9)
        return space.low_ms + self.lattice_ms * ((isi_ms - space.low_ms) / self.lattice_ms).round().clip(0, last)

    def _diffused(self, space: DesignSpace, particles: FloatArray, rng: np.random.Generator) -> FloatArray:
        return self.on_lattice(space, particles + self.diffusion_ms * rng.standard_normal(particles.shape))


@dataclass(frozen=True, eq=False)
class BootstrapPosterior(OfAmplitudes):
    """The particles of b people: the present generation (b, p), and the last one's result (b,), NaN without one."""

    model: BootstrapFilter
    space: DesignSpace
    seed: int
    told: AmplitudeHistory
    plan_ms: FloatArray
    count: IntArray  # how many of it have been measured, (b,)
    measured_ms: FloatArray  # NaN if not measured yet
    mep_mv: FloatArray
    expectation_ms: FloatArray
    spread_ms: FloatArray  # SD of the particles
    weightless: BoolArray  # no MEP had any weight
    support_ms: FloatArray  # the first and the last particle, (b, 2)
    fits: tuple[FittedCurve | None, ...]
    floors_mv: FloatArray  # subtracted from the MEPs for the fits

    @property
    def trouble(self) -> str | None:
        """That the last generation taught nothing; see `ReportsTrouble`."""
        if not self.weightless.any():
            return None
        return "No MEP of the last generation was above the floor: all of its particles were given the same weight."

    def proposed_isis_ms(self) -> Singles:
        """The particles that are not measured yet; see `ProposesIsi`."""
        left = self.model.particles - int(self.count.max())
        plan_ms = np.take_along_axis(self.plan_ms, self.count[:, None] + np.arange(left), axis=-1)
        return plan_ms.astype(np.float32)

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person: none before the first generation is complete."""
        fit, floor_mv, spread_ms = self.fits[person], float(self.floors_mv[person]), float(self.spread_ms[person])
        if fit is None:
            return WindowEstimate(probability=None, window=None, spread_ms=spread_ms)
        low, high = fit.confidence_mv(0.9)
        about_ms = self.expectation_ms[person] + self.model.half_width_ms * np.array((-1.0, 1.0))
        ends_ms = (about_ms if self.model.window == "expectation" else self.support_ms[person]).tolist()
        if self.model.window == "fit":
            window = Window.from_mask(fit.grid_ms, curve_masks(fit.mean_mv[None], floor_mv)[0])
        else:
            start_ms, end_ms = map(self.space.snap, ends_ms)
            window = Window(start_ms, end_ms)
        return WindowEstimate(
            probability=None,
            window=window,
            spread_ms=spread_ms,
            grid_ms=fit.grid_ms,
            profile_quantiles_mv=np.stack((low, fit.mean_mv, high)) + floor_mv,
        )
