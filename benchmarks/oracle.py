"""The oracle: what could be known if everything about a person but the window's start and width were known.

It knows the profile's family, the response and its noise, the baseline and the hit delay; its prior over start and
width is the cohort's. It designs by greedy mutual information on a 5 ms grid and reports the window of largest
posterior expected F1. Outcomes are exact bin probabilities of the log MEP.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import gamma, norm

from isiw.design import DesignSpace
from isiw.profiles import PeakProfile
from isiw.recruitment import GainResponse, RecruitmentResponse, ResponseCurve
from isiw.subjects import SimulatedSubject
from isiw.types import FloatArray
from isiw.window import EDGE_LEVEL, Window

LEVELS = np.linspace(0.0, 1.0, 61) ** 2
STARTS_MS = np.arange(5.0, 110.1, 3.0)
WIDTHS_MS = np.exp(np.linspace(np.log(35.0), np.log(230.0), 48))
BINS = 72


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


def outcome_table(subject: SimulatedSubject) -> tuple[FloatArray, FloatArray]:
    """Edges of the bins of the MEP [mV], shape (y - 1,), and the probability of each bin by level, shape (l, y)."""
    floor = subject.response.floor
    edges = np.geomspace(0.3 * floor.median_mv, 1.5, BINS - 1)
    floors = floor.median_mv * np.exp(floor.log_sd * _quantile_nodes(24))
    cdf = np.stack(
        [_evoked_cdf(subject.response, level, edges[:, None] - floors).mean(-1) for level in LEVELS.tolist()]
    )
    padded = np.concatenate([np.zeros((len(LEVELS), 1)), cdf, np.ones((len(LEVELS), 1))], axis=1)
    mass = np.maximum(np.diff(padded, axis=1), 0.0)
    mass = (1 - subject.outlier_probability) * mass + subject.outlier_probability / BINS + 1e-9
    return edges, mass / mass.sum(1, keepdims=True)


def _prior(starts_ms: FloatArray, widths_ms: FloatArray) -> FloatArray:
    """The cohorts' prior: uniform start, log-normal width clipped to 40-230 ms (the clipped mass is at the ends)."""
    density = norm.pdf(np.log(widths_ms / 100.0) / 0.42)
    return (density * ((starts_ms >= 5) & (starts_ms <= 110))) / np.sum(density)


@dataclass
class Oracle:
    """One session of the oracle with one person.

    Args:
        subject: the person, with a profile of one symmetric peak.
        space: the design space.
    """

    subject: SimulatedSubject
    space: DesignSpace

    def __post_init__(self) -> None:
        if not isinstance(self.subject.profile, PeakProfile):
            raise TypeError(self.subject.profile)
        starts, widths = (x.ravel() for x in np.meshgrid(STARTS_MS, WIDTHS_MS, indexing="ij"))
        shift = self.subject.hit_delay_ms if self.space.reference == "valve" else 0.0
        grid = self.space.grid_ms
        middle, sd = starts + widths / 2 + shift, widths / 4
        self.candidates_ms = grid[(grid - grid[0]) % 5.0 == 0]
        self._edges_mv, self._mass = outcome_table(self.subject)
        self._middle, self._sd = middle, sd
        self._level_at = self._levels(self.candidates_ms)
        excess = self.subject.response.expected_evoked_mv(LEVELS) - self.subject.response.expected_evoked_mv(0.0)
        edge_level = np.interp(EDGE_LEVEL * excess[-1], excess, LEVELS)
        self._masks = self._facilitation(grid) >= edge_level
        prior = _prior(starts, widths)
        self._log_weights = np.log(prior / prior.sum())

    def _facilitation(self, isi_ms: FloatArray) -> FloatArray:
        return np.exp(-0.5 * ((isi_ms - self._middle[:, None]) / self._sd[:, None]) ** 2)

    def _levels(self, isi_ms: FloatArray) -> FloatArray:
        return np.rint(np.sqrt(self._facilitation(np.asarray(isi_ms))) * (len(LEVELS) - 1)).astype(int)

    def ask(self) -> float:
        """The candidate ISI [ms] whose outcome says most about start and width."""
        weights = np.exp(self._log_weights)
        entropy = -(self._mass * np.log(self._mass)).sum(1)
        shares = np.stack([np.bincount(levels, weights, len(LEVELS)) for levels in self._level_at.T])
        mixture = shares @ self._mass
        gain = -(mixture * np.log(mixture)).sum(1) - shares @ entropy
        return float(self.candidates_ms[gain.argmax()])

    def tell(self, isi_ms: float, mep_mv: float) -> None:
        """Learn from one trial."""
        outcome = np.searchsorted(self._edges_mv, mep_mv / self.subject.scale)
        self._log_weights += np.log(self._mass[self._levels(np.array([isi_ms]))[:, 0], outcome])
        self._log_weights -= np.logaddexp.reduce(self._log_weights)

    def window(self) -> Window | None:
        """The window of largest posterior expected F1 among the level sets of the posterior's membership."""
        weights = np.exp(self._log_weights)
        membership = weights @ self._masks
        cuts = np.linspace(0.1, 0.9, 17) * membership.max()
        candidates = membership >= cuts[:, None]
        overlap = candidates.astype(np.float32) @ self._masks.T.astype(np.float32)
        sizes = candidates.sum(1)[:, None] + self._masks.sum(1)
        expected = (2 * overlap / np.maximum(sizes, 1)) @ weights
        return Window.from_mask(self.space.grid_ms, candidates[expected.argmax()])
