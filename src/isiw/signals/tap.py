"""The tap's own response in the EMG: its course, learnt from EMG that shows it alone, and amplitudes without it.

What a tap evokes comes at its own times after the hit. Where an MEP window meets these, the mean course is subtracted,
and as far as sizes outside the window tell those within it, the course of the size that the trial shows outside. How
much is left is known from how far each course is from what the others say, never from the trial's own amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from isiw.signals.limits import EMG_UNITS_MV
from isiw.signals.mep import EARLIEST_ONSET_MS, MEP_WINDOW_MS, TAP_MS, at_rest, disturbance
from isiw.signals.waveforms import PULSE_GUARD_MS, samples
from isiw.trials import Sweep, Trial, TrialTable
from isiw.types import BoolArray, FloatArray
from isiw.window import Window

STEP_MS: Final = 0.25
HIT_DELAY_MS, APART_MS = 180.0, 40.0
"""From the valve command to the hit, usually, and how far from that it may be."""

GRID_MS: Final = np.arange(-APART_MS, TAP_MS + APART_MS, STEP_MS)
LEAST_SHOWN: Final = 3
"""So many sweeps say what the tap does at a time after the hit; with fewer nobody knows how much it varies."""

ENOUGH_SHOWN, TAP_EVERY = 12, 4
"""With fewer sweeps that show a response within a window, every so many-th trial is one more tap alone."""

LONGER_MS: Final = 10.0
"""So much longer is an ISI than those whose MEP windows it is to show, as hits come some ms sooner or later."""

CLEAR: Final = 0.7
"""By this share, over the root of the number of sweeps, EMG after the hit is larger than at rest by chance at most."""

TINY: Final = 1e-12
USUAL_VARIANCE, USUAL_COUNTS = 0.43, 3.0
"""Relative variance of the response's size that is expected, that of a log SD of .6; it counts as so many sweeps."""

LEAST_WEIGHT: Final = 0.1
"""The least sum of squared sizes, with a mean of 1, that a course of a size of 1 is made of."""

LEAST_BOTH: Final = 6
"""So many sweeps say whether the response's size outside an MEP window tells that within: three agree by chance."""

TOGETHER_MS: Final = 2.5
"""EMG within so much time says the same of the response's size, as neighbouring samples rise and fall together."""

ARTEFACT_MS: Final = 5.0
"""So long after the pulse its artefact hides the response."""

SAME_MV, SAME_SHARE = 0.003, 0.1
"""What changes an amplitude by less is not worth a correction."""


class Left(NamedTuple):
    """What is left of the response in an amplitude: mean and SD [mV]; how many sweeps say so; what was subtracted."""

    mean_mv: float
    sd_mv: float
    shown: int
    course_mv: FloatArray


class _Shown(NamedTuple):
    """The EMG of one sweep after the hit at `GRID_MS`, between which times it shows it, and its size at rest.

    The size is the mean from peak to peak over the length of the MEP window; NaN if the rest is shorter.
    """

    course_mv: FloatArray
    from_ms: float
    until_ms: float
    rest_mv: float


class _MepWindow(NamedTuple):
    """A trial's MEP window: its EMG, its times after the hit, and the sweep that it is in."""

    emg_mv: FloatArray
    since_hit_ms: FloatArray
    over_ms: float  # when responses end after the hit
    course_mv: FloatArray  # the sweep's EMG at `GRID_MS`
    is_outside: BoolArray  # which of it can show neither an MEP nor the pulse's artefact
    told_by: int = 0  # on how many sweeps its amplitude rests


class _Subtracted(NamedTuple):
    """What is subtracted from a trial's MEP window, and from those of the sweeps that show it, if others say it."""

    course_mv: FloatArray
    others_mv: FloatArray
    variance: float  # what is left of the response's size, relative to its mean


