"""Short answers to the questions that people ask of a session first, and three methods' answers from its trials."""

from __future__ import annotations

import itertools
import math
import statistics
from collections import Counter
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from isiw import sentences
from isiw.dissertation.profiles import best_fit, normality, profile_fits
from isiw.dissertation.regression import curve_masks
from isiw.dissertation.response_counts import TrialsByIsi, by_isi, count_trials, measured_profile
from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.log.record import SessionRecord
from isiw.log.schema import EstimateRecord, Event, EventKind
from isiw.report.tables import lost_rows
from isiw.report.words import counts_sentence
from isiw.signals.judgement import contradicts_its_times, timed_isi_ms
from isiw.text.sanitize import counted
from isiw.trials import Trial
from isiw.types import FloatArray
from isiw.window import Window

_OF_TIMING: Final = frozenset({Kind.NO_IMPACT, Kind.NO_PULSE, Kind.TMS_BEFORE_IMPACT, Kind.ISI_OFF})
MOST_NAMED: Final = 8
"""Lost trials that are named one by one."""

_ROUNDING_MS: Final = 1e-6
"""Differences of two times are off by less, if they are equal."""

_ENDING: Final[frozenset[EventKind]] = frozenset({"limit", "refused", "fault", "pause", "doubt"})


class Answer(NamedTuple):
    """A question, its answer in a few words, and what that rests on."""

    question: str
    answer: str
    detail: str


def answers(record: SessionRecord) -> list[Answer]:
    """Which trials were lost, whether timing was right, whether the muscle was at rest, and why the session stopped."""
    lost = [number for number, *_ in lost_rows(record)]
    answer = f"{len(lost)} of {record.given}: {_few(lost)}" if lost else "none"
    first = Answer("Which trials were lost, and why?", answer, counts_sentence(record))
    return [first, _timing(record), _rest(record), _stopped(record)]


def _few(numbers: Sequence[object]) -> str:
    """The first of these trials by their numbers, and how many more there are."""
    named = ", ".join(str(number) for number in numbers[:MOST_NAMED])
    more = f" and {len(numbers) - MOST_NAMED} more" if len(numbers) > MOST_NAMED else ""
    return f"{'trial' if len(numbers) == 1 else 'trials'} {named}{more}"


def _timing(record: SessionRecord) -> Answer:
    question, space = "Was the timing right?", record.header.space
    errors_ms = [abs(trial.isi_error_ms) for trial in record.table.told if trial.isi_error_ms is not None]
    rejected = _rejected_for(record, _OF_TIMING)
    unknown = _verdict(record, len(rejected), 0)
    if not errors_ms:
        return Answer(question, unknown, f"No trial that counts has a realised ISI. {_listed(rejected)}")
    if record.header.imported and max(errors_ms) < _ROUNDING_MS:
        detail = "No ISI was commanded that the realised one could be compared with: the file says none."
        return Answer(question, unknown, f"{detail} {_listed(rejected)}")
    confirmed = [timed_isi_ms(trial, space) is not None for trial in record.table]
    if not any(errors_ms) and not any(confirmed):
        times = f"{record.header.stimulus.pulse} or {record.header.stimulus.hit} time"
        detail = f"The device reports every ISI exactly as commanded, and no {times} to check it against."
        answer = unknown if rejected else "not known: exactly 0 off in all trials"
        return Answer(question, answer, f"{detail} {_listed(rejected)}")
    tolerance_ms = record.header.signals.tolerance_ms(space)
    sizes = f"{statistics.median(errors_ms):.1f} ms (median), at most {max(errors_ms):.1f} ms"
    others = _not_for(record, _OF_TIMING)
    contradicted = [trial.index for trial in others if contradicts_its_times(trial, space)]
    off = sum(abs(trial.isi_error_ms or 0.0) > tolerance_ms or trial.index in contradicted for trial in others)
    exactly = "Exactly 0 off in all trials that count, as of a rig that reports its command"
    off_by = f"Trials that count are off by {sizes}" if any(errors_ms) else exactly
    detail = f"{off_by}; {tolerance_ms:g} ms are tolerated. {_listed(rejected)}"
    if contradicted:
        detail += f" The times of {_events(record)} contradict the ISI in {_few(contradicted)}."
    return Answer(question, _verdict(record, len(rejected) + off, _known(record, measured=any(errors_ms))), detail)


