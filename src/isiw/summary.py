"""The words in which an estimate prints itself, and that too little is known for one; more is said in `sentences`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields
from typing import Final

from isiw.change import Change
from isiw.figures import Estimate
from isiw.findings import Finding, Kind, Severity
from isiw.text.stimuli import STIMULI, TAP, StimulusWords
from isiw.types import Conditioning

SURE = 0.95
"""Probability from which on it is said outright that there is a window, or none; below it "probably", or undecided."""

LEAST_FACTOR = 3.0
"""Bayes factor below which trials hardly speak for a window: "not worth more than a bare mention" [Kass1995]."""

JUDGED_SINCE: Final = "Trials were excluded or included after this estimate; isiw estimate LOG computes it again."

ENOUGH_PAIRS: Final = 3
"""With fewer pairs of stimuli nothing was found: rest, a response, and one of them again are the least."""

NO_MEP: Final = Finding(
    Kind.SILENT, Severity.NOTE, "No MEP was seen in any trial that counts, so nothing is known about a window"
)

TOO_FEW: Final = Finding(
    Kind.FEW_PAIRS, Severity.NOTE, "Fewer than three pairs of stimuli count so far, too few to speak of a window"
)

IN_DOUBT: Final = Finding(
    Kind.ISIS_FAR,
    Severity.DOUBT,
    "Realised ISIs were reported that are far from those that were asked for, so nothing is said about a window",
    "Until they are confirmed or excluded, these trials do not count.",
)


def lacking(pairs: int | None, *, silent: bool, in_doubt: bool = False) -> Finding | None:
    """The finding that too little was measured, or too doubtful, to speak of a window; None if enough was."""
    if in_doubt:
        return IN_DOUBT
    if silent:
        return NO_MEP
    return None if pairs is None or pairs >= ENOUGH_PAIRS else TOO_FEW


def rules_out(probability: float | None) -> bool:
    """True if nothing reported means that there is none; with more probability than this it is undecided."""
    return probability is None or 1 - probability >= SURE


def bayes_factor(probability: float | None, beforehand: float | None) -> float | None:
    """By what the trials multiplied the odds of a window; None if one of the probabilities is not known."""
    if probability is None or beforehand is None or not 0 < beforehand < 1:
        return None
    odds = math.inf if probability == 1 else probability / (1 - probability)
    return odds * (1 - beforehand) / beforehand


def edge_text(edge_ms: float) -> str:
    """An edge, or on which side of the range it lies."""
    if math.isinf(edge_ms):
        return "before the range" if edge_ms < 0 else "beyond the range"
    return f"{edge_ms:.0f} ms"


def words_of(stimuli: Iterable[Conditioning]) -> StimulusWords:
    """The words for all stimuli of some sessions; of none of them, those for the tap."""
    given = set(stimuli)
    several = [words for stimulus, words in STIMULI.items() if stimulus in given] or [TAP]
    joined = {
        field.name: " or ".join(dict.fromkeys(getattr(words, field.name) for words in several))
        for field in fields(StimulusWords)
        if field.name != "by_valve"
    }
    return StimulusWords(**joined, by_valve=any(words.by_valve for words in several))


_EITHER: Final = words_of(STIMULI)


def in_short(estimate: Estimate) -> str:
    """The reported window, or what there is in its place."""
    if estimate.window is not None or not estimate.has_answer:
        return str(estimate.window or "no answer yet")
    if estimate.probability is not None and estimate.probability >= 0.5:
        return "window not reported"
    return "no window" if rules_out(estimate.probability) and not law_is_doubted(estimate) else "undecided"


def is_guess(estimate: Estimate) -> bool:
    """True if a window is reported that the trials hardly speak for, or by a law that they speak against."""
    factor = bayes_factor(estimate.probability, estimate.beforehand)
    unsure = factor is not None and factor < LEAST_FACTOR and not is_sure(estimate)
    return estimate.window is not None and (unsure or law_is_doubted(estimate))


def law_is_doubted(estimate: Estimate) -> bool:
    """True if amplitudes speak against the law of responses, so that its answer is undecided."""
    return estimate.misfit is not None and estimate.misfit.of_law


def chance(estimate: Estimate) -> str:
    """The probability of a window and the Bayes factor, in brackets; empty if no probability is known."""
    if estimate.probability is None:
        return ""
    said, factor = "", bayes_factor(estimate.probability, estimate.beforehand)
    if factor is not None:
        size = "above 100" if factor > 100 else "below 0.01" if factor < 0.01 else f"{float(f'{factor:.2g}'):g}"
        said = f", Bayes factor {size}"
    of = "probability" if estimate.window is not None and not is_guess(estimate) else "probability of a window:"
    return f" ({of} {estimate.probability:.2f}{said})"


def summary(estimate: Estimate) -> str:
    """A window in a line, each of its edges in another where they are known, and where the MEP is depressed."""
    found, lead = in_short(estimate), "Undecided, if there is a window" if is_guess(estimate) else "Window"
    lines = [f"{found.capitalize() if estimate.window is None else f'{lead}: {found}'}{chance(estimate)}"]
    for name, edge in (("Start", estimate.start), ("End", estimate.end)):
        if estimate.window is not None and edge.low_ms is not None and edge.high_ms is not None:
            median = "" if edge.median_ms is None else edge_text(edge.median_ms)
            lines.append(f"{name}: {median}, 90 % interval {edge_text(edge.low_ms)} to {edge_text(edge.high_ms)}")
    if (depressed := estimate.depressed_probability) is not None:
        nothing = "nowhere" if rules_out(depressed) else "undecided"
        lines.append(f"Depressed: {estimate.depressed or nothing} (probability of it: {depressed:.2f})")
    if estimate.change is not None and estimate.change.is_sure:
        lines.append(f"{at_a_trial(estimate.change, estimate.change.trial)}.")
    return "\n".join((*lines, *filter(None, (misfit(estimate), tap_likely(estimate), tap_unmeasured(estimate)))))


def misfit(estimate: Estimate) -> str:
    """That amplitudes do not follow the law of responses, or that pulses given alone are of another level."""
    if law_is_doubted(estimate):
        wrong = "The MEPs vary otherwise than the law of responses expects, so that the window may be wrong."
        return f"{wrong} Look at the sweeps: are there artefacts, or pulses without a response?"
    if estimate.misfit is None or not estimate.misfit.of_curve:
        return ""
    fit = "The pulses given alone and the pairs do not fit each other: the window rests on the pairs."
    return f"{fit} Are muscle, coil, gain and the scale of intensities the same?"


def tap_likely(estimate: Estimate, first: StimulusWords = _EITHER) -> str:
    """That the first stimulus's own response is probably what is larger within a window, as it was measured there."""
    if not (estimate.tap_may_explain and estimate.tap_is_likely):
        return ""
    return (
        f"The {first.alone} evokes as much at these ISIs: the window is probably the muscle's response to the "
        f"{first.name} itself, and not the MEP."
    )


