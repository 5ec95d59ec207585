"""A session in plain words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from isiw import sentences
from isiw.findings import Kind
from isiw.log.kinds import continued_by
from isiw.log.reader import SessionRecord, require_records
from isiw.metrics import f1
from isiw.report.evidence import changed_with_time, contradiction, no_comparison, nothing_measured, nothing_stood_out
from isiw.session.examination import change_found
from isiw.strategy.catalogue import known_settings, list_strategies
from isiw.strategy.stopping import OF_THE_WINDOW
from isiw.text.sanitize import command, counted
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Trial
from isiw.window import Window

TRIAL_HEADINGS = ("trial", "commanded", "outcome", "realised")
"""The columns of `trial_rows`."""


def final_statement(record: SessionRecord, config: Path | None = None) -> str:
    """The result of a session, in a few sentences.

    Args:
        record: the session.
        config: the configuration that it was run with, for the command that resumes it; None if not known.

    Raises:
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    last = record.estimates[-1] if record.estimates else None
    way_on = continued_by(record.path, record.header, config, end_lost=record.end_lost)
    said = finding_sentences(record)
    if last is not None:
        said += [
            counts_sentence(record),
            fit_sentence(record),
            _unstated_hit_delay(record),
            _unstated_intensity(record),
            _unstated_stimulus(record),
            _expects_a_tap(record),
            last.reason if record.rests_on_data or last.stop_kind not in OF_THE_WINDOW else "",
        ]
    if record.end_lost:
        said.append(
            "The end of the log is missing. Find out, with the stimulator's counter, the number N of pulses that isiw "
            f"show does not list; then resume with: {way_on}"
        )
    elif last is not None and not last.stop:
        said.append(f"The session is not over; resume with: {way_on}")
    if last is not None and record.is_judged_since:
        said.append(sentences.JUDGED_SINCE)
    return " ".join(sentence for sentence in said if sentence)


def finding_sentences(record: SessionRecord) -> list[str]:
    """Sentences about the window, and how sure it is."""
    if not record.estimates:
        return [sentences.nothing_estimated(len(record.table), record.given, damaged=bool(record.losses))]
    space, nothing, estimate = record.header.space, nothing_measured(record), record.estimates[-1]
    if nothing is not None:
        return [nothing]
    told, first, window = record.table.told, record.header.stimulus, estimate.window
    sought_ms = record.header.signals.mep_window_ms if "emg" in record.header.device.channels else None
    # Of a change the last estimate says more than a doubt on the way.
    doubts = [event for event in record.events if event.kind == "doubt" and event.finding is not Kind.CHANGED]
    said = [
        sentences.finding(estimate, first, space),
        sentences.edges(estimate, space),
        sentences.tap_unknown(estimate, first),
        contradiction(window, told, without_probability=estimate.probability is None),
        no_comparison(window, told),
        changed_with_time(window, told),
        f"{changed}" if (changed := change_found(estimate.change, told)) else "",
        nothing_stood_out(told, sought_ms),
        *(sentences.doubt(event.trial, event.text) for event in doubts),
        sentences.best_isi(estimate),
        sentences.excluded(estimate),
        sentences.expected_f1(estimate),
        sentences.depression(estimate, first.name, record.header.visit.intensity_pct_rmt),
        sentences.unusual(estimate),
    ]
    return [sentence for sentence in said if sentence]


def counts_sentence(record: SessionRecord) -> str:
    """The numbers of stimuli that were delivered and that count, and why the others do not."""
    return counts((*record.table, *record.unknown_trials), record.header.stimulus)


def fit_sentence(record: SessionRecord) -> str:
    """In how many trials the fit had trouble; empty if it never had."""
    troubled = {event.trial for event in record.events if event.kind == "fit"}
    return sentences.fit(len(troubled), len(record.table))


def _lacks(record: SessionRecord, setting: str) -> bool:
    """True if the strategy could have used a setting, and did not have it."""
    recipe = record.header.strategy
    if setting in recipe.settings or recipe.name not in list_strategies():
        return False
    return bool(known_settings(recipe.name, {setting: True}))


def _unstated_hit_delay(record: SessionRecord) -> str:
    """That stimuli went into what the rig states, or could have stated, if the strategy could have used it."""
    header = record.header
    if header.space.reference != "valve" or not record.rests_on_data or not _lacks(record, "hit_delay_ms"):
        return ""
    if (stated_ms := header.device.hit_delay_ms) is not None:
        call = f"make_strategy(..., hit_delay_ms=({stated_ms[0]:g}, {stated_ms[1]:g}))"
        said = "The strategy does not know the device's hit delay; stating it usually saves stimuli."
        return f"{said} Next time: {call}."
    said = "The device does not state its hit delay (DeviceInfo.hit_delay_ms); stating it usually saves stimuli."
    if not any(name == "acceleration" for _, name in record.waveforms):
        return said
    return f"{said} {command('timing', record.path)} measures it."