@dataclass(frozen=True, eq=False)
class TapResponses:
    """What the sweeps of a session show of the tap alone, and the MEP windows of its trials."""

    mep_window_ms: tuple[float, float] = MEP_WINDOW_MS
    shown: tuple[_Shown, ...] = ()
    windows: Mapping[int, _MepWindow] = field(default_factory=dict)  # by the trial's number

    def after(self, trial: Trial, sweep: Sweep) -> TapResponses:
        """The same after one more trial; of TMS alone, and of a trial that was lost, nothing is learnt."""
        hit_ms = hit_of(trial)
        is_control = trial.commanded_isi_ms is None and not trial.tap_alone
        if hit_ms is None or is_control or "emg" not in sweep.channels:
            return self
        emg = sweep.channels["emg"]
        values = emg.values * EMG_UNITS_MV[emg.unit]
        times_ms = emg.t0_ms + np.arange(values.size) * 1000 / emg.rate_hz
        rest = at_rest(emg, trial) if trial.t_tms_ms is not None else times_ms < hit_ms - PULSE_GUARD_MS
        found = disturbance(values, emg.rate_hz, rest)
        values = values if found is None else values - found.course_mv
        values = values - np.median(values[rest]) if rest.any() else values
        shown, windows = self.shown, dict(self.windows)
        from_ms, ends_ms = times_ms[0] - hit_ms, times_ms[-1] - hit_ms
        course = np.interp(GRID_MS, times_ms - hit_ms, values)
        if trial.counts:
            until_ms = ends_ms if trial.t_tms_ms is None else trial.t_tms_ms - PULSE_GUARD_MS - hit_ms
            each = samples(self.mep_window_ms[1] - self.mep_window_ms[0], emg.rate_hz) + 1
            pieces = values[rest][rest.sum() % each :].reshape(-1, each)
            rest_mv = float(np.ptp(pieces, axis=-1).mean()) if pieces.size else math.nan
            shown = (*shown, _Shown(course, from_ms, until_ms, rest_mv))
        if trial.mep_mv is not None and trial.t_tms_ms is not None:
            first, last = (trial.t_tms_ms + edge for edge in self.mep_window_ms)
            within = (times_ms >= first - 1e-6) & (times_ms <= last + 1e-6)
            over_ms = float(GRID_MS[-1]) if trial.t_hit_ms is None else TAP_MS
            since_pulse = GRID_MS + hit_ms - trial.t_tms_ms
            outside = (since_pulse < -PULSE_GUARD_MS) | (since_pulse > self.mep_window_ms[1])
            outside |= (since_pulse > ARTEFACT_MS) & (since_pulse < EARLIEST_ONSET_MS)
            outside &= (from_ms <= GRID_MS) & (ends_ms >= GRID_MS)
            windows[trial.index] = _MepWindow(values[within], times_ms[within] - hit_ms, over_ms, course, outside)
        return replace(self, shown=shown, windows=windows)

    def measured(self, trial: Trial) -> Trial:
        """The trial with its amplitude without the tap's response, as far as that is known; else as it is."""
        window = self.windows.get(trial.index)
        left = None if window is None else self._left(window)
        if window is None or left is None or trial.mep_mv is None:
            return trial
        mep_mv = float(np.ptp(window.emg_mv - left.course_mv)) if left.mean_mv else trial.mep_mv
        return replace(trial, mep_mv=mep_mv, mep_sd_mv=left.sd_mv, tap_mv=left.mean_mv)

    def without(self, emg_mv: FloatArray, since_hit_ms: FloatArray) -> FloatArray:
        """Some EMG without the mean course, as far as it is known [mV], shape (w,)."""
        courses = np.array([one.course_mv for one in self.shown]).reshape(-1, GRID_MS.size)
        count = self._shows.sum(axis=0)
        mean_mv = np.where(count >= LEAST_SHOWN, (courses * self._shows).sum(axis=0) / np.maximum(count, 1), 0.0)
        return np.asarray(emg_mv - np.interp(since_hit_ms, GRID_MS, mean_mv, left=0.0, right=0.0))

    def corrected(self, trials: Iterable[Trial]) -> tuple[TapResponses, list[Trial]]:
        """The trials whose amplitudes are others by what is known now; each is looked at when twice as much is."""
        windows, found = dict(self.windows), []
        for trial in trials:
            window = windows.get(trial.index)
            if window is None or self._count(window.since_hit_ms) < 2 * window.told_by:
                continue
            left = self._left(window)
            if left is None or left.shown < 2 * window.told_by:
                continue
            windows[trial.index] = window._replace(told_by=left.shown)
            again = self.measured(trial)
            pairs = ((trial.mep_mv or 0.0, again.mep_mv or 0.0), (trial.tap_mv or 0.0, again.tap_mv or 0.0))
            differs = any(abs(new - old) > max(SAME_MV, SAME_SHARE * max(new, old)) for old, new in pairs)
            if trial.counts and differs:
                found.append(again)
        return replace(self, windows=windows), found

    def wants_taps(self, window: Window | None, trials: TrialTable) -> bool:
        """Whether a window rests on trials whose part of the tap's response few sweeps, or none, have shown."""
        if window is None or any(trial.tap_alone for trial in trials.trials[-TAP_EVERY + 1 :]):
            return False
        inside = (trial.index for trial in trials.told if trial.isi_ms is not None and is_inside(window, trial.isi_ms))
        own = (self.windows[number] for number in inside if number in self.windows)
        lefts = (self._left(each) for each in own if self._count(each.since_hit_ms) < ENOUGH_SHOWN)
        return any(left is None or left.mean_mv > 0 for left in lefts)

    def shown_from_ms(self, window: Window | None, trials: TrialTable) -> float | None:
        """From which ISI on a pair would show the response at all trials within a window; None if it is known there.

        Sweeps that begin too late, or have no rest, never show it: it is tried a few times only.
        """
        unknown_ms = [
            trial.isi_ms
            for trial in trials.told
            if window is not None and trial.isi_ms is not None and is_inside(window, trial.isi_ms)
            if (own := self.windows.get(trial.index)) is not None and not self._is_known(own)
        ]
        if not unknown_ms:
            return None
        least_ms = max(unknown_ms) + self.mep_window_ms[1] + LONGER_MS
        tried = sum(abs((trial.isi_ms or 0.0) - least_ms - LONGER_MS) <= LONGER_MS for trial in trials.told)
        return least_ms if tried < LEAST_SHOWN else None

    @cached_property
    def _spans_ms(self) -> FloatArray:
        """Between which times each sweep shows the EMG after the hit, shape (k, 2)."""
        return np.array([(one.from_ms, one.until_ms) for one in self.shown]).reshape(-1, 2)

    @property
    def _shows(self) -> BoolArray:
        """Which of `GRID_MS` each sweep shows, shape (k, g)."""
        return (self._spans_ms[:, :1] <= GRID_MS) & (self._spans_ms[:, 1:] >= GRID_MS)

    def _which(self, since_hit_ms: FloatArray) -> tuple[BoolArray, BoolArray]:
        """The times of `GRID_MS` that some times meet, and the sweeps that show all of these."""
        meets = (since_hit_ms[0] - STEP_MS <= GRID_MS) & (since_hit_ms[-1] + STEP_MS >= GRID_MS)
        times_ms = GRID_MS[meets]
        if not times_ms.size:
            return meets, np.ones(len(self.shown), dtype=bool)
        return meets, (self._spans_ms[:, 0] <= times_ms[0]) & (self._spans_ms[:, 1] >= times_ms[-1])

    def _count(self, since_hit_ms: FloatArray) -> int:
        """How many sweeps show some times."""
        return int(self._which(since_hit_ms)[1].sum())

    def _is_known(self, window: _MepWindow) -> bool:
        """Whether enough sweeps show what the tap does in a trial's MEP window, or that is outside the response."""
        if _is_outside(window):
            return True
        enough = self._count(window.since_hit_ms) >= LEAST_SHOWN
        return enough and not all(math.isnan(one.rest_mv) for one in self.shown)

    def _covering(self, since_hit_ms: FloatArray) -> tuple[BoolArray, FloatArray, BoolArray, float]:
        """What of `GRID_MS` some times meet; the courses that show these, what else they show, and their rest [mV]."""
        meets, which = self._which(since_hit_ms)
        waves, rests = np.array([one.course_mv for one in self.shown]), np.array([one.rest_mv for one in self.shown])
        rest_mv = float(np.nanmean(rests if np.isnan(rests[which]).all() else rests[which]))
        return meets, waves[which], self._shows[which], rest_mv

    def _left(self, window: _MepWindow) -> Left | None:
        """What subtracting the course leaves of the response in a trial's MEP window; None where unknown."""
        nothing = Left(0.0, 0.0, LEAST_SHOWN, np.zeros_like(window.since_hit_ms))
        if _is_outside(window):
            return nothing
        if not self._is_known(window):
            return None
        meets, waves, shows, rest = self._covering(window.since_hit_ms)
        within, count = waves[:, meets], len(waves)
        size, whole = float(np.ptp(within, axis=-1).mean()), float(np.ptp(within.mean(axis=0)))
        if size <= rest * (1 + CLEAR / math.sqrt(count)) and whole <= 2 * rest / math.sqrt(count):
            return nothing._replace(shown=count)
        found = _subtracted(window, waves, shows, meets, rest / math.sqrt(count))
        apart = np.ptp(within - found.others_mv, axis=-1)
        excess = max(0.0, float(apart.mean()) - rest * math.sqrt(count / (count - 1)))
        mean_share, sd_share = _left_of_varying_size(found.variance, count)
        course_mv = np.interp(window.since_hit_ms, GRID_MS[meets], found.course_mv)
        mean_mv = max(excess, math.hypot(whole * mean_share, rest) - rest)  # what is added to EMG at rest
        return Left(mean_mv, max(float(apart.std()), whole * sd_share), count, course_mv)


