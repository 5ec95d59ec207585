"""What is learnt of the tap's response from sums over all sweeps, against the same worked out sweep by sweep."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from isiw.signals import judge, tap
from isiw.signals.courses import GRID_MS, STEP_MS, Courses, Span
from isiw.signals.tap import TapResponses
from isiw.signals.taps_alone import LEAST_WEIGHT
from isiw.subjects.changes import TapResponse
from isiw.sweeps import Sweep
from isiw.trials import Stimulus, Trial, TrialTable
from isiw.types import BoolArray, FloatArray
from isiw.window import Window
from tapped import IMPACT, TapRig, reflex

INSIDE = Window(10.0, 60.0)


def plainly(taps: TapResponses, trial: Trial, least: int = 0) -> tuple[int, float, float, float] | None:
    """How many sweeps say it, and amplitude, what is left, and its SD, by a look at each sweep; None if unknown.

    With fewer than the least nothing is worked out.
    """
    window = taps.windows.get(trial.index)
    if window is None or trial.mep_mv is None:
        return None
    if window.is_free:
        return None if least > 3 else (3, trial.mep_mv, 0.0, 0.0)
    since_ms = window.since_hit_ms
    met = (since_ms[0] - STEP_MS <= GRID_MS) & (since_ms[-1] + STEP_MS >= GRID_MS)
    places, courses = np.arange(GRID_MS.size), taps.courses
    shows = (courses.spans[:, :1] <= places) & (courses.spans[:, 1:] > places)
    which = shows[:, met].all(axis=-1)
    count, rests = int(which.sum()), courses.rests_mv
    if count < max(least, tap.LEAST_SHOWN) or np.isnan(rests).all():
        return None
    rest_mv = float(np.nanmean(rests if np.isnan(rests[which]).all() else rests[which]))
    waves, shows = courses.courses_mv[which], shows[which]
    mean = waves[:, met].mean(axis=0)
    size, whole = np.ptp(waves[:, met], axis=-1).mean(), np.ptp(mean)
    if size <= rest_mv * (1 + tap.CLEAR / math.sqrt(count)) and whole <= 2 * rest_mv / math.sqrt(count):
        return count, trial.mep_mv, 0.0, 0.0
    course, others, variance = plainly_subtracted(window.course_mv, window.is_outside, waves, shows, met,
                                                  rest_mv / math.sqrt(count))  # fmt: skip
    apart = np.array([np.ptp(wave[met] - other) for wave, other in zip(waves, others, strict=True)])
    log_sd = math.sqrt(math.log1p(variance) * (1 + 2 / count))
    mean_share = 2 * math.erf(log_sd / math.sqrt(8))
    sd_share = math.sqrt(max(math.expm1(log_sd**2) - mean_share**2, 0.0))
    excess = max(0.0, apart.mean() - rest_mv * math.sqrt(count / (count - 1)))
    left_mv = max(excess, math.hypot(whole * mean_share, rest_mv) - rest_mv)
    emg_mv = window.emg_mv - np.interp(since_ms, GRID_MS[met], course)
    return count, float(np.ptp(emg_mv)) if left_mv else trial.mep_mv, left_mv, max(apart.std(), whole * sd_share)


def plainly_subtracted(
    own_mv: FloatArray, outside: BoolArray, waves: FloatArray, shows: BoolArray, met: BoolArray, clear_mv: float
) -> tuple[FloatArray, list[FloatArray], float]:
    """The course that is subtracted, the same of each sweep as the others say it, and the sizes' variance."""
    count, mean = len(waves), waves[:, met].mean(axis=0)
    centred = mean - mean.mean()
    sizes = [float(wave[met] @ centred / (centred @ centred)) for wave in waves]
    parts = [size * shown * wave for size, shown, wave in zip(sizes, shows, waves, strict=True)]
    weights = [size**2 * shown for size, shown in zip(sizes, shows, strict=True)]
    one = sum(parts) / np.maximum(sum(weights), LEAST_WEIGHT)
    seen = outside & (shows.sum(axis=0) >= tap.LEAST_SHOWN) & (np.abs(one) > clear_mv)
    power = [float(((seen & shown) * one**2).sum()) for shown in shows]
    both = [each > 0.5 * max(power) for each in power]
    others = [(count * mean - wave[met]) / (count - 1) for wave in waves]
    pieces = (seen @ one**2) ** 2 / max(seen @ one**4, tap.TINY) * STEP_MS / tap.TOGETHER_MS
    usual = tap.USUAL_COUNTS * tap.USUAL_VARIANCE
    if pieces <= 1 or sum(both) < tap.LEAST_BOTH:
        apart = sum((size - 1) ** 2 for size in sizes)
        return mean, others, (usual + apart) / (tap.USUAL_COUNTS + count - 1)
    units = [(sum(parts) - part) / np.maximum(sum(weights) - weight, LEAST_WEIGHT)
             for part, weight in zip(parts, weights, strict=True)]  # fmt: skip
    shown = [size_shown(wave, unit, seen & at) for wave, unit, at in zip(waves, units, shows, strict=True)]
    larger = [size - 1 if is_both else 0.0 for size, is_both in zip(shown, both, strict=True)]
    own = size_shown(own_mv, one, seen)
    error = float((seen * (one * (own_mv - own * one)) ** 2).sum() / (seen @ one**2) ** 2)
    error *= tap.TOGETHER_MS / STEP_MS * pieces / (pieces - 1)
    products = usual + sum((size - 1) * each for size, each in zip(sizes, larger, strict=True))
    squares = usual + sum(each**2 for each in larger) + (sum(both) + tap.USUAL_COUNTS) * error
    share = min(max(products / squares, 0.0), 1.0)
    left = [size - 1 - share * each if is_both else (1 - share) * (size - 1)
            for size, each, is_both in zip(sizes, larger, both, strict=True)]  # fmt: skip
    variance = (usual * (1 - share) ** 2 + sum(each**2 for each in left)) / (tap.USUAL_COUNTS + count - 1)
    moved = [other + share * ((1 + each) * unit[met] - other)
             for other, each, unit in zip(others, larger, units, strict=True)]  # fmt: skip
    return mean + share * (own * one[met] - mean), moved, variance + share**2 * error


