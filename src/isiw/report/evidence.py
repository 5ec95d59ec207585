"""The evidence of the trials themselves for a finding: that nothing was measured, or that they do not bear it out."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np

from isiw import sentences
from isiw.log.record import SessionRecord
from isiw.signals.plausible import counted_of, stopped_after
from isiw.summary import IN_DOUBT, NO_MEP
from isiw.trials import Trial
from isiw.types import ArrayLike, FloatArray, IntArray
from isiw.window import Window

ENOUGH_ON_EACH_SIDE = 4
NOT_CLEARLY = 0.05
"""From this p-value of a one-sided rank test on, MEPs are not clearly larger, which is said where the method itself
says nothing of its certainty. From one half on they are not larger at all."""

BY_CHANCE: Final = 0.0035
"""A change with time is said below this p-value in either direction, which is 2.7 standard errors."""

NEAR_MS: Final = 15.0
"""Pairs of trials tell of a change with weights by the distance of their ISIs, of this SD [ms]."""

LEAST_MV: Final = 0.001
"""Amplitudes below are not told apart [mV]."""

MOST_COMPARED: Final = 100
"""Of more trials than this, each is compared with every second, third … one: a page tests the trials before each
estimate anew, so that comparing all pairs would cost the cube of their number."""

Expected: TypeAlias = tuple[Sequence[float], Sequence[float]]
"""ISIs [ms], and the MEP that is expected at each [mV]."""

ENOUGH_TO_STAND_OUT = 10


def nothing_measured(record: SessionRecord) -> str | None:
    """That too little was measured to speak of a window, and why; None if there was enough."""
    if record.rests_on_data:
        return None
    if record.in_doubt:
        return f"{IN_DOUBT}"
    given, told = record.given, len(record.table.told)
    if record.is_silent:
        return sentences.all_silent(told + len(record.header.earlier), NO_MEP.text)
    if told:
        return sentences.few_pairs(record.pairs, given)
    lost = [trial for trial in record.table if trial.reason is not None]
    levels_uv = [trial.background_rms_uv for trial in lost if trial.background_rms_uv is not None]
    usual_uv = statistics.median(levels_uv) if levels_uv else None
    return sentences.all_lost(Counter(str(trial.reason) for trial in lost), given, usual_uv)


def contradiction(window: Window | None, trials: Sequence[Trial], *, without_probability: bool = False) -> str | None:
    """That the MEPs inside a reported window are no larger than those outside; None if they are, or are too few."""
    if window is None:
        return None
    inside, outside = _inside_and_outside(window, trials)
    if min(len(inside), len(outside)) < ENOUGH_ON_EACH_SIDE:
        return None
    p = p_of_larger(inside, outside)
    medians_uv = 1e3 * statistics.median(inside), 1e3 * statistics.median(outside)
    if p >= 0.5:
        return sentences.not_larger(medians_uv)
    return sentences.not_larger(medians_uv, p) if without_probability and p >= NOT_CLEARLY else None


def p_of_larger(inside: Sequence[float], outside: Sequence[float]) -> float:
    """The p-value of a one-sided Mann-Whitney test, by its normal approximation (SciPy takes a second to import)."""
    count, pairs = len(inside) + len(outside), len(inside) * len(outside)
    tied = _tied([*inside, *outside])
    error = math.sqrt(pairs / 12 * (count + 1 - float((tied**3 - tied).sum()) / (count * (count - 1))))
    ordered = np.sort(outside)
    smaller, up_to = np.searchsorted(ordered, inside).sum(), np.searchsorted(ordered, inside, "right").sum()
    above_mean = float(smaller + up_to - pairs) / 2
    return _beyond((above_mean - 0.5) / error) if error else 1.0


def changed_with_time(window: Window | None, trials: Sequence[Trial], expected: Expected | None = None) -> str | None:
    """That amplitudes grew or shrank from trial to trial, whatever the ISI; None if they did not clearly.

    A window can be found in that alone, as ISIs are not asked in random order: from the middle of a window they move to
    its edges. So amplitudes are set against those that are expected at their ISIs, and among near ISIs alone.

    Args:
        window: the reported window.
        trials: the trials that count, in their order.
        expected: ISIs [ms] and the MEP that is expected at each [mV], if the method has them.
    """
    if window is None:
        return None
    strata = _inside_and_outside(window, trials)
    if min(len(set(meps_mv)) for meps_mv in strata) < ENOUGH_ON_EACH_SIDE:
        return None
    isi_ms, mep_mv = np.array(_placed(trials)).T
    usual_mv = None if expected is None else np.interp(isi_ms, *np.asarray(expected))
    found = growth(mep_mv, usual_mv, isi_ms)
    p = _beyond(abs(found))
    return sentences.changed("grew" if found > 0 else "shrank", p) if p < BY_CHANCE else None


def growth(meps_mv: ArrayLike, usual_mv: ArrayLike | None = None, isis_ms: ArrayLike = 0.0) -> float:
    """Kendall's statistic of amplitude against order [standard errors], where pairs of trials at near ISIs count most.

    Its variance, without any growth, is that of its projection on single trials and of what is left, a third of the
    squared weights each; of equal weights that is Kendall's own. Ties lower it by their share of all triples.

    Args:
        meps_mv: amplitudes in their order [mV], shape (n,).
        usual_mv: what is usual at their ISIs [mV], shape (n,), which they are divided by; None if not known.
        isis_ms: their ISIs [ms], shape (n,); of one ISI, all pairs count alike.
    """
    sizes = scaled = np.asarray(meps_mv, float)
    if usual_mv is not None:
        scaled = np.maximum(sizes, LEAST_MV) / np.maximum(usual_mv, LEAST_MV)
    n = sizes.size
    isi_ms = np.broadcast_to(np.asarray(isis_ms, float), n)
    earlier, later = _compared(n)
    weights = np.exp(-0.5 * ((isi_ms[later] - isi_ms[earlier]) / NEAR_MS) ** 2)
    of_trials = np.bincount(earlier, weights, n) - np.bincount(later, weights, n)
    rises = np.sign(scaled[later] - scaled[earlier]) * (sizes[later] != sizes[earlier])
    tied = _tied(scaled)
    untied = 1.0 - float((tied**3 - tied).sum()) / (n**3 - n)
    variance = untied * float(of_trials @ of_trials + weights @ weights) / 3
    return float(weights @ rises) / math.sqrt(variance) if variance > 0 else 0.0


def _compared(n: int) -> tuple[IntArray, IntArray]:
    """The numbers of the earlier and of the later trial of all pairs that are compared."""
    apart = -(-n // MOST_COMPARED)
    first, second = np.triu_indices(-(-n // apart), 1)
    of_class = np.arange(apart)[:, np.newaxis]
    earlier, later = ((apart * place + of_class).ravel() for place in (first, second))
    return earlier[later < n], later[later < n]


def _tied(values: ArrayLike) -> FloatArray:
    """The number of times that each of the values is there."""
    return np.unique(values, return_counts=True)[1].astype(float)


def _beyond(standard_errors: float) -> float:
    return statistics.NormalDist().cdf(-standard_errors)


def nothing_stood_out(trials: Sequence[Trial], window_ms: tuple[float, float] | None = None) -> str | None:
    """That no MEP was larger than EMG at rest, or none any more; None if some were, or too few trials say so.

    A muscle that the pulse alone does not reach looks like this, and so do a stimulator that does not fire and an MEP
    outside the window that it is sought in.
    """
    of_pairs = [trial for trial in trials if trial.intensity_pct_rmt is None]
    known = [trial for trial in of_pairs if trial.mep_mv is not None and trial.background_rms_uv]
    stood_out = [one.stands_out for one in counted_of(known)]
    if len(known) >= ENOUGH_TO_STAND_OUT and not any(stood_out):
        return sentences.at_rest(window_ms, None)
    first = stopped_after([trial.isi_ms for trial in known], stood_out)
    return None if first is None else sentences.at_rest(window_ms, known[first].index)


def no_comparison(window: Window | None, trials: Sequence[Trial]) -> str | None:
    """That hardly a trial shows the MEP outside a reported window; None if some do, or few are inside."""
    if window is None:
        return None
    inside, outside = _inside_and_outside(window, trials)
    alone = sum(trial.isi_ms is None for trial in trials)
    if len(inside) < ENOUGH_ON_EACH_SIDE or len(outside) + alone >= ENOUGH_ON_EACH_SIDE:
        return None
    return sentences.few_outside(len(outside), len(outside) + len(inside), alone)


def _placed(trials: Sequence[Trial]) -> list[tuple[float, float]]:
    """ISI [ms] and MEP [mV] of the pairs of the usual intensity among some trials."""
    usual = [trial for trial in trials if trial.intensity_pct_rmt is None]
    return [(t.isi_ms, t.mep_mv) for t in usual if t.isi_ms is not None and t.mep_mv is not None]


def _inside_and_outside(window: Window, trials: Sequence[Trial]) -> tuple[list[float], list[float]]:
    """The MEPs of pairs inside and outside a window [mV]."""
    placed = _placed(trials)
    is_inside = window.mask([isi_ms for isi_ms, _ in placed])
    inside = [mep_mv for (_, mep_mv), within in zip(placed, is_inside, strict=True) if within]
    outside = [mep_mv for (_, mep_mv), within in zip(placed, is_inside, strict=True) if not within]
    return inside, outside