def _is_outside(window: _MepWindow) -> bool:
    """Whether the tap does nothing in a trial's MEP window: it is before the hit, or long after it."""
    return bool(window.since_hit_ms[-1] < 0 or window.since_hit_ms[0] > window.over_ms)


def _subtracted(
    window: _MepWindow, waves: FloatArray, shows: BoolArray, meets: BoolArray, clear_mv: float
) -> _Subtracted:
    """What is subtracted: the mean course, moved towards that of the size which is shown outside the window.

    By how much is fitted to the sweeps that show both, and to a few usual ones besides.
    """
    within, count = waves[:, meets], len(waves)
    mean, sizes = within.mean(axis=0), _sizes(within)
    others = (count * mean - within) / (count - 1)
    parts, weights = shows * sizes[:, None] * waves, shows * sizes[:, None] ** 2
    one = parts.sum(axis=0) / np.maximum(weights.sum(axis=0), LEAST_WEIGHT)
    seen = window.is_outside & (shows.sum(axis=0) >= LEAST_SHOWN) & (np.abs(one) > clear_mv)
    # A sweep says its size if it shows half as much of the response as the one that shows most.
    power = (seen & shows) @ one**2
    both = power > 0.5 * power.max()
    # How many independent pieces of EMG say the size: with one alone, the error of its fit is unknown.
    pieces = float(seen @ one**2) ** 2 / max(float(seen @ one**4), TINY) * STEP_MS / TOGETHER_MS
    if pieces <= 1 or both.sum() < LEAST_BOTH:
        return _Subtracted(mean, others, _variance(sizes - 1))
    without = (parts.sum(axis=0) - parts) / np.maximum(weights.sum(axis=0) - weights, LEAST_WEIGHT)
    outside = np.where(both, _sizes_shown(waves, without, seen & shows), 1.0)
    own = float(_sizes_shown(window.course_mv, one, seen))
    apart = seen * (one * (window.course_mv - own * one)) ** 2
    error = float(apart.sum() / (seen @ one**2) ** 2) * TOGETHER_MS / STEP_MS * pieces / (pieces - 1)
    # A ridge regression of sizes within on sizes outside, whose prior is that both are the same.
    usual, known = USUAL_COUNTS * USUAL_VARIANCE, both.sum() + USUAL_COUNTS
    products = usual + float((sizes - 1) @ (outside - 1))
    share = float(np.clip(products / (usual + ((outside - 1) ** 2).sum() + known * error), 0.0, 1.0))
    left = np.where(both, sizes - 1 - share * (outside - 1), (1 - share) * (sizes - 1))
    variance = _variance(left, (1 - share) ** 2)
    course = mean + share * (own * one[meets] - mean)
    others = others + share * (outside[:, None] * without[:, meets] - others)
    return _Subtracted(course, others, variance + share**2 * error)


