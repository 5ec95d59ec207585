"""A session in plain words."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

from isiw.design import DesignSpace
from isiw.log.kinds import continued_by
from isiw.log.reader import SessionRecord, require_records
from isiw.log.schema import Estimate
from isiw.metrics import f1
from isiw.report.depression import depression_sentence
from isiw.report.evidence import (
    changed_with_time,
    contradiction,
    no_comparison,
    nothing_estimated,
    nothing_measured,
    nothing_stood_out,
)
from isiw.session.progress import asked, outcome
from isiw.strategy.catalogue import known_settings, list_strategies
from isiw.strategy.stopping import OF_THE_WINDOW
from isiw.text.commands import command
from isiw.text.numbers import counted
from isiw.window import MIN_EXCESS_MV, SURE, Window, rules_out

TRIAL_HEADINGS = ("trial", "asked", "outcome", "realised")
"""What `trial_rows` hold."""

WORTH_SAYING = 0.1
"""Probability from which on an unusual window is mentioned."""

A_GUESS = 0.5
"""Expected F1 below which the reported ISIs are a guess: most of them are as probably outside."""

MOST_OF_THE_RANGE = 0.9
"""The share of the range from which on a sweep has covered it."""

UNUSUAL = 0.9
"""Probability from which on a person is told to be unlike most."""

JUDGED_SINCE = "Trials were judged anew after this estimate; resume the session to have it with what counts now."
"""What is said where `SessionRecord.is_judged_since`."""


def final_statement(record: SessionRecord, config: Path | None = None) -> str:
    """What a session found, in a few sentences.

    Args:
        record: the session.
        config: the configuration that it was run with, for the command that goes on with it; None where not known.

    Raises:
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    last = record.estimates[-1] if record.estimates else None
    way_on = continued_by(record.path, record.header, config, end_lost=record.end_lost)
    sentences = finding_sentences(record)
    if last is not None:
        sentences += [
            counts_sentence(record),
            fit_sentence(record),
            _unstated_hit_delay(record),
            _expects_a_tap(record),
            last.reason if record.rests_on_data or last.stop_kind not in OF_THE_WINDOW else "",
        ]
    if record.end_lost:
        sentences.append(
            "The end of the log is missing. Find out, with the stimulator's counter, the number N of pulses that isiw "
            f"show does not list; then go on with: {way_on}"
        )
    elif last is not None and not last.stop:
        sentences.append(f"The session is not over; go on with: {way_on}")
    if last is not None and record.is_judged_since:
        sentences.append(JUDGED_SINCE)
    return " ".join(sentence for sentence in sentences if sentence)


def finding_sentences(record: SessionRecord) -> list[str]:
    """Whether there is a window, which, and how sure that is."""
    if not record.estimates:
        return [nothing_estimated(record)]
    space, nothing, estimate = record.header.space, nothing_measured(record), record.estimates[-1]
    if nothing is not None:
        return [nothing]
    said = [
        finding_sentence(record, estimate),
        _edges(estimate, space),
        contradiction(estimate.window, record.table.told, without_probability=estimate.probability is None) or "",
        no_comparison(estimate.window, record.table.told) or "",
        changed_with_time(estimate.window, record.table.told) or "",
        nothing_stood_out(record.table.told, _mep_window_ms(record)) or "",
        *(f"Doubt since trial {event.trial}: {event.text}" for event in record.events if event.kind == "doubt"),
        _best_isi(estimate),
        _excluded(estimate),
        _expected_f1(estimate),
        depression_sentence(record),
        _unusual(estimate),
    ]
    return [sentence for sentence in said if sentence]


def _mep_window_ms(record: SessionRecord) -> tuple[float, float] | None:
    """Where the session sought the MEP [ms after the pulse]; None where its device, or somebody, measured it."""
    return record.header.signals.mep_window_ms if "emg" in record.header.device.channels else None


def finding_sentence(record: SessionRecord, estimate: Estimate) -> str:
    """Whether there is a window, and which."""
    window, probability = estimate.window, estimate.probability
    if probability is None:
        return _without_probability(record, estimate)
    chance = f" (probability of a window: {probability:.2f})"
    if window is None:
        is_none = rules_out(probability)
        return f"No window was found{chance}." if is_none else f"It is undecided whether there is a window{chance}."
    enhances = f"The {record.header.stimulus.name} {'' if probability >= SURE else 'probably '}enhances the MEP"
    isis = f"{window} {_after(record)}{chance}"
    if estimate.expected_f1 is not None and estimate.expected_f1 < A_GUESS:
        return f"{enhances}, but at which ISIs is not known well; the best guess is {isis}."
    return f"{enhances} at ISIs of {isis}."


