"""The oracle: what could be known if everything about a person but the window's start and width were known.

It knows the profile's family, the response and its noise, the baseline and the hit delay; its prior over start and
width is the cohort's. It designs by greedy mutual information on a 5 ms grid and reports the window of largest
posterior expected F1, or "no window" if that has more. Outcomes are exact bin probabilities of the log MEP. Of what
varies from trial to trial besides (drift and start-up, hit delay, untold jitter) it knows nothing.

The second oracle knows all of this but that there is a window: it gives "no window" the share that the default does.
The first knows more than anybody can who has not seen the person's MEPs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import gamma, norm

from isiw.design import DesignSpace
from isiw.excess import least_excess_mv
from isiw.studies import SimulatedSession, play
from isiw.subjects.measured import LABS, MEASURED_KIM, WIDTHS_KIM_MS, MeasuredPerson, lab
from isiw.subjects.responses import GainResponse, PeakProfile, RecruitmentResponse, ResponseCurve
from isiw.subjects.subject import OUTLIERS_MV, SimulatedSubject
from isiw.types import BoolArray, FloatArray, IntArray
from isiw.window import Window

P_WINDOW: Final = 0.72
"""How probable a window is to the second oracle, where the cohort itself does not say: all have one."""

LEVELS = np.linspace(0.0, 1.0, 61) ** 2
BINS = 72


class Spans(NamedTuple):
    """The windows of a cohort: start [ms from the impact], width [ms] and share of each, shape (k,)."""

    starts_ms: FloatArray
    widths_ms: FloatArray
    shares: FloatArray


def _uniform(low_ms: float, high_ms: float, step_ms: float) -> FloatArray:
    return np.linspace(low_ms, high_ms, round((high_ms - low_ms) / step_ms) + 1)


def _log_normal(median_ms: float, log_sd: float, low_ms: float, high_ms: float) -> tuple[FloatArray, FloatArray]:
    """Widths of a clipped log-normal law, and their shares; what is clipped lies at the ends."""
    widths_ms = np.geomspace(low_ms, high_ms, 48)
    between_ms = np.sqrt(widths_ms[1:] * widths_ms[:-1])
    below = norm.cdf(np.log(between_ms / median_ms) / log_sd)
    return widths_ms, np.diff(below, prepend=0.0, append=1.0)


def _even(widths_ms: FloatArray) -> tuple[FloatArray, FloatArray]:
    return widths_ms, np.full(len(widths_ms), 1 / len(widths_ms))


def _any_with_any(starts_ms: FloatArray, widths: tuple[FloatArray, FloatArray]) -> Spans:
    """Any start with any width, starts all as likely."""
    start, width = (x.ravel() for x in np.meshgrid(starts_ms, widths[0], indexing="ij"))
    return Spans(start, width, np.tile(widths[1], len(starts_ms)) / len(starts_ms))


def _either(*parts: tuple[float, Spans]) -> Spans:
    columns = zip(*(part._replace(shares=share * part.shares) for share, part in parts), strict=True)
    return Spans(*(np.concatenate(column) for column in columns))


_STARTS: Final = _uniform(5, 110, 3)
_USUAL: Final = _any_with_any(_STARTS, _log_normal(100.0, 0.42, 40.0, 230.0))
_LATE: Final = _any_with_any(_uniform(80, 200, 3), _log_normal(100.0, 0.42, 40.0, 230.0))
_VERY_WIDE: Final = _any_with_any(_uniform(0, 60, 3), _log_normal(200.0, 0.25, 120.0, 320.0))


def _profiles_of(person: MeasuredPerson) -> Spans:
    """Profiles of one of `kim11-measured`, whose measured window starts anywhere in its law."""
    boost = person.response().boost_pct_rmt
    profiles = [person.profile(start_ms, boost) for start_ms in _uniform(50, 100, 2.5).tolist()]
    starts_ms, widths_ms = (np.array([getattr(p, name) for p in profiles]) for name in ("start_ms", "width_ms"))
    return Spans(starts_ms, *_even(widths_ms))


_QUANTILES: Final = (np.arange(60) + 0.5) / 60
_SHIFTED: Final = _any_with_any(
    np.sort((_uniform(5, 110, 7)[:, None] + norm.ppf(_QUANTILES[1::3], scale=12.0)).ravel()),
    _log_normal(100.0, 0.42, 40.0, 230.0),
)

SPANS: Final[Mapping[str, Spans]] = {
    **dict.fromkeys(
        ("gaussian", "low-response", "outliers", "drift", "jitter", "jitter-untold", "recruitment"), _USUAL
    ),
    "narrow": _any_with_any(_STARTS, _even(_uniform(35, 50, 1))),
    "wide": _any_with_any(_STARTS, _even(_uniform(180, 230, 2))),
    "kim11": _any_with_any(_uniform(20, 100, 2.5), _even(np.array(WIDTHS_KIM_MS, dtype=float))),
    "kim11-measured": _either(*((1 / len(MEASURED_KIM), _profiles_of(person)) for person in MEASURED_KIM)),
    **dict.fromkeys(("other-rig", "steep", "flat", "weak", "rmt-off", "hand"), _USUAL),
    "late": _LATE,
    "very-wide": _VERY_WIDE,
    "electrical": _any_with_any(_uniform(5, 50, 2), _log_normal(20.0, 0.3, 10.0, 40.0)),
    "odd": _either((5 / 7, _USUAL), (1 / 7, _LATE), (1 / 7, _VERY_WIDE)),
    "another-day": _either((0.65, _USUAL), (0.35, _SHIFTED)),  # second days are half of all, and .7 of them shifted
}
"""What `cohorts` says of start and width, of the cohorts whose profiles the oracle knows: one symmetric peak."""


def spans_of(cohort: str, seed: int) -> Spans:
    """The windows of a cohort.

    Args:
        cohort: its name.
        seed: seed of its people, which says of what lab they are.

    Raises:
        ValueError: the oracle does not know its profiles.
    """
    if cohort in LABS:
        law = lab(cohort, seed)
        return _any_with_any(norm.ppf(_QUANTILES, *law.start_ms), _log_normal(*law.width_ms, 40.0, 230.0))
    if cohort not in SPANS:
        raise ValueError(f"the oracle does not know the windows of {cohort}; it knows {', '.join(SPANS)}")
    return SPANS[cohort]


def _quantile_nodes(count: int) -> FloatArray:
    return norm.ppf((np.arange(count) + 0.5) / count)


def _evoked_cdf(response: ResponseCurve, level: float, amplitude_mv: FloatArray) -> FloatArray:
    """P(evoked MEP <= amplitude) by facilitation level; negative amplitudes have probability 0."""
    positive = np.maximum(amplitude_mv, 1e-12)
    if isinstance(response, GainResponse):
        share = float(response.response_probability(level))
        scale = max(response.gain_mv * level * response.cv**2, 1e-12)
        below = 1.0 - share + share * gamma.cdf(positive, response.cv**-2, scale=scale)
    elif isinstance(response, RecruitmentResponse):
        medians = response.evoked_mv(level, _quantile_nodes(96))
        below = norm.cdf(np.log(positive[..., None] / medians) / response.sigma_y).mean(-1)
    else:
        raise TypeError(response)
    return np.where(amplitude_mv > 0, below, 0.0)


def outcome_table(
    subject: SimulatedSubject, levels: FloatArray = LEVELS, top_mv: float = 1.5
) -> tuple[FloatArray, FloatArray]:
    """Edges of the bins of the MEP [mV], shape (y - 1,), and the probability of each bin by level, shape (l, y)."""
    floor = subject.response.floor
    edges = np.geomspace(0.3 * floor.median_mv, top_mv, BINS - 1)
    floors = floor.median_mv * np.exp(floor.log_sd * _quantile_nodes(24))
    cdf = np.stack(
        [_evoked_cdf(subject.response, level, edges[:, None] - floors).mean(-1) for level in levels.tolist()]
    )
    low_mv, high_mv = OUTLIERS_MV
    outliers = np.clip((edges - low_mv) / (high_mv - low_mv), 0.0, 1.0)
    cdf += subject.outlier_probability * (outliers - cdf)
    padded = np.concatenate([np.zeros((len(levels), 1)), cdf, np.ones((len(levels), 1))], axis=1)
    mass = np.maximum(np.diff(padded, axis=1), 0.0) + 1e-9
    return edges, mass / mass.sum(1, keepdims=True)


@dataclass
class Hypotheses:
    """Windows that a person may have, and how probable each is: what an oracle asks, learns and reports.

    Args:
        space: the design space.
        candidates_ms: the ISIs that may be asked, shape (c,).
        mass: probability of each bin of the outcome by level of facilitation, shape (l, y).
        level_at: the level of each hypothesis at each candidate, shape (h, c).
        masks: its window on the space's grid, shape (h, t).
        log_weights: logs of their probabilities, shape (h,).
    """

    space: DesignSpace
    candidates_ms: FloatArray
    mass: FloatArray
    level_at: IntArray
    masks: BoolArray
    log_weights: FloatArray

    def ask(self) -> float:
        """The candidate ISI [ms] whose outcome says most about the window."""
        weights = np.exp(self.log_weights)
        entropy = -(self.mass * np.log(self.mass)).sum(1)
        shares = np.stack([np.bincount(levels, weights, len(self.mass)) for levels in self.level_at.T])
        mixture = shares @ self.mass
        gain = -(mixture * np.log(mixture)).sum(1) - shares @ entropy
        return float(self.candidates_ms[gain.argmax()])

    def learn(self, levels: IntArray, outcome: int) -> None:
        """Learn from one trial: the level of each hypothesis at its ISI, shape (h,), and the bin of its outcome."""
        self.log_weights = self.log_weights + np.log(self.mass[levels, outcome])
        self.log_weights -= np.logaddexp.reduce(self.log_weights)

    def expectation(self) -> tuple[Window | None, float]:
        """The answer of largest posterior expected F1, a level set of the membership or none; and that F1."""
        weights = np.exp(self.log_weights)
        membership = weights @ self.masks
        cuts = np.linspace(0.1, 0.9, 17) * membership.max()
        candidates = membership >= cuts[:, None]
        overlap = candidates.astype(np.float32) @ self.masks.T.astype(np.float32)
        sizes = candidates.sum(1)[:, None] + self.masks.sum(1)
        expected = (2 * overlap / np.maximum(sizes, 1)) @ weights
        if (none := weights[~self.masks.any(1)].sum()) >= expected.max():
            return None, float(none)
        return Window.from_mask(self.space.grid_ms, candidates[expected.argmax()]), float(expected.max())


@dataclass
class Oracle:
    """One session of the oracle with one person.

    Args:
        subject: the person, with a profile of one symmetric peak.
        space: the design space.
        spans: the windows of the cohort that the person is of.
        p_window: how probable a window is before the first trial.
    """

    subject: SimulatedSubject
    space: DesignSpace
    spans: Spans
    p_window: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.subject.profile, PeakProfile):
            raise TypeError(self.subject.profile)
        starts, widths = self.spans.starts_ms, self.spans.widths_ms
        shift = self.subject.hit_delay_ms if self.space.reference == "valve" else 0.0
        self._middle, self._sd = starts + widths / 2 + shift, widths / 4
        candidates_ms = every_5_ms(self.space)
        self._edges_mv, mass = outcome_table(self.subject)
        masks, log_weights = self._windows(self._facilitation(self.space.grid_ms)), np.log(self.spans.shares)
        level_at = self._levels(candidates_ms)
        if self.p_window < 1.0:  # no ISI facilitates anything
            level_at = np.vstack((level_at, np.zeros_like(level_at[:1])))
            masks = np.vstack((masks, np.zeros_like(masks[:1])))
            log_weights = np.append(log_weights + np.log(self.p_window), np.log1p(-self.p_window))
        self._hypotheses = Hypotheses(self.space, candidates_ms, mass, level_at, masks, log_weights)

    def _windows(self, facilitation: FloatArray) -> BoolArray:
        """Windows by the 0.135 rule, empty where the range reaches too little, shape of `facilitation`."""
        response = self.subject.response
        excess_mv = response.expected_evoked_mv(LEVELS) - response.expected_evoked_mv(0.0)
        peak_mv = np.interp(facilitation.max(-1, keepdims=True), LEVELS, excess_mv)
        least_mv = least_excess_mv(self.subject.scale * peak_mv, self.subject.baseline_mv) / self.subject.scale
        return (facilitation >= np.interp(least_mv, excess_mv, LEVELS)) & np.isfinite(least_mv)

    def _facilitation(self, isi_ms: FloatArray) -> FloatArray:
        return np.exp(-0.5 * ((isi_ms - self._middle[:, None]) / self._sd[:, None]) ** 2)

    def _levels(self, isi_ms: FloatArray) -> IntArray:
        return nearest_levels(self._facilitation(np.asarray(isi_ms)))

    def ask(self) -> float:
        """The candidate ISI [ms] whose outcome says most about start and width."""
        return self._hypotheses.ask()

    def tell(self, isi_ms: float | None, mep_mv: float | None = None, *, isi_sd_ms: float = 0.0) -> None:
        """Learn from one trial; the SD of the ISI is not used."""
        del isi_sd_ms
        if isi_ms is None or mep_mv is None:
            raise ValueError("the oracle is told amplitudes at ISIs only")
        outcome = np.searchsorted(self._edges_mv, mep_mv / self.subject.scale)
        levels = self._levels(np.array([isi_ms]))[:, 0]
        if self.p_window < 1.0:
            levels = np.append(levels, 0)
        self._hypotheses.learn(levels, int(outcome))

    def estimate(self) -> Window | None:
        """The answer of largest posterior expected F1: a level set of the posterior's membership, or none."""
        return self._hypotheses.expectation()[0]


def every_5_ms(space: DesignSpace) -> FloatArray:
    """The ISIs that an oracle asks [ms]."""
    return space.grid_ms[(space.grid_ms - space.low_ms) % 5.0 == 0]


def nearest_levels(facilitation: FloatArray) -> IntArray:
    """The nearest of `LEVELS`, by number; same shape."""
    return np.rint(np.sqrt(facilitation) * (len(LEVELS) - 1)).astype(int)


def simulate_oracle(session: SimulatedSession) -> pd.DataFrame:
    """Run one session of a study with the oracle."""
    return play(session, Oracle(session.subject(), session.space, spans_of(session.cohort, session.seed)))


def simulate_second_oracle(session: SimulatedSession) -> pd.DataFrame:
    """Run one session of a study with the oracle that does not know that there is a window."""
    spans = spans_of(session.cohort, session.seed)
    return play(session, Oracle(session.subject(), session.space, spans, P_WINDOW))
