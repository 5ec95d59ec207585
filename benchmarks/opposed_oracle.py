"""The oracle of the cohort `supra-threshold`: it knows all about a person but the starts and widths of both segments.

It designs by greedy mutual information on a 5 ms grid and reports, of each kind, the level set of largest posterior
expected F1, or none if that has more. Its prior is a fixed sample of the cohort's law.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.stats import norm, qmc

from benchmarks.oracle import outcome_table
from isiw.design import DesignSpace
from isiw.excess import least_excess_mv
from isiw.subjects.measured import RANGE_MS, WIDTH_LIMITS_MS
from isiw.subjects.responses import OpposedProfile, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.types import BoolArray, FloatArray
from isiw.window import Window

HYPOTHESES = 2**16
LEVELS = 61
SHARES = np.linspace(0.0, 1.0, LEVELS)
"""Places between the deepest depression and the largest enhancement, as shares."""


@cache
def _laws() -> tuple[FloatArray, FloatArray]:
    """Starts and widths of the enhanced and the depressed segment [ms], each of shape (2, k)."""
    draws = qmc.Sobol(5, seed=1).random(HYPOTHESES).T
    widths_ms = np.clip(30.0 * np.exp(0.3 * norm.ppf(draws[:2].clip(1e-9, 1 - 1e-9))), *WIDTH_LIMITS_MS)
    left_ms = np.sort(draws[2:4], axis=0) * (RANGE_MS - widths_ms.sum(0))
    starts_ms = np.stack((left_ms[0], left_ms[1] + widths_ms[0]))
    order = np.where(draws[4] < 0.5, [[0], [1]], [[1], [0]])
    return np.take_along_axis(starts_ms, order, 0), np.take_along_axis(widths_ms, order, 0)


@dataclass
class OpposedOracle:
    """One session of the oracle with one person.

    Args:
        subject: a person of the cohort `supra-threshold`.
        space: the design space, from the impact.
    """

    subject: SimulatedSubject
    space: DesignSpace

    def __post_init__(self) -> None:
        profile, response = self.subject.profile, self.subject.response
        if not (isinstance(profile, OpposedProfile) and isinstance(response, RecruitmentResponse)):
            raise TypeError(profile)
        self._depth = profile.depth
        levels = SHARES * (1.0 + profile.depth) - profile.depth
        self._edges_mv, self._mass = outcome_table(self.subject, levels, 6.0 * response.amplitude_mv)
        grid = self.space.grid_ms
        self.candidates_ms = grid[(grid - grid[0]) % 5.0 == 0]
        self._level_at = [self._levels(isi_ms) for isi_ms in self.candidates_ms]
        floor_mv = response.floor.mean_mv
        excess_mv = response.expected_evoked_mv(levels) + floor_mv - self.subject.baseline_mv
        by_isi = np.stack([excess_mv[self._levels(isi_ms)] for isi_ms in grid], axis=-1).astype(np.float32)
        self._masks = {kind: self._segments(sign * by_isi) for kind, sign in (("enhanced", 1), ("depressed", -1))}
        self._log_weights = np.full(HYPOTHESES, -np.log(HYPOTHESES))

    def _segments(self, excess_mv: FloatArray) -> BoolArray:
        least_mv = least_excess_mv(excess_mv.max(-1, keepdims=True), self.subject.baseline_mv)
        return np.asarray(excess_mv >= least_mv)

    def _levels(self, isi_ms: float) -> FloatArray:
        """Nearest level of each hypothesis at an ISI, shape (k,)."""
        starts_ms, widths_ms = _laws()
        bells = np.exp(-2.0 * ((isi_ms - starts_ms) / widths_ms * 2.0 - 1.0) ** 2)
        share = (bells[0] - self._depth * bells[1] + self._depth) / (1.0 + self._depth)
        return np.rint(share * (LEVELS - 1)).astype(np.int64)

    def ask(self) -> float:
        """The candidate ISI [ms] whose outcome says most about both segments."""
        weights = np.exp(self._log_weights)
        entropy = -(self._mass * np.log(self._mass)).sum(1)
        shares = np.stack([np.bincount(levels, weights, LEVELS) for levels in self._level_at])
        mixture = shares @ self._mass
        gain = -(mixture * np.log(mixture)).sum(1) - shares @ entropy
        return float(self.candidates_ms[gain.argmax()])

    def tell(self, isi_ms: float, mep_mv: float) -> None:
        """Learn from one trial."""
        outcome = np.searchsorted(self._edges_mv, mep_mv)
        self._log_weights += np.log(self._mass[self._levels(isi_ms), outcome])
        self._log_weights -= np.logaddexp.reduce(self._log_weights)

    def estimate(self, kind: str) -> Window | None:
        """The segment of a kind, `enhanced` or `depressed`, of largest posterior expected F1, or none."""
        heaviest = np.argsort(self._log_weights)[-8192:]
        weights = np.exp(self._log_weights[heaviest])
        weights, masks = weights / weights.sum(), self._masks[kind][heaviest]
        membership = weights @ masks
        candidates = membership >= np.linspace(0.1, 0.9, 17)[:, None] * membership.max()
        overlap = candidates.astype(np.float32) @ masks.T.astype(np.float32)
        sizes = candidates.sum(1)[:, None] + masks.sum(1)
        expected = (2 * overlap / np.maximum(sizes, 1)) @ weights
        if weights[~masks.any(1)].sum() >= expected.max():
            return None
        return Window.from_mask(self.space.grid_ms, candidates[expected.argmax()])