def _sizes(waves: FloatArray) -> FloatArray:
    """The size of each response as a share of that of their mean course, shape (k,)."""
    mean = waves.mean(axis=0)
    centred = mean - mean.mean()
    return np.asarray(waves @ centred / max(float(centred @ centred), TINY))


def _sizes_shown(waves: FloatArray, unit: FloatArray, shown: BoolArray) -> FloatArray:
    """The size of responses of the course `unit` at the times that show them, shape (k,)."""
    power = (shown * unit**2).sum(axis=-1)
    return np.asarray((shown * unit * waves).sum(axis=-1) / np.maximum(power, TINY))


def _variance(left: FloatArray, usual_share: float = 1.0) -> float:
    """Relative variance of the response's size, from what is left of it in each sweep and of the usual variance."""
    usual = USUAL_COUNTS * USUAL_VARIANCE * usual_share
    return (usual + float((left**2).sum())) / (USUAL_COUNTS + len(left) - 1)


def _left_of_varying_size(variance: float, count: int) -> tuple[float, float]:
    """Mean and SD of what is left of a response of log-normal size without its mean, as shares of its mean size."""
    log_sd = math.sqrt(math.log1p(variance) * (1 + 2 / count))  # as the mean, too, is known from so few only
    left = 2 * math.erf(log_sd / math.sqrt(8))
    return left, math.sqrt(max(math.expm1(log_sd**2) - left**2, 0.0))


