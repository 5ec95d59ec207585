"""A window that is followed while it is used: it may move, and the enhancement may fade, from pair to pair.

What the search for the window taught are profiles, sampled from its posterior; the window's law itself knows none that
moves. So each profile is shifted, and its enhancement scaled, by what changes at random from pair to pair: a hidden
Markov model on a grid of shifts, shares of the enhancement and levels, whose filter is exact. A window moves only while
it is one that moves; most stay, and so noise alone is not followed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from isiw.checks import Checked, Count, Positive, Share
from isiw.design import DesignSpace
from isiw.errors import StrategyError
from isiw.models.protocol import Posterior, SamplesProfiles, SamplesWindows
from isiw.trials import Trial
from isiw.types import FloatArray

_STEP_MS: Final = 3.0
_MOST_SHIFT_MS: Final = 60.0
SHIFTS_MS: Final = np.arange(-_MOST_SHIFT_MS, _MOST_SHIFT_MS + _STEP_MS / 2, _STEP_MS)
"""By how much the window may have moved [ms]."""

SHARES: Final = np.array([1.0, 0.67, 0.33, 0.0])
"""What may be left of the enhancement."""

LOG_LEVELS: Final = np.linspace(-1.0, 1.0, 5)
"""By what all that is evoked may have been multiplied, natural log."""

_LEAST_MV: Final = 0.02
"""Smaller amplitudes are alike: they are the floor of the EMG [mV]."""

_LOG_LEAST: Final = math.log(_LEAST_MV)

_FREEDOM: Final = 5.0
"""Degrees of freedom of the amplitudes' law, a t law of logarithms: one odd MEP moves no window."""

_ALONE_LOG_SD, _EVOKED_LOG_SD, _AS_TRIALS = 0.35, 0.9, 6
"""SD of an MEP, natural log, without enhancement and of what the tap adds; the latter counts as so many trials, beside
those of the search (docs/physiology.md)."""

_MOST_LOG_SD: Final = 1.2


@dataclass(frozen=True)
class Movement(Checked):
    """What changes from pair to pair, and how finely that is followed.

    Args:
        shift_sd_ms: SD of the move from one pair to the next [ms], of a window that moves.
        moves: probability that the window moves at first.
        begins: probability that one that stays begins to move, from one pair to the next.
        ends: probability that one that moves comes to rest.
        fading: probability that the enhancement moves to a neighbouring share.
        levelling: probability that the level moves to a neighbouring one.
        profiles: how many sampled profiles stand for what was known before.

    Raises:
        InvalidValueError: a value that is not positive.
    """

    shift_sd_ms: Positive = 1.2
    moves: Share = 0.2
    begins: Share = 0.004
    ends: Share = 0.01
    fading: Positive = 0.02
    levelling: Positive = 0.02
    profiles: Count = 32

    @cached_property
    def shifting(self) -> FloatArray:
        """Probabilities of shifts after a pair, by those before it, of a window that moves."""
        return _steps(len(SHIFTS_MS), (self.shift_sd_ms / _STEP_MS) ** 2)

    @cached_property
    def changing(self) -> FloatArray:
        """The same of shares and levels together."""
        shares, levels = _steps(len(SHARES), self.fading), _steps(len(LOG_LEVELS), self.levelling)
        both: FloatArray = np.kron(shares, levels).astype(float)
        return both