def _unstated_intensity(record: SessionRecord) -> str:
    """That the strategy did not know of the intensity that the visit states, where it could have."""
    stated_pct = record.header.visit.intensity_pct_rmt
    if stated_pct is None or not _lacks(record, "intensity_pct_rmt"):
        return ""
    call = f"make_strategy(..., intensity_pct_rmt={stated_pct:g})"
    return f"The strategy does not know the intensity, and assumes about 90 % of RMT. Next time: {call}."


def _unstated_stimulus(record: SessionRecord) -> str:
    """That windows after an electrical pulse are often missed if it is not stated, if no window is named."""
    header, last = record.header, record.estimates[-1]
    named = last.window is not None and not sentences.is_guess(last)
    may_be_electrical = header.conditioning == "tap" and header.space.reference == "impact"
    if named or not may_be_electrical or not record.rests_on_data or not _lacks(record, "conditioning"):
        return ""
    return (
        'State what comes first (conditioning = "tap" or "electrical"): windows after an electrical pulse are narrow, '
        "and often missed if it is not stated."
    )


def _expects_a_tap(record: SessionRecord) -> str:
    """That a strategy expects windows as after a tap, if an electrical pulse came first."""
    name, estimate = record.header.strategy.name, record.estimates[-1]
    states_beliefs = estimate.probability is not None and estimate.depressed_probability is None
    if record.header.conditioning == "tap" or not states_beliefs or name not in list_strategies():
        return ""
    if known_settings(name, {"conditioning": record.header.conditioning}):
        return ""
    return (
        f"{name} expects windows as after a tap, and has no setting for an electrical pulse: do not rely on its "
        "probabilities. The default strategy has one."
    )


def truth_sentence(record: SessionRecord, truth: Window | None) -> str:
    """A sentence that compares the reported window with a simulated person's true one."""
    space, last = record.header.space, record.estimates[-1] if record.estimates else None
    found = None if last is None else last.window
    says_nothing = not record.rests_on_data or (last is not None and sentences.is_unfinished(last, space))
    share = None if says_nothing else f1(found, truth, space)
    return sentences.truth(truth, found, share)


def trial_rows(record: SessionRecord) -> list[tuple[str, ...]]:
    """All trials, as in `TRIAL_HEADINGS`; stimuli whose outcome the log does not have, too."""
    first, trials = record.header.stimulus, sorted([*record.table, *record.unknown_trials], key=lambda each: each.index)
    rows = ((t, "–" if t.isi_ms is None else f"{t.isi_ms:.4g} ms") for t in trials)
    return [(str(t.index), sentences.asked(t, first), sentences.outcome(t), isi) for t, isi in rows]


def counts(delivered: Sequence[Trial], first: StimulusWords = TAP) -> str:
    """The numbers of stimuli that were delivered and that count, and why the others do not."""
    told, accepted_taps = sum(trial.told for trial in delivered), sum(t.tap_alone and t.counts for t in delivered)
    alone = f" (the {first.name}{' alone does' if accepted_taps == 1 else 's alone do'} not)" if accepted_taps else ""
    parts = [f"{_delivered(delivered, first)}; {counted(told, 'counts', 'count')}{alone}"]
    mistrials = Counter(str(trial.reason) for trial in delivered if trial.reason is not None)
    if mistrials:
        parts.append("mistrials: " + ", ".join(f"{count} {reason}" for reason, count in mistrials.items()))
    if unwanted := sum(trial.excluded for trial in delivered):
        parts.append(f"{unwanted} excluded")
    return "; ".join(parts) + "."


def _delivered(delivered: Sequence[Trial], first: StimulusWords) -> str:
    """How many stimuli were delivered, by kind if some were no pairs; without a full stop."""
    pairs = sum(trial.commanded_isi_ms is not None for trial in delivered)
    taps = sum(trial.commanded_isi_ms is None and trial.tap_alone for trial in delivered)
    pulses = sum(trial.is_control and not trial.tap_alone for trial in delivered)
    if pairs == len(delivered):
        return counted(pairs, "pair of stimuli was delivered", "pairs of stimuli were delivered")
    kinds = {
        counted(pairs, "pair"): pairs,
        counted(taps, first.alone, f"{first.name}s alone"): taps,
        counted(pulses, "pulse of TMS alone", "pulses of TMS alone"): pulses,
        f"{(unclear := len(delivered) - pairs - taps - pulses)} of unknown kind": unclear,
    }
    *earlier, last = [kind for kind, count in kinds.items() if count]
    listed = f"{', '.join(earlier)} and {last}" if earlier else last
    return f"{counted(len(delivered), 'stimulus was delivered', 'stimuli were delivered')}: {listed}"
