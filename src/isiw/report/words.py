"""A session in plain words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Final, NamedTuple

from isiw import schedule, sentences, summary
from isiw.decision import OF_THE_WINDOW, StopKind
from isiw.errors import InvalidValueError
from isiw.figures import Estimate
from isiw.findings import Kind
from isiw.intervention import Intervention, concealed
from isiw.log.continuing import continued_by
from isiw.log.headers import Header
from isiw.log.record import SessionRecord, require_records
from isiw.metrics import f1, profile_correlation
from isiw.pairing import words
from isiw.pairing.effect import change_of
from isiw.pairing.pulses import pairing_of
from isiw.report.evidence import changed_with_time, contradiction, no_comparison, nothing_measured, nothing_stood_out
from isiw.schedule import Part
from isiw.session.examination import change_found
from isiw.strategy.catalogue import known_settings, list_strategies, measured_of
from isiw.text.sanitize import command, counted
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Trial
from isiw.window import Window

TRIAL_HEADINGS = ("trial", "commanded", "outcome", "realised")
"""The columns of `trial_rows`."""


class Role(StrEnum):
    """The part of a sentence in a statement."""

    ANSWER = "answer"
    DO = "do"
    WARNING = "warning"
    DETAIL = "detail"


class Said(NamedTuple):
    """A sentence of a statement: its name, its part, and its words."""

    name: str
    role: Role
    text: str


def final_statement(record: SessionRecord, config: Path | None = None) -> str:
    """The result of a session: the answer on one line, what to do on one at most, warnings, and then details.

    Args:
        record: the session.
        config: the configuration that it was run with, for the command that resumes it; None if not known.

    Raises:
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    if record.header.intervention is not None:
        return intervention_statement(record, record.header.intervention, config)
    return in_lines(statement(record, config))


def intervention_statement(record: SessionRecord, intervention: Intervention, config: Path | None = None) -> str:
    """How far an intervention came, and which arm it had if that is not concealed."""
    slots, last = schedule.slots(intervention.plan), record.estimates[-1] if record.estimates else None
    given = Counter(slots[trial.index].part for trial in record.table if trial.index < len(slots))
    done = ", ".join(f"{given[part]} {name}" for part, name in _PARTS.items())
    stop = next((event.text for event in record.events if event.kind == "stop"), None)
    over = stop or (last.reason if last is not None and last.stop else "")
    way_on = continued_by(record.path, record.header, config, end_lost=record.end_lost)
    arm = f"Arm: {intervention.arm.words}."
    if record.conceals:
        arm = concealed(record.path)
    way_on = over or f"The intervention is not over. Do: continue it with {way_on}"
    return "\n".join([way_on, f"Delivered: {done}.", *_change(record), arm])


def _change(record: SessionRecord) -> list[str]:
    """What pulses of TMS alone say of a change, if there are enough of them."""
    pairing = pairing_of(record)
    if record.conceals and record.given < len(schedule.slots(pairing.plan)):
        return [words.NOT_YET]
    try:
        effect = change_of(pairing.tests, pairs=pairing.plan.pairs)
    except InvalidValueError:
        return []
    return [words.answer(effect), words.drift(effect), words.NO_CAUSE]


_PARTS: Final = {Part.BEFORE: "before", Part.PAIRS: "of the intervention", Part.AFTER: "after"}


def in_lines(said: Sequence[Said]) -> str:
    """Sentences as they are printed: the answer, "Do:" and each warning on a line of its own, details together."""

    def of(role: Role) -> list[str]:
        return [one.text for one in said if one.role is role]

    do = [f"Do: {text[0].lower()}{text[1:]}" for text in of(Role.DO)]
    warnings = [f"Warning: {text}" for text in of(Role.WARNING)]
    return "\n".join(filter(None, (" ".join(of(Role.ANSWER)), *do, *warnings, " ".join(of(Role.DETAIL)))))


def statement(record: SessionRecord, config: Path | None = None) -> list[Said]:
    """The sentences about a session; the first thing to do is what is to be done, any other a detail."""
    last = record.estimates[-1] if record.estimates else None
    said, todo = findings(record), _todo(record, config)
    if record.end_lost:
        said.append(Said("end lost", Role.WARNING, "The end of the log is missing."))
    if last is not None:
        expects = _expects_a_tap(record)
        reason = last.reason if record.rests_on_data or last.stop_kind not in OF_THE_WINDOW else ""
        said += [
            Said("expects a tap", Role.WARNING, expects),
            Said("measured", Role.WARNING, _measured(record)),
            Said("judged since", Role.WARNING, summary.JUDGED_SINCE if record.is_judged_since else ""),
            Said("counts", Role.DETAIL, counts_sentence(record)),
            Said("fit", Role.DETAIL, fit_sentence(record)),
            Said("reason", Role.DETAIL, "" if last.stop and last.stop_kind is StopKind.ABSENT else reason),
        ]
    return _kept([*said, *(Said(name, Role.DETAIL if k else Role.DO, text) for k, (name, text) in enumerate(todo))])