@dataclass(frozen=True, eq=False)
class Followed:
    """What is known of a window after some pairs; `weights` sum to 1.

    Args:
        movement: what changes from pair to pair.
        isi_ms: ISIs at which the rest is known [ms], ascending, shape (t,).
        baseline_mv: sampled expected MEPs of TMS alone [mV], shape (s,).
        profiles_mv: expected MEPs of each profile at each shift [mV], shape (s, shifts, t).
        inside: whether each ISI is in the window of each profile at each shift, in 0–1, same shape.
        log_sd: SD of an MEP that is enhanced, natural log.
        weights: the posterior, (stays and moves, s, shifts, shares, levels).
    """

    movement: Movement
    isi_ms: FloatArray
    baseline_mv: FloatArray
    profiles_mv: FloatArray
    inside: FloatArray
    log_sd: float
    weights: FloatArray

    @classmethod
    def begin(
        cls, posterior: Posterior, space: DesignSpace, earlier: Sequence[Trial], movement: Movement | None = None
    ) -> Followed:
        """What is known before the first pair, from a search's posterior, and its trials for how much MEPs vary.

        Raises:
            StrategyError: a posterior that samples neither profiles nor windows.
        """
        if not (isinstance(posterior, SamplesProfiles) and isinstance(posterior, SamplesWindows)):
            raise StrategyError(
                "the window of this strategy cannot be used",
                got=type(posterior).__name__,
                expected="a posterior that samples profiles and windows, such as that of default",
            )
        movement, grid = movement or Movement(), space.grid_ms
        isi_ms = grid[np.unique(np.linspace(0, len(grid) - 1, min(len(grid), 121)).round().astype(int))]
        profiles, masks = posterior.profiles_mv(isi_ms)[0], posterior.window_masks(isi_ms)[0]
        with_window = np.flatnonzero(masks.any(axis=-1))
        known = with_window if with_window.size else np.arange(len(profiles))
        picked = known[np.linspace(0, len(known) - 1, min(movement.profiles, len(known))).round().astype(int)]
        baseline = np.asarray(posterior.baselines_mv()[0], dtype=float)[picked]
        shifted, inside = _shifted(profiles[picked], isi_ms), _shifted(masks[picked], isi_ms)
        flat = np.zeros((len(picked), len(SHIFTS_MS), len(SHARES), len(LOG_LEVELS)))
        flat[:, len(SHIFTS_MS) // 2, 0, :] = np.exp(-0.5 * (LOG_LEVELS / 0.4) ** 2)
        middle = np.median(profiles, axis=0), float(np.median(baseline))
        ways = np.stack(((1.0 - movement.moves) * flat, movement.moves * flat)) / flat.sum()
        return cls(movement, isi_ms, baseline, shifted, inside, _log_sd(earlier, isi_ms, *middle), ways)

    def after(self, trial: Trial) -> Followed:
        """What is known after one more trial that counts: a pair, behind which the window may move, or TMS alone."""
        if not trial.told or trial.mep_mv is None:
            return self
        if trial.isi_ms is None:
            expected = np.broadcast_to(self.baseline_mv[:, None, None], self.weights.shape[1:4])
        else:
            expected = self._enhanced(self._at(self.profiles_mv, trial.isi_ms))
        log_sd = self._log_sd_of(expected)[..., None]
        log_mv = np.maximum(np.log(expected)[..., None] + LOG_LEVELS - 0.5 * log_sd**2, _LOG_LEAST)
        off = (math.log(max(trial.mep_mv, _LEAST_MV)) - log_mv) / log_sd
        tail = 1.0 + off * off * (1.0 / _FREEDOM)
        likely = 1.0 / (log_sd * tail * tail * tail)  # the power of a t law with 5 degrees of freedom
        weights = self.weights * likely
        known = replace(self, weights=weights / weights.sum())
        return known if trial.isi_ms is None else known.moved()

    def moved(self) -> Followed:
        """What is known of the window at the next pair."""
        movement = self.movement
        stays, moves = self.weights
        ways = np.stack(
            (
                (1.0 - movement.begins) * stays + movement.ends * moves,
                movement.begins * stays + (1.0 - movement.ends) * moves,
            )
        )
        ways[1] = np.tensordot(movement.shifting, ways[1], (1, 1)).swapaxes(0, 1)
        shape = ways.shape
        ways = (ways.reshape(-1, shape[3] * shape[4]) @ movement.changing).reshape(shape)
        return replace(self, weights=ways)

    def _log_sd_of(self, expected_mv: FloatArray) -> FloatArray:
        """SD of MEPs about their expectation, natural log: the larger, the more of them is enhancement."""
        base = self.baseline_mv[:, None, None]
        share = np.clip(1.0 - base / expected_mv, 0.0, 1.0)
        spread: FloatArray = np.hypot((1.0 - share) * _ALONE_LOG_SD, share * self.log_sd)
        return spread

    def _at(self, values: FloatArray, isi_ms: float) -> FloatArray:
        """Values at an ISI between those at which they are known, (s, shifts)."""
        place = float(np.interp(isi_ms, self.isi_ms, np.arange(len(self.isi_ms))))
        low = min(int(place), len(self.isi_ms) - 2)
        return values[..., low] * (1.0 - (place - low)) + values[..., low + 1] * (place - low)

    def _enhanced(self, profile_mv: FloatArray) -> FloatArray:
        """Expected MEPs at one ISI with each share of the enhancement, (s, shifts, shares)."""
        base = self.baseline_mv[:, None, None]
        return base + SHARES * (profile_mv[..., None] - base)

    @cached_property
    def _placed(self) -> FloatArray:
        """Weights of profiles, shifts and shares, (s, shifts, shares)."""
        placed: FloatArray = self.weights.sum((0, -1))
        return placed

    @cached_property
    def enhancement_mv(self) -> FloatArray:
        """The expected enhancement at each ISI [mV], shape (t,)."""
        left = self._placed @ SHARES
        mean: FloatArray = _mean(left, self.profiles_mv) - float(left.sum(-1) @ self.baseline_mv)
        return mean

    @cached_property
    def p_inside(self) -> FloatArray:
        """The probability that each ISI is in the window, shape (t,)."""
        return _mean(self._placed.sum(-1), self.inside)

    def best_ms(self, level: float = 0.9) -> tuple[float, float, float]:
        """Median of the ISI of the largest enhancement [ms], and the ends of its central interval."""
        best = self.isi_ms[self.profiles_mv[:, len(SHIFTS_MS) // 2].argmax(-1)]
        return _interval((best[:, None] + SHIFTS_MS).ravel(), self._placed.sum(-1).ravel(), level)

    def news(self, allowed: FloatArray) -> float:
        """The ISI, of some [ms], at which the next MEP says most of where the window is, and what is left of it."""
        columns = np.searchsorted(self.isi_ms, allowed)
        expected = self.baseline_mv[:, None, None, None] + SHARES[:, None] * (
            self.profiles_mv[:, :, None, columns] - self.baseline_mv[:, None, None, None]
        )
        log_mv = np.log(np.maximum(expected, _LEAST_MV))
        spread = _mean(self._placed, log_mv**2) - _mean(self._placed, log_mv) ** 2
        return float(allowed[int(np.argmax(spread))])

    def interval(self, values: FloatArray, axis: int, level: float = 0.9) -> tuple[float, float, float]:
        """Median of the shift (axis 2) or of another change, and the ends of its central interval."""
        weights = self.weights.sum(tuple(other for other in range(5) if other != axis))
        return _interval(values, weights, level)


def _interval(values: FloatArray, weights: FloatArray, level: float) -> tuple[float, float, float]:
    shares = (0.5, (1 - level) / 2, (1 + level) / 2)
    median, low, high = np.quantile(values, shares, weights=weights, method="inverted_cdf").tolist()
    return median, low, high


def _mean(weights: FloatArray, values: FloatArray) -> FloatArray:
    """The mean of values (..., t) over all but the last axis, shape (t,)."""
    mean: FloatArray = weights.ravel() @ values.reshape(weights.size, -1)
    return mean


def _shifted(values: FloatArray, isi_ms: FloatArray) -> FloatArray:
    """Values (s, t) as each shift moves them, (s, shifts, t)."""
    rows = [[np.interp(isi_ms - shift, isi_ms, row) for shift in SHIFTS_MS] for row in np.asarray(values, dtype=float)]
    return np.asarray(rows)


def _steps(number: int, share: float) -> FloatArray:
    """Probabilities of a step to a neighbour, half of the share to each side; nothing leaves at the ends."""
    share = min(share, 1.0)
    steps = (1.0 - share) * np.eye(number) + share / 2.0 * (np.eye(number, k=1) + np.eye(number, k=-1))
    steps[0, 0] += share / 2.0
    steps[-1, -1] += share / 2.0
    return steps


def _log_sd(trials: Sequence[Trial], isi_ms: FloatArray, profile_mv: FloatArray, baseline_mv: float) -> float:
    """SD of enhanced MEPs about what is expected of them, natural log."""
    pulses = [t for t in trials if t.told and t.mep_mv is not None and t.isi_ms is not None]
    expected = np.array([float(np.interp(trial.isi_ms or 0.0, isi_ms, profile_mv)) for trial in pulses])
    mep_mv = np.array([trial.mep_mv for trial in pulses], dtype=float)
    enhanced = expected > 2.0 * baseline_mv
    off = np.log(np.maximum(mep_mv[enhanced], _LEAST_MV) / expected[enhanced])
    off = off - np.median(off) if off.size else off
    squares = _AS_TRIALS * _EVOKED_LOG_SD**2 + float(np.sum(np.minimum(np.abs(off), 2.0) ** 2))
    return min(math.sqrt(squares / (_AS_TRIALS + off.size)), _MOST_LOG_SD)