def _events(record: SessionRecord) -> str:
    """The two events between which ISIs are, in words."""
    first, reference = record.header.stimulus, record.header.space.reference
    return f"{first.pulse} and {first.moment if reference == 'impact' else reference}"


def _known(record: SessionRecord, *, measured: bool) -> int:
    """Of how many trials it is known when the pulse came; if no ISI was measured, by the trial's times alone."""
    return sum(
        trial.commanded_isi_ms is None
        or (trial.isi_ms is not None and (measured or timed_isi_ms(trial, record.header.space) is not None))
        for trial in record.table
    )


def _rest(record: SessionRecord) -> Answer:
    limit_uv = record.header.signals.most_background_uv
    contracted = math.isinf(limit_uv)
    question = "How contracted was the muscle?" if contracted else "Was the muscle at rest?"
    levels_uv = [t.background_rms_uv for t in record.table if t.background_rms_uv is not None]
    reasons = frozenset({Kind.BACKGROUND_ACTIVITY})
    rejected = _rejected_for(record, reasons)
    tense = sum((trial.background_rms_uv or 0.0) > limit_uv for trial in _not_for(record, reasons))
    verdict = _verdict(record, len(rejected) + tense, len(levels_uv))
    if not levels_uv:
        return Answer(question, verdict, f"The log has no background EMG. {_listed(rejected)}")
    sizes = f"{statistics.median(levels_uv):.2g} µV RMS (median), at most {max(levels_uv):.2g} µV"
    allowed = "the muscle was to be contracted" if contracted else f"{limit_uv:g} µV are allowed"
    return Answer(question, verdict, f"EMG before the pulse: {sizes}; {allowed}. {_listed(rejected)}")


def _rejected_for(record: SessionRecord, reasons: frozenset[Kind]) -> list[str]:
    """Why trials were rejected, one entry each, for any of some reasons; those that an operator accepted too."""
    lost = [str(trial.reason) for trial in record.table if trial.reason in reasons]
    overruled = [f"{t.overruled}, accepted by the operator" for t in record.table if t.overruled in reasons]
    return lost + overruled


def _not_for(record: SessionRecord, reasons: frozenset[Kind]) -> list[Trial]:
    """The trials that count, or were rejected for other reasons: of those too it is known whether this was right."""
    return [trial for trial in record.table if trial.reason not in reasons and trial.overruled not in reasons]


def _verdict(record: SessionRecord, wrong: int, known: int) -> str:
    """The verdict on all trials, as far as is known."""
    given = record.given
    if wrong:
        return f"not in {wrong} of {given} trials"
    if not known:
        return "not known"
    return "yes" if known == given else f"yes, in all trials that show it ({known} of {given})"


def _listed(rejected: list[str]) -> str:
    listed = ", ".join(f"{count} {reason}" for reason, count in Counter(rejected).items())
    return f"Rejected for this: {listed}." if rejected else "No trial was rejected for this."


def _stopped(record: SessionRecord) -> Answer:
    question = "Why did it stop?"
    since = itertools.takewhile(lambda entry: not isinstance(entry, EstimateRecord), reversed(record.history))
    events = (entry for entry in since if isinstance(entry, Event))
    decision, ending = record.decision, next((event.text for event in events if event.kind in _ENDING), "")
    if decision is None:
        return Answer(question, "before the first estimate", ending)
    if decision.stop:
        return Answer(question, decision.reason or "it ended", ending)
    answer = "it has not stopped" if not ending else "it was interrupted"
    return Answer(question, answer, f"{ending} {decision.reason}".strip())


USUAL_TRIALS: Final = 10
"""Trials at each ISI that the dissertation takes means of [Kim2020, 4.2.1]."""


class MethodAnswer(NamedTuple):
    """A method's answer about a window, what it needs for that, and what it cannot say."""

    method: str
    answer: str
    needs: str
    cannot: str