def hit_of(trial: Trial) -> float | None:
    """The hit, as it was measured or is to be expected [ms on the sweep's clock]; None without a time of the tap."""
    if trial.t_hit_ms is None and trial.t_valve_ms is not None:
        return trial.t_valve_ms + HIT_DELAY_MS
    return trial.t_hit_ms


ALONE_NEAR_MS: Final = 10.0
"""Taps alone speak for the ISIs around theirs, with weights of this SD [ms]."""

ALONE_SHARE, ALONE_COUNTS = 0.7, 2.0
"""SD of the tap's response from trial to trial as a share of its mean: that is expected, and counts as so many taps."""


class TapsAlone(NamedTuple):
    """The tap's own part of amplitudes near an ISI, as taps alone say whose amplitude was taken there [mV]."""

    mean_mv: float
    sd_mv: float  # from trial to trial
    taps: float  # so many say so, by their nearness

    @property
    def most_mv(self) -> float:
        """More is hardly the tap's: its mean, which few taps tell badly, and three SDs."""
        return self.mean_mv + 3.0 * self.sd_mv * math.sqrt(1.0 + 1.0 / self.taps)

    @property
    def log_sd(self) -> float:
        """SD of the mean as so few taps tell it, natural log."""
        return math.sqrt(math.log1p((self.sd_mv / self.mean_mv) ** 2 / self.taps)) if self.mean_mv > 0 else 0.0


def taps_near(taps: Sequence[tuple[float, float]], isi_ms: float, least_mv: float) -> TapsAlone | None:
    """The evidence of taps alone, ISIs [ms] and amplitudes [mV], near an ISI, above the least; None for too few."""
    isis_ms, sizes_mv = np.array(taps).T
    weights = np.exp(-0.5 * ((isis_ms - isi_ms) / ALONE_NEAR_MS) ** 2)
    count = float(weights.sum())
    if count < LEAST_WEIGHT:
        return None
    excess = sizes_mv - least_mv
    mean = float(weights @ excess) / count
    variance = float(weights @ (excess - mean) ** 2)
    sd_mv = math.sqrt((variance + ALONE_COUNTS * (ALONE_SHARE * mean) ** 2) / (count + ALONE_COUNTS))
    return TapsAlone(mean, sd_mv, count)


def meets_response(isi_ms: float, reference: str, mep_window_ms: tuple[float, float] = MEP_WINDOW_MS) -> bool:
    """Whether the MEP window at an ISI meets the time after the hit in which a tap may move the EMG."""
    from_hit_ms = isi_ms - (HIT_DELAY_MS if reference == "valve" else 0.0)
    return -mep_window_ms[1] <= from_hit_ms <= TAP_MS - mep_window_ms[0]


def taps_anywhere(sizes_mv: Sequence[float], least_mv: float) -> TapsAlone | None:
    """The same of taps alone whose amplitudes [mV] are the largest at any time; None for too few."""
    if len(sizes_mv) < LEAST_SHOWN:
        return None
    excess = np.asarray(sizes_mv) - least_mv
    return TapsAlone(float(excess.mean()), float(excess.std()), len(sizes_mv))


def is_inside(window: Window, isi_ms: float) -> bool:
    """Whether an ISI [ms] is within a segment of a window."""
    return any(start <= isi_ms <= end for start, end in window.segments)