def size_shown(wave: FloatArray, unit: FloatArray, shown: BoolArray) -> float:
    return float((shown * unit * wave).sum() / max((shown * unit**2).sum(), tap.TINY))


@pytest.mark.parametrize(
    ("seed", "response"),
    [
        (0, reflex(0.3)),
        pytest.param(1, TapResponse(50.0, 50.0, 0.3, 0.5), marks=pytest.mark.slow),
        pytest.param(2, reflex(0.1, start_ms=60.0), marks=pytest.mark.slow),
        (3, None),
    ],
)
def test_sums_over_all_sweeps_come_to_what_a_look_at_each_sweep_does(seed: int, response: TapResponse | None) -> None:
    rng, rig = np.random.default_rng(seed), TapRig(response, seed=seed)
    taps, trials, shown = TapResponses(), TrialTable(), dict[int, int]()
    corrections = known = 0
    for number in range(50):
        isi_ms = None if (kind := rng.random()) < 0.2 else float(rng.integers(0, 250 if kind < 0.4 else 80))
        stimulus = Stimulus(number, isi_ms, tap_alone=isi_ms is None and kind < 0.15)  # else TMS alone
        rig.mep_mv = lambda _, draws: float(draws.gamma(2.0, 0.1))
        sweep = rig.deliver(stimulus)
        judged = judge(sweep, stimulus, IMPACT)
        judged = replace(judged, excluded=bool(rng.random() < 0.1))
        if rng.random() < 0.1:  # its waveforms are lost
            trials = trials.appended(judged)
            continue
        taps = taps.after(judged, sweep)
        trials = trials.appended(agree(taps, judged))
        taps, others = taps.corrected(trials)
        corrected, expected = {other.index: other for other in others}, set[int]()
        for trial in trials:
            if (found := plainly(taps, trial, 2 * shown.get(trial.index, 0))) is not None:
                shown[trial.index] = found[0]
                again, known = agree(taps, trial), known + 1
                pairs = ((trial.mep_mv or 0.0, again.mep_mv or 0.0), (trial.tap_mv or 0.0, again.tap_mv or 0.0))
                apart = [abs(new - old) > max(tap.SAME_MV, tap.SAME_SHARE * max(new, old)) for old, new in pairs]
                expected |= {trial.index} if trial.counts and any(apart) else set()
        assert set(corrected) == expected
        trials = TrialTable(tuple(corrected.get(trial.index, trial) for trial in trials))
        corrections += len(corrected)
    assert known > 40
    assert corrections or response is None