def _kept(said: Iterable[Said]) -> list[Said]:
    return [one for one in said if one.text]


def _todo(record: SessionRecord, config: Path | None) -> list[tuple[str, str]]:
    """Names and words of what there is to do, the most urgent first."""
    way_on = continued_by(record.path, record.header, config, end_lost=record.end_lost)
    last = record.estimates[-1] if record.estimates else None
    todo = []
    if record.end_lost:
        count = "Find out, with the stimulator's counter, the number N of pulses that isiw show does not list"
        todo.append(("lost pulses", f"{count}; then resume with: {way_on}"))
    elif last is not None and not last.stop:
        todo.append(("resume", f"Resume with: {way_on}"))
    if last is not None:
        nothing = nothing_measured(record) is not None
        todo += [
            ("stimulus", _unstated_stimulus(record)),
            ("intensity", _unstated_intensity(record)),
            ("tap alone", "" if nothing else summary.tap_unmeasured(last, record.header.stimulus)),
            ("hit delay", _unstated_hit_delay(record)),
        ]
    return [(name, text) for name, text in todo if text]


def findings(record: SessionRecord) -> list[Said]:
    """The answer about the window, what speaks against it, and how sure it is."""
    if not record.estimates:
        nothing = sentences.nothing_estimated(len(record.table), record.given, damaged=bool(record.losses))
        return [Said("nothing", Role.ANSWER, nothing)]
    if (nothing_was := nothing_measured(record)) is not None:
        return [Said("nothing", Role.ANSWER, nothing_was)]
    space, estimate, told = record.header.space, record.estimates[-1], record.table.told
    # Of a change the last estimate says more than a doubt on the way.
    doubts = [event for event in record.events if event.kind == "doubt" and event.finding is not Kind.CHANGED]
    sought_ms = record.header.signals.mep_window_ms if "emg" in record.header.device.channels else None
    return _kept(
        [
            *answer_and_warnings(estimate, record.header, told),
            Said("at rest", Role.WARNING, nothing_stood_out(told, sought_ms) or ""),
            *(Said("doubt", Role.WARNING, f"Doubt since trial {event.trial}: {event.text}") for event in doubts),
            Said("edges", Role.DETAIL, sentences.edges(estimate, space)),
            Said("best ISI", Role.DETAIL, _best_isi(estimate)),
            Said("excluded", Role.DETAIL, sentences.excluded(estimate)),
            Said("expected F1", Role.DETAIL, sentences.expected_f1(estimate)),
            Said("depression", Role.DETAIL, _depression(record)),
            Said("first step", Role.DETAIL, _first_step(record)),
            Said("unusual", Role.DETAIL, sentences.unusual(estimate)),
        ]
    )


def answer_and_warnings(estimate: Estimate, header: Header, told: Sequence[Trial]) -> list[Said]:
    """The answer of an estimate, and what the trials that it rests on, and the tap, say against it."""
    window, first = estimate.window, header.stimulus
    expected = (estimate.grid_ms, estimate.profile_mv) if estimate.profile_mv else None
    against = {
        "tap": summary.tap_likely(estimate, first),
        "misfit": summary.misfit(estimate),
        "contradiction": contradiction(window, told, without_probability=estimate.probability is None),
        "few outside": no_comparison(window, told),
        "changed with time": changed_with_time(window, told, expected),
        "change": f"{changed}" if (changed := change_found(estimate.change, told)) else "",
    }
    answer = Said("answer", Role.ANSWER, sentences.finding(estimate, first, header.space))
    return [answer, *(Said(name, Role.WARNING, text) for name, text in against.items() if text)]


def _best_isi(estimate: Estimate) -> str:
    """The ISI of the largest MEP, and how large it is there, in mV and beside TMS alone."""
    said = sentences.best_isi(estimate)
    if not said or not estimate.enhancement_mv:
        return said
    (size, low, high), (ratio, least, most) = estimate.enhancement_mv, estimate.enhancement_ratio
    larger = f"{size:.2g} mV ({low:.2g}–{high:.2g}) above TMS alone, {ratio:.2g} times it ({least:.2g}–{most:.2g})"
    return f"{said.removesuffix('.')}, {larger}."


