"""Sentences about a result, for all who show one; each decides only its words, and is empty if it does not apply."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from isiw.design import DesignSpace
from isiw.excess import MIN_EXCESS_MV
from isiw.summary import SURE, chance, is_guess, is_sure, law_is_doubted, rules_out
from isiw.text.sanitize import counted
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Trial
from isiw.window import Window

if TYPE_CHECKING:  # an estimate prints itself in these words
    from isiw.figures import Edge, Estimate

WORTH_SAYING: Final = 0.1
"""Probability from which on an unusual window is mentioned."""

A_GUESS: Final = 0.5
"""Expected F1 below which the reported ISIs are a guess: most of them are as probably outside."""

MOST_OF_THE_RANGE: Final = 0.9
"""The share of the range from which on a sweep has covered it."""

UNUSUAL: Final = 0.9
"""Probability from which on a person is said to be unlike most."""

THRESHOLD_PCT_RMT: Final = 100.0
"""Above this intensity a pulse evokes an MEP that can be depressed."""

TOO_LITTLE: Final = "too little was measured"

_LOOK: Final = "Did the stimulator fire? Was the EMG recorded? Was the intensity high enough?"
_PLACED: Final = "Is the time of the pulse right? Does the MEP window fit the muscle?"
_CLOCKS: Final = "Do the clocks of the EMG and of the events drift apart, as those of two computers do?"


def interval_cell(edge: Edge) -> str:
    """The 90 % interval of an edge [ms] in a cell: < is before the range, and > beyond it; empty if not known."""
    if edge.low_ms is None or edge.high_ms is None:
        return ""
    if math.isinf(edge.low_ms) and edge.low_ms == edge.high_ms:
        return "<" if edge.low_ms < 0 else ">"
    low = "<" if math.isinf(edge.low_ms) else f"{edge.low_ms:.0f}"
    return f"{low}–{'>' if math.isinf(edge.high_ms) else f'{edge.high_ms:.0f}'}"


def _between(edge: Edge, space: DesignSpace) -> str:
    """The same in a sentence."""
    low, high = edge.low_ms or 0.0, edge.high_ms or 0.0
    if math.isinf(low) and math.isinf(high):
        return f"before {space.low_ms:g} ms" if low < 0 else f"after {space.high_ms:g} ms"
    if math.isinf(low):
        return f"before {high:.0f} ms"
    return f"after {low:.0f} ms" if math.isinf(high) else f"{low:.0f}–{high:.0f} ms"


def finding(estimate: Estimate, first: StimulusWords, space: DesignSpace) -> str:
    """The reported window, or none."""
    window, probability = estimate.window, estimate.probability
    after = f"after the {first.origin(space.reference)}"
    if probability is None:
        return _without_probability(estimate, first, after, space)
    probably = chance(estimate)
    undecided = f"It is undecided whether there is a window{probably}"
    if window is None:
        found = rules_out(probability) and not law_is_doubted(estimate)
        return f"No window was found{probably}." if found else f"{undecided}."
    if is_guess(estimate):
        return f"{undecided}; the best guess is {window} {after}."
    enhances = f"The {first.name} {'' if probability >= SURE else 'probably '}enhances the MEP"
    isis = f"{window} {after}{probably}"
    if estimate.expected_f1 is not None and estimate.expected_f1 < A_GUESS:
        return f"{enhances}, but at which ISIs is not known well; the best guess is {isis}."
    return f"{enhances} at ISIs of {isis}."


def _without_probability(estimate: Estimate, first: StimulusWords, after: str, space: DesignSpace) -> str:
    """The same, of a method that gives none."""
    if estimate.window is not None:
        isis = f"{estimate.window} {after}"
        return f"By this method, which gives no probability, the {first.name} enhances the MEP at ISIs of {isis}."
    if not estimate.has_answer:
        return "The method has no answer yet: it has not measured enough for one."
    if is_unfinished(estimate, space):
        so_far = f"{estimate.grid_ms[0]:g}–{estimate.grid_ms[-1]:g} ms"
        scan = f"The scan of ISIs is not finished: of {space.low_ms:g}–{space.high_ms:g} ms it has measured {so_far}"
        return f"{scan}, where the MEP is not enhanced."
    return "No window was found."


def is_unfinished(estimate: Estimate, space: DesignSpace) -> bool:
    """True if a scan of ISIs has reported nothing, and has not come to the end of the range yet."""
    grid_ms = estimate.grid_ms
    if estimate.window is not None or estimate.probability is not None or grid_ms is None or not len(grid_ms):
        return False
    return grid_ms[-1] - grid_ms[0] < MOST_OF_THE_RANGE * (space.high_ms - space.low_ms)


def edges(estimate: Estimate, space: DesignSpace) -> str:
    """Between which ISIs a reported window starts and ends, and what is unusual about that."""
    start, end = estimate.start, estimate.end
    if estimate.window is None or not (start.is_known and end.is_known):
        return ""
    given = "Start" if is_sure(estimate) else "If there is a window, start"
    said = f"{given} {_between(start, space)}, end {_between(end, space)} (90 % each)."
    unusual = {
        "starts before the range": start.beyond,
        "ends beyond the range": end.beyond,
        "has more than one segment": estimate.split,
    }
    more = [f"{what} with probability {p:.2f}" for what, p in unusual.items() if p is not None and p >= WORTH_SAYING]
    it = "It" if is_sure(estimate) else "Given a window, it"
    return f"{said} {it} {' and '.join(more)}." if more else said


def best_isi(estimate: Estimate) -> str:
    """At which ISI the largest MEP is expected, given a reported window."""
    best = estimate.best_isi
    if estimate.window is None or best is None:
        return ""
    largest = "Largest" if is_sure(estimate) else "Given a window, largest"
    return f"{largest} MEP at {best.isi_ms:.0f} ms (90 %: {best.low_ms:.0f}–{best.high_ms:.0f} ms)."


def excluded(estimate: Estimate) -> str:
    """Which enhancement is excluded if no window is reported."""
    if estimate.window is not None or estimate.excluded_mv is None:
        return ""
    # Less is no window, and says nothing of the input: below the threshold it can shift without any MEP.
    told = estimate.excluded_pct_rmt is not None and estimate.excluded_mv > MIN_EXCESS_MV
    share = f" ({_figure(estimate.excluded_pct_rmt or 0.0)} % of RMT)" if told else ""
    enhancement = f"An enhancement of more than {_figure(1e3 * max(estimate.excluded_mv, MIN_EXCESS_MV))} µV{share}"
    return f"{enhancement} is excluded with 90 % probability."


def _figure(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def expected_f1(estimate: Estimate) -> str:
    """The expected F1 of the reported decision."""
    f1 = estimate.expected_f1
    return "" if f1 is None else f"Expected F1: {f1:.2f} (1: exact)."


def unusual(estimate: Estimate) -> str:
    """In what a person is unlike most."""
    said = [f"{what} (probability {p:.2f})" for what, p in estimate.unusual.items() if p >= UNUSUAL]
    return f"This person is unlike most in {', '.join(said)}." if said else ""


def depression(estimate: Estimate, stimulus: str, intensity_pct: float | None) -> str:
    """Where the MEP is depressed, or that the strategy does not look for it above the motor threshold."""
    if (probability := estimate.depressed_probability) is not None:
        chance = f" (probability that it does so anywhere: {probability:.2f})"
        if estimate.depressed is not None:
            likely = "" if probability >= SURE else "probably "
            return f"The {stimulus} {likely}depresses the MEP at ISIs of {estimate.depressed}{chance}."
        if rules_out(probability):
            return f"No ISIs were found at which the {stimulus} depresses the MEP{chance}."
        return f"It is undecided whether the {stimulus} depresses the MEP at any ISI{chance}."
    if intensity_pct is None or intensity_pct <= THRESHOLD_PCT_RMT:
        return ""
    return (
        f"This strategy looks for enhancement alone. At {intensity_pct:g} % of RMT the {stimulus} may depress "
        "the MEP too: the strategy supra-threshold looks for both."
    )


def nothing_estimated(completed: int, given: int, *, damaged: bool) -> str:
    """That there is no readable estimate: "nothing was done" only if nothing was."""
    damage = ", and the log is damaged" if damaged else ""
    pulses = f"{counted(given, 'pulse was', 'pulses were')} given, or may have been"
    if completed:
        return f"No estimate can be read{damage}: {pulses}, {counted(completed, 'has', 'have')} an outcome."
    if given:
        return f"No outcome can be read{damage}: {pulses}, none has an outcome."
    return f"No trial can be read{damage}." if damaged else "No trial has been completed."


def all_silent(told: int, found: str) -> str:
    """That no MEP was seen in any trial."""
    return f"{found}. The amplitudes of all {told} trials that count are 0. {_LOOK}"


def few_pairs(pairs: int, given: int) -> str:
    """That some trials count, and too few pairs of stimuli."""
    count = counted(pairs, "pair of stimuli counts", "pairs of stimuli count")
    return f"Too little was measured to speak of a window: {count}, of {given} trials."


def all_lost(reasons: Mapping[str, int], given: int, background_uv: float | None) -> str:
    """That no trial counts, and why."""
    if not reasons:
        return f"Nothing was measured: none of {given} trials counts."
    why = ", ".join(f"{count} {reason}" for reason, count in reasons.items())
    if background_uv is not None:
        level = f"{background_uv / 1000:.2g} mV" if background_uv >= 1000 else f"{background_uv:.2g} µV"
        why += f"; background EMG {level} RMS"
    return f"Nothing was measured: {sum(reasons.values())} of {given} trials were rejected ({why})."


def not_larger(medians_uv: tuple[float, float], p: float | None = None) -> str:
    """That the MEPs inside a reported window are no larger than those outside, or with a p-value not clearly so."""
    medians = f"medians {medians_uv[0]:.0f} and {medians_uv[1]:.0f} µV"
    if p is not None:
        hardly = "The data support this only weakly: the MEPs inside are not clearly larger than those outside"
        return f"{hardly} ({medians}, p = {p:.2f})."
    said = f" ({medians})" if medians_uv[0] <= medians_uv[1] else ""
    return f"The data do not bear this out: the MEPs inside are no larger than those outside{said}."


def changed(word: str, p: float) -> str:
    """That amplitudes "grew" or "shrank" from trial to trial, whatever the ISI."""
    return (
        f"The amplitudes {word} during the session by more than the ISIs explain (Kendall's test among near ISIs, "
        f"p = {p:.1g}), and a window may be due to that. Was the intensity changed, did the coil move, or did "
        "the person tire?"
    )


def at_rest(window_ms: tuple[float, float] | None, since: int | None) -> str:
    """That no MEP was larger than EMG at rest, or none since a trial; `window_ms` is where it was sought."""
    sought = f"in the MEP window, {window_ms[0]:g}–{window_ms[1]:g} ms after the pulse," if window_ms else ""
    emg = f"the EMG {sought or 'after the pulse'}"
    look = f"{_LOOK} {_PLACED}" if window_ms else _LOOK
    look = f"{look} {_CLOCKS}" if window_ms and since is not None else look
    seen = f"In no trial was {emg}" if since is None else f"From trial {since} on, {emg} was never"
    return f"{seen} larger than at rest. {look}"


def few_outside(outside: int, pairs: int, alone: int) -> str:
    """That hardly a trial shows the MEP outside a reported window."""
    measured = f"{outside} of {pairs} pairs outside the window, {counted(alone, 'pulse')} of TMS alone"
    remedy = "add TMS alone next time ([protocol] tms_alone), or widen the range of ISIs"
    return f"The baseline is poorly measured ({measured}): {remedy}."


def truth(true: Window | None, found: Window | None, f1: float | None) -> str:
    """Agreement of the reported window with a simulated person's true one; `f1` is None if nothing was found out."""
    said = f"This simulated person in fact has {'no window' if true is None else f'the window {true}'}"
    if f1 is None:
        return f"{said}."
    share = f"none was reported (F1 {f1:.2f})" if found is None else f"the F1 of the reported one is {f1:.2f}"
    return f"{said}; {share}."