def _after(record: SessionRecord) -> str:
    """Which event the session's ISIs count from, in words."""
    return f"after the {record.header.stimulus.origin(record.header.space.reference)}"


def _without_probability(record: SessionRecord, estimate: Estimate) -> str:
    """The same, of a method that gives none."""
    first, space = record.header.stimulus.name, record.header.space
    if estimate.window is not None:
        isis = f"{estimate.window} {_after(record)}"
        return f"By this method, which gives no probability, the {first} enhances the MEP at ISIs of {isis}."
    if not estimate.has_answer:
        return "The method has no answer yet: it has not measured enough for one."
    first_ms, last_ms = estimate.grid_ms[0], estimate.grid_ms[-1]
    if last_ms - first_ms < MOST_OF_THE_RANGE * (space.high_ms - space.low_ms):
        return f"No window was found at the ISIs measured so far, {first_ms:g}–{last_ms:g} ms."
    return "No window was found."


def _edges(estimate: Estimate, space: DesignSpace) -> str:
    low, high = (estimate.start_low_ms, estimate.start_high_ms), (estimate.end_low_ms, estimate.end_high_ms)
    if estimate.window is None or None in low or None in high:
        return ""
    given = (
        "With 90 % probability each, it"
        if _is_sure(estimate)
        else "If there is a window, with 90 % probability each it"
    )
    edges = f"{given} starts {_between(low, space)} and ends {_between(high, space)}."
    unusual = {
        "starts before the range": estimate.start_beyond,
        "ends beyond the range": estimate.end_beyond,
        "has more than one segment": estimate.split,
    }
    said = [f"it {what} with probability {p:.2f}" for what, p in unusual.items() if p is not None and p >= WORTH_SAYING]
    return f"{edges} Given a window, {', '.join(said)}." if said else edges


def _best_isi(estimate: Estimate) -> str:
    if estimate.window is None or not estimate.best_isi_ms:
        return ""
    best, low, high = estimate.best_isi_ms
    given = "The" if _is_sure(estimate) else "If there is a window, the"
    return (
        f"{given} largest MEP is expected at {best:.0f} ms, with 90 % probability between {low:.0f} and {high:.0f} ms."
    )


def _is_sure(estimate: Estimate) -> bool:
    """Whether a reported window goes without saying "if there is one"."""
    return estimate.probability is None or estimate.probability >= SURE


def _excluded(estimate: Estimate) -> str:
    if estimate.window is not None or estimate.excluded_mv is None:
        return ""
    # Less is no window, and says nothing of the input: below the threshold it can shift without any MEP.
    told = estimate.excluded_pct_rmt is not None and estimate.excluded_mv > MIN_EXCESS_MV
    share = f" ({_figure(estimate.excluded_pct_rmt or 0.0)} % of RMT)" if told else ""
    enhancement = f"An enhancement of more than {_figure(1e3 * max(estimate.excluded_mv, MIN_EXCESS_MV))} µV{share}"
    return f"{enhancement} is excluded with 90 % probability."