def method_answers(record: SessionRecord) -> list[MethodAnswer]:
    """The estimate of isiw, the dissertation's rule on mean MEPs, response counts, and the form of the profile."""
    trials, last, space = by_isi(record.table), record.estimates[-1], record.header.space
    estimate = MethodAnswer(
        "isiw's estimate",
        f"{sentences.finding(last, record.header.stimulus, space)} {sentences.edges(last, space)}".strip(),
        "Single trials at any ISIs, in their order; TMS alone helps, and is not needed.",
        "Anything reliable about people and noise that its prior does not allow for (docs/model.md).",
    )
    if not len(trials.isi_ms):
        return [estimate]
    return [estimate, _by_means(trials), _by_counts(trials), _by_form(trials, last.window)]


def _by_means(trials: TrialsByIsi) -> MethodAnswer:
    """ISIs about the largest mean whose mean has .135 of its excess over TMS alone."""
    at_ms, mean_mv, counts = measured_profile(trials)
    known = len(trials.alone_mv) > 0
    baseline_mv = float(trials.alone_mv.mean() if known else np.median(mean_mv))
    inside = curve_masks((mean_mv - baseline_mv)[None], baseline_mv)[0]
    window = Window.from_mask(at_ms, inside)
    of = f"of {counted(len(trials.alone_mv), 'trial')} with TMS alone" if known else "guessed: the median of all means"
    said = f"Baseline {1e3 * baseline_mv:.3g} µV ({of}); means of {counted(int(counts.min()), 'trial')} at least."
    return MethodAnswer(
        "Mean MEPs [Kim2020, 4.3; baseline as in 4.2]",
        f"{_in_words(window)} {said}",
        f"Some {USUAL_TRIALS} trials at every ISI, and TMS alone for the baseline.",
        "How sure it is, and whether there is a window at all: the largest of some means is above any baseline. Few "
        "trials make windows too narrow or torn.",
    )


def _by_counts(trials: TrialsByIsi) -> MethodAnswer:
    """ISIs at which more than 40 % of the trials respond."""
    known = len(trials.alone_mv) > 0
    of = "95 % of the trials with TMS alone are not larger" if known else "a usual value: there is no TMS alone"
    try:
        study = count_trials(trials)
    except InvalidValueError as error:
        answer = f"No answer: {error.what}."
    else:
        answer = f"{_in_words(study.window)} Threshold of a response {1e3 * study.threshold_mv:.3g} µV ({of})."
    return MethodAnswer(
        "Response counts [Kim2020, 3.3.4]",
        answer,
        "A threshold of the person's own, and some ten trials at every ISI.",
        "How large the enhancement is, and how sure it is; the window depends on the threshold.",
    )


def _by_form(trials: TrialsByIsi, window: Window | None) -> MethodAnswer:
    """The form of the mean MEPs by ISI: the number of Gaussians, and a test of normality of those in the window."""
    at_ms, mean_mv, _ = measured_profile(trials)
    said = [_of_normality(mean_mv[window.mask(at_ms)]) if window is not None else "No window, no test of normality."]
    try:
        fits = profile_fits(trials.isi_ms, trials.mep_mv)
        said.append(f"Of up to five Gaussians and a spline, AICc prefers: {best_fit(fits).name}.")
    except InvalidValueError as error:
        said.append(f"No more can be said: {error.what}.")
    return MethodAnswer(
        "Form of the profile [Kim2020, Tables 4.1 and 8.1, Fig. 8.2]",
        " ".join(said),
        "Means at five ISIs and more; a few hundred trials to distinguish two Gaussians from one.",
        f"Where the window is. {counted(len(at_ms), 'ISI')} were used.",
    )


def _of_normality(enhanced_mv: FloatArray) -> str:
    """The test of Table 4.1, on the mean MEPs inside the window, as the text has it: they are the enhanced ones."""
    try:
        normal = normality(enhanced_mv)
    except InvalidValueError as error:
        return f"No test of normality inside the window: {error.what}."
    passed = "pass" if normal.normal else "fail"
    means = counted(len(enhanced_mv), "mean")
    return f"The {means} inside the window {passed} a test of normality (p = {normal.p_value:.2g})."


def _in_words(window: Window | None) -> str:
    if window is None:
        return "No window."
    return f"One ISI alone: {window.start_ms:g} ms." if window.start_ms == window.end_ms else f"Window {window}."