def agree(taps: TapResponses, trial: Trial) -> Trial:
    """The trial as it is measured, which is as a look at each sweep says."""
    measured, found = taps.measured(trial), plainly(taps, trial)
    if found is None:
        assert measured == trial
    else:
        assert (measured.mep_mv, measured.tap_mv, measured.mep_sd_mv) == pytest.approx(found[1:], rel=1e-9, abs=1e-12)
    return measured


def test_the_mean_course_is_that_of_the_sweeps_that_show_each_time() -> None:
    rig, emg_mv = TapRig(reflex(0.3)), np.random.default_rng(0).standard_normal(GRID_MS.size)
    rig.trials([310.0, 40.0, 90.0, 60.0, 250.0, 20.0])
    courses = rig.taps.courses
    shows = np.array([(first <= np.arange(GRID_MS.size)) & (np.arange(GRID_MS.size) < end)
                      for first, end in courses.spans])  # fmt: skip
    mean = [courses.courses_mv[shown, at].mean() if (shown := shows[:, at]).sum() >= 3 else 0.0
            for at in range(GRID_MS.size)]  # fmt: skip
    np.testing.assert_allclose(rig.taps.without(emg_mv, GRID_MS), emg_mv - mean, atol=1e-12)


def test_what_was_learnt_before_stays_as_it_was_when_two_go_on_from_there_with_other_sweeps() -> None:
    before = Courses.none().appended(np.ones(GRID_MS.size), Span(0, 10), 0.1)
    one, other = (before.appended(np.full(GRID_MS.size, value), Span(0, 20), 0.1) for value in (2.0, 3.0))
    assert [courses.courses_mv[:, 5].tolist() for courses in (before, one, other)] == [[1.0], [1.0, 2.0], [1.0, 3.0]]
    assert other.courses_mv[:, 15].tolist() == [0.0, 3.0]


@pytest.mark.slow
def test_a_trial_behind_1500_sweeps_costs_hardly_more_than_one_behind_100() -> None:
    rig, rng, trials = TapRig(reflex(0.3)), np.random.default_rng(0), TrialTable()
    drawn: list[tuple[Sweep, Trial]] = []  # of which the others are copies: to draw and to judge takes longer
    for number in range(150):
        isi_ms = None if number % 10 == 9 else float(rng.integers(0, 100))
        stimulus = Stimulus(number, isi_ms, tap_alone=isi_ms is None)
        sweep = rig.deliver(stimulus)
        drawn.append((sweep, judge(sweep, stimulus, IMPACT)))
    spent_s: list[float] = []
    for number in range(1500):
        sweep, judged = drawn[number % len(drawn)]
        judged = replace(judged, index=number)
        begun_s = time.process_time()
        rig.taps = rig.taps.after(judged, sweep)
        trials = trials.appended(rig.taps.measured(judged))
        rig.taps, _ = rig.taps.corrected(trials)
        rig.taps.wants_taps(INSIDE, trials)
        rig.taps.shown_from_ms(INSIDE, trials)
        spent_s.append(time.process_time() - begun_s)
    early, late = (np.median(spent_s[at - 60 : at]) for at in (100, 1500))
    assert late < 5 * early  # 14 times before