def tap_unmeasured(estimate: Estimate, first: StimulusWords = _EITHER) -> str:
    """The way to learn the first stimulus's own response within a window, if it was not measured."""
    if not estimate.tap_may_explain or estimate.tap_is_likely:
        return ""
    how = "[protocol] tap_alone, or tell(…, pulse=False)"
    return f"Deliver the {first.alone} at these ISIs too ({how}); the muscle may answer it."


def at_a_trial(change: Change, trial: int | None) -> str:
    """A change during the session, whatever the ISI, and its trial; without a full stop."""
    if change.trial == 0:
        return f"The pulses given before and this session do not fit each other: {_unlike_given(change)}"
    more = change.size > (0.0 if change.kind == "intensity" else 1.0)
    if change.kind == "intensity":
        sizes = f"{abs(change.size):.0f} % RMT {'higher' if more else 'lower'}"
        interval = f"90 % interval {change.low:+.0f} to {change.high:+.0f}"
        return f"From trial {trial} on MEPs are as if the intensity were {sizes} ({interval}), at all ISIs"
    sizes = f"×{change.size:.2g} (90 % interval ×{change.low:.2g} to ×{change.high:.2g})"
    if change.kind == "enhancement":
        word = "grown" if more else "faded"
        return f"The enhancement has {word} during the session, {sizes}; the window is that of now"
    return f"Amplitudes {'rose' if more else 'fell'} {sizes} at trial {trial}, at all ISIs"


def _unlike_given(change: Change) -> str:
    """By how much the trials of a session differ from those that were given before it; without a full stop."""
    if change.kind == "intensity":
        sizes = f"{abs(change.size):.0f} % RMT {'higher' if change.size > 0 else 'lower'}"
        interval = f"90 % interval {change.low:+.0f} to {change.high:+.0f}"
        return f"MEPs are as if the intensity were {sizes} ({interval})"
    return f"amplitudes are ×{change.size:.2g} now (90 % interval ×{change.low:.2g} to ×{change.high:.2g})"


def is_sure(estimate: Estimate) -> bool:
    """True if a reported window goes without saying "if there is one"."""
    return estimate.probability is None or estimate.probability >= SURE
