"""Who knows a recorded person's law: all but start and width of the window; and all else, but not the law.

Known are the impact, the boost, the form of the profile, and of each intensity a histogram of amplitudes and their
mean: those of the smoothed law that trials are drawn from, or of the half that they are not drawn from. It designs by
greedy mutual information on a 5 ms grid and reports the level set of largest posterior expected F1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, cast

import numpy as np
from scipy.stats import norm

from benchmarks.oracle import LEVELS, Hypotheses, every_5_ms, nearest_levels
from benchmarks.recorded_people import ADDED_MV, STARTS_MS, WIDTHS_MS, Bank, RecordedResponse
from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.excess import least_excess_mv
from isiw.models.particles.changes import ChangePrior
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior, ShapeShares, Width
from isiw.models.shared.scales import Scale
from isiw.models.shared.start import Span, StartPrior
from isiw.subjects import SimulatedSubject
from isiw.types import FloatArray

BINS = 24
SPREAD_EVENLY, LEAST_SPREAD = 0.02, 1e-9
"""How much probability lies in all bins alike: of the law by half of the pulses, and of one that is known exactly."""


def windows() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Starts [ms from the impact], widths [ms] and shares of the windows that people may have, each of shape (h,)."""
    median_ms, log_sd, least_ms, most_ms = WIDTHS_MS
    starts_ms = np.arange(STARTS_MS[0], STARTS_MS[1] + 1.0, 5.0)
    widths_ms = np.arange(least_ms, most_ms + 1.0, 10.0)
    below = norm.cdf(np.log((widths_ms[1:] - 5.0) / median_ms) / log_sd)
    shares = np.diff(below, prepend=0.0, append=1.0)  # what is clipped lies at the ends
    start, width = (x.ravel() for x in np.meshgrid(starts_ms, widths_ms, indexing="ij"))
    return start, width, np.tile(shares, len(starts_ms)) / len(starts_ms)


WINDOWS: Final = ProfilePrior(
    p_window=0.999,  # everybody has one; a probability of 1 would leave no particle without
    shapes=ShapeShares(1.0, 0.0, 0.0, 0.0),
    start=StartPrior(spans=(Span(1.0, *STARTS_MS),), p_anywhere=0.0),
    widths=(Width(1.0, Scale(*WIDTHS_MS[:2])),),
    early=(),
)
NEARLY = 0.05
"""How far from the truth a known boost may be, and the drift of amplitudes where nothing changes, natural log."""


def all_but_the_law(subject: SimulatedSubject) -> Prior:
    """The default's prior of responses, with all that who knows the law knows besides, but for the impact.

    Args:
        subject: the person.
    """
    usual, boost_pct = Prior(), Scale(cast("RecordedResponse", subject.response).boost_pct_rmt, NEARLY)
    return replace(
        usual,
        profile=WINDOWS,
        muscles=tuple(replace(muscle, boost_pct=boost_pct) for muscle in usual.muscles),
        rectified=replace(usual.rectified, boost_pct=boost_pct),
        session=replace(usual.session, drift_sd=NEARLY, far_drift_share=0.0),
        changes=ChangePrior(level=0.0, intensity=0.0, enhancement=0.0, scale=0.0),
    )


def _logs(amplitudes_mv: FloatArray) -> FloatArray:
    return np.log(np.asarray(amplitudes_mv) + ADDED_MV)


def histograms(bank: Bank) -> tuple[FloatArray, FloatArray]:
    """Inner edges of the bins of the log amplitude, shape (23,), and the probability of each bin by level, (k, 24).

    Of a smoothed bank they are those of its law, of another one a law is made of the amplitudes.

    Args:
        bank: what was recorded.
    """
    logs = [_logs(level) for level in bank.amplitudes_mv]
    every = np.concatenate(logs)
    edges = np.linspace(every.min(), every.max(), BINS + 1)[1:-1]
    known = bank.kernel_log_sds is not None
    sds = bank.kernel_log_sds if known else [_bandwidth(each, edges[1] - edges[0]) for each in logs]
    spread = LEAST_SPREAD if known else SPREAD_EVENLY
    below = np.stack([norm.cdf((edges - each[:, None]) / sd).mean(0) for each, sd in zip(logs, sds, strict=True)])
    mass = np.diff(below, axis=1, prepend=0.0, append=1.0)
    return edges, (1.0 - spread) * mass + spread / BINS


def _bandwidth(logs: FloatArray, bin_width: float) -> float:
    """Silverman's rule of the SD; half a bin where a level has hardly any spread."""
    sd = logs.std(ddof=1) if len(logs) > 1 else 0.0
    return float(max((4.0 / 3.0 / len(logs)) ** 0.2 * sd, 0.5 * bin_width))


@dataclass
class KnowsTheLaw:
    """One session of who knows the law with one person.

    Args:
        subject: the person as far as known: responses of the bank or half that the law is from; neither start nor width
            is used.
        space: the design space, from the valve command.
    """

    subject: SimulatedSubject
    space: DesignSpace

    def __post_init__(self) -> None:
        response = self.subject.response
        if not isinstance(response, RecordedResponse):
            raise TypeError(response)
        starts_ms, widths_ms, shares = windows()
        self._middle_ms = (starts_ms + widths_ms / 2 + self.subject.hit_delay_ms)[:, None]
        self._sd_ms = (widths_ms / 4)[:, None]
        self._edges, mass = histograms(response.bank)
        places = response.places(LEVELS)
        low, part = places.astype(int), (places % 1.0)[:, None]
        by_level = (1.0 - part) * mass[low] + part * mass[np.minimum(low + 1, len(mass) - 1)]
        grid_mv = response.expected_evoked_mv(self._facilitation(self.space.grid_ms))
        baseline_mv = self.subject.baseline_mv
        excess_mv = grid_mv + response.floor.mean_mv - baseline_mv
        masks = excess_mv >= least_excess_mv(excess_mv.max(1, keepdims=True), baseline_mv)
        candidates_ms = every_5_ms(self.space)
        level_at = nearest_levels(self._facilitation(candidates_ms))
        self._hypotheses = Hypotheses(self.space, candidates_ms, by_level, level_at, masks, np.log(shares))

    def _facilitation(self, isi_ms: FloatArray) -> FloatArray:
        return np.exp(-0.5 * ((isi_ms - self._middle_ms) / self._sd_ms) ** 2)

    def ask(self) -> float:
        """The candidate ISI [ms] whose outcome says most about start and width."""
        return self._hypotheses.ask()

    def tell(self, isi_ms: float, mep_mv: float) -> None:
        """Learn from one trial."""
        levels = nearest_levels(self._facilitation(np.array([isi_ms])))[:, 0]
        self._hypotheses.learn(levels, int(np.searchsorted(self._edges, _logs(mep_mv))))

    def estimate(self) -> WindowEstimate:
        """The answer, and how good it is expected to be."""
        window, expected_f1 = self._hypotheses.expectation()
        return WindowEstimate(None, window, expected_f1=min(1.0, expected_f1), grid_ms=self.space.grid_ms)