def moved(probability: float | None, before: float) -> str:
    """The probability that a window moved more than it does from day to day."""
    if probability is None:
        return ""
    chance = f"{100 * probability:.0f} % ({100 * before:.0f} % without data)"
    return f"the probability that the window moved by more than the usual shift from day to day is {chance};"


def later(starts_later: float | None, ends_later: float | None) -> str:
    """The probabilities that a window starts later, and ends later, than another one."""
    if starts_later is None or ends_later is None:
        return ""
    chances = starts_later, ends_later
    start, end = (f"{'later' if p >= 0.5 else 'earlier'} ({100 * max(p, 1 - p):.0f} %)" for p in chances)
    return f"the window probably starts {start} and ends {end}; 50 % means unknown."


def asked(trial: Trial, first: StimulusWords = TAP) -> str:
    """The ISI of a trial as it was asked, or the name of a control trial."""
    if trial.commanded_isi_ms is not None:
        return f"{trial.commanded_isi_ms:.4g} ms"
    if trial.tap_alone:
        return first.alone
    return "TMS alone" if trial.is_control else "–"


def outcome(trial: Trial) -> str:
    """The outcome of a trial."""
    if trial.reason is not None:
        return f"mistrial: {trial.reason}"
    text = "–" if trial.mep_mv is None else f"{1e3 * trial.mep_mv:.0f} µV"
    if trial.mep_interval_mv is not None:
        low_uv, high_uv = (1e3 * end_mv for end_mv in trial.mep_interval_mv)
        text = f"above {low_uv:.0f} µV" if math.isinf(high_uv) else f"{low_uv:.0f}–{high_uv:.0f} µV"
    text += "" if trial.intensity_pct_rmt is None else f" at {trial.intensity_pct_rmt:g} %"
    return f"{text} (excluded)" if trial.excluded else text