def _depression(record: SessionRecord) -> str:
    header = record.header
    return sentences.depression(record.estimates[-1], header.stimulus.name, header.visit.intensity_pct_rmt)


def _first_step(record: SessionRecord) -> str:
    """How the profile correlates with that of the session below the threshold, where this went on from one."""
    first, last = record.header.first_step, record.estimates[-1]
    if first is None or not last.profile_mv or first.reference != record.header.space.reference:
        return ""
    try:
        r, isis = profile_correlation(first.grid_ms, first.profile_mv, last.grid_ms, last.profile_mv)
    except InvalidValueError:  # they share no ISIs
        return ""
    at = "below the threshold" if first.intensity_pct_rmt is None else f"at {first.intensity_pct_rmt:g} % of RMT"
    return f"The profile correlates with that {at} ({first.log}) by {r:.2f}, over {isis} ISIs."


def counts_sentence(record: SessionRecord) -> str:
    """The numbers of stimuli that were delivered and that count, and why the others do not."""
    said = counts((*record.table, *record.unknown_trials), record.header.stimulus)
    before = counted(len(record.header.earlier), "earlier trial was", "earlier trials were")
    return f"{said} {before} learnt first." if record.header.earlier else said


def fit_sentence(record: SessionRecord) -> str:
    """In how many trials the fit had trouble; empty if it never had."""
    troubled = {event.trial for event in record.events if event.kind == "fit"}
    said = f"The fit had trouble in {len(troubled)} of {len(record.table)} trials; isiw show lists them."
    return said if troubled else ""


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
        return f"State the device's hit delay to the strategy next time, which usually saves stimuli: {call}."
    said = "State the device's hit delay (DeviceInfo.hit_delay_ms), which usually saves stimuli"
    if not any(name == "acceleration" for _, name in record.waveforms):
        return f"{said}."
    return f"{said}. {command('timing', record.path)} measures it."


def _unstated_intensity(record: SessionRecord) -> str:
    """That the strategy did not know of the intensity that the visit states, where it could have."""
    stated_pct = record.header.visit.intensity_pct_rmt
    if stated_pct is None or not _lacks(record, "intensity_pct_rmt"):
        return ""
    call = f"make_strategy(..., intensity_pct_rmt={stated_pct:g})"
    return f"State the intensity to the strategy next time, which assumes about 90 % of RMT: {call}."


def _unstated_stimulus(record: SessionRecord) -> str:
    """That windows after an electrical pulse are often missed if it is not stated, if no window is named."""
    header, last = record.header, record.estimates[-1]
    named = last.window is not None and not summary.is_guess(last)
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
    is_bayesian = estimate.probability is not None and estimate.depressed_probability is None
    if record.header.conditioning == "tap" or not is_bayesian or name not in list_strategies():
        return ""
    if known_settings(name, {"conditioning": record.header.conditioning}):
        return ""
    return (
        f"{name} expects windows as after a tap, and has no setting for an electrical pulse: do not rely on its "
        "probabilities. The default strategy has one."
    )


def _measured(record: SessionRecord) -> str:
    """What the strategy keeps of what it claims, of one that claims more than is so; empty for the others."""
    name = record.header.strategy.name
    if (found := measured_of(name)) is None or not record.rests_on_data:
        return ""
    (held, later), (wrong, lastly) = ([round(100 * share) for share in each] for each in (found.coverage, found.wrong))
    return (
        f"{name} claims more than came true on {found.people} simulated people with noise as near the motor threshold: "
        f"its 90 % intervals held {held} % of the true edges after 20 stimuli and {later} % after 40, and "
        f"{wrong} % and {lastly} % of its answers were sure and wrong, with an F1 at least .35 lower than expected."
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
    record.require_open()
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
        return counted(pairs, "pair was delivered", "pairs were delivered")
    kinds = {
        counted(pairs, "pair"): pairs,
        counted(taps, first.alone, f"{first.name}s alone"): taps,
        counted(pulses, "pulse of TMS alone", "pulses of TMS alone"): pulses,
        f"{(unclear := len(delivered) - pairs - taps - pulses)} of unknown kind": unclear,
    }
    *earlier, last = [kind for kind, count in kinds.items() if count]
    listed = f"{', '.join(earlier)} and {last}" if earlier else last
    return f"{counted(len(delivered), 'stimulus was delivered', 'stimuli were delivered')}: {listed}"