def _figure(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def _expected_f1(estimate: Estimate) -> str:
    if estimate.expected_f1 is None:
        return ""
    return f"The expected F1 of this result is {estimate.expected_f1:.2f} (1 is the true window, 0 no overlap)."


def _unusual(estimate: Estimate) -> str:
    said = [f"{what} (probability {p:.2f})" for what, p in estimate.unusual.items() if p >= UNUSUAL]
    return f"This person is unlike most in {', '.join(said)}." if said else ""


def _between(interval: tuple[float | None, float | None], space: DesignSpace) -> str:
    low, high = (math.nan if edge is None else edge for edge in interval)
    if math.isinf(low) and math.isinf(high):
        return f"before {space.low_ms:g} ms" if low < 0 else f"after {space.high_ms:g} ms"
    if math.isinf(low):
        return f"before {high:.0f} ms"
    if math.isinf(high):
        return f"after {low:.0f} ms"
    return f"between {low:.0f} and {high:.0f} ms"


def counts_sentence(record: SessionRecord) -> str:
    """How many stimuli were delivered, how many count, and why the others do not."""
    mistrials = Counter(str(trial.reason) for trial in record.table if trial.reason is not None)
    excluded = sum(trial.excluded for trial in record.table)
    unknown = len(record.unknown)
    if unknown:
        mistrials["outcome unknown"] += unknown
    told, given = len(record.table.told), record.given
    pairs = counted(given, "pair of stimuli was delivered", "pairs of stimuli were delivered")
    if controls := _controls(record):
        pairs = f"{given} stimuli were delivered, {controls} among them"
    parts = [f"{pairs}; {counted(told, 'counts', 'count')}"]
    if mistrials:
        parts.append("mistrials: " + ", ".join(f"{count} {reason}" for reason, count in mistrials.items()))
    if excluded:
        parts.append(f"{excluded} excluded")
    return "; ".join(parts) + "."


def _controls(record: SessionRecord) -> str:
    """How many control trials there were, in words; empty where there were none."""
    kinds = Counter(asked(trial, record.header.stimulus) for trial in record.table if trial.is_control)
    return " and ".join(f"{count} of {kind}" for kind, count in sorted(kinds.items(), reverse=True))


def fit_sentence(record: SessionRecord) -> str:
    """In how many trials the fit had trouble; empty where it never had."""
    troubled = len({event.trial for event in record.events if event.kind == "fit"})
    return f"The fit had trouble in {troubled} of {len(record.table)} trials; isiw show lists them." if troubled else ""


def _unstated_hit_delay(record: SessionRecord) -> str:
    """That stimuli went into what the rig states, or could have stated, where the strategy could have used it."""
    header, recipe = record.header, record.header.strategy
    if header.space.reference != "valve" or "hit_delay_ms" in recipe.settings or not record.rests_on_data:
        return ""
    if recipe.name not in list_strategies() or not known_settings(recipe.name, {"hit_delay_ms": True}):
        return ""
    if (stated_ms := header.device.hit_delay_ms) is not None:
        call = f"make_strategy(..., hit_delay_ms=({stated_ms[0]:g}, {stated_ms[1]:g}))"
        said = "The strategy was not told the device's hit delay; telling it usually saves stimuli."
        return f"{said} Next time: {call}."
    said = "The device does not state its hit delay (DeviceInfo.hit_delay_ms); stating it usually saves stimuli."
    if not any(name == "acceleration" for _, name in record.waveforms):
        return said
    return f"{said} {command('timing', record.path)} measures it."


def _expects_a_tap(record: SessionRecord) -> str:
    """That what a strategy believes of windows is true of those after a tap, where an electrical pulse came first."""
    name, estimate = record.header.strategy.name, record.estimates[-1]
    states_beliefs = estimate.probability is not None and estimate.depressed_probability is None
    if record.header.conditioning == "tap" or not states_beliefs or name not in list_strategies():
        return ""
    if known_settings(name, {"conditioning": record.header.conditioning}):
        return ""
    return (
        f"{name} expects windows as after a tap, and cannot be told of the electrical pulse: do not rely on its "
        "probabilities. The default strategy can be told."
    )


def truth_sentence(record: SessionRecord, truth: Window | None) -> str:
    """How close the reported window is to a simulated person's true one.

    Args:
        record: the session.
        truth: the true window; None where there is none.
    """
    true = "has no window" if truth is None else f"has the window {truth}"
    if not record.rests_on_data:
        return f"This simulated person in fact {true}."
    found = record.estimates[-1].window if record.estimates else None
    share = f1(found, truth, record.header.space)
    said = "none was reported (F1 {0:.2f})" if found is None else "the F1 of the reported one is {0:.2f}"
    return f"This simulated person in fact {true}; {said.format(share)}."


def trial_rows(record: SessionRecord) -> list[tuple[str, ...]]:
    """All trials, as in `TRIAL_HEADINGS`; stimuli whose outcome the log does not have, too.

    Args:
        record: the session.
    """
    trials = sorted([*record.table, *record.unknown_trials], key=lambda trial: trial.index)
    return [(str(t.index), asked(t, record.header.stimulus), outcome(t), _isi(t.isi_ms)) for t in trials]


def _isi(isi_ms: float | None) -> str:
    return "–" if isi_ms is None else f"{isi_ms:.4g} ms"
