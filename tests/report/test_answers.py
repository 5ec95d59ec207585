from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from isiw.findings import Kind
from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import EstimateRecord, Event, Intent, Record
from isiw.report.answers import Answer, _in_words, answers
from isiw.session.loop import Session
from isiw.trials import Status, Trial
from isiw.window import Window
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    log = tmp_path_factory.mktemp("answers") / "s.mcap"
    Session(ScriptedDevice(), scripted_strategy(4), log=log).run()
    return read_session(log)


def with_history(record: SessionRecord, history: Sequence[Record]) -> SessionRecord:
    return replace(record, history=tuple(history), delivered=0)


def trial(index: int, **values: Any) -> Trial:
    told = {"isi_ms": 50.0, "mep_mv": 0.05} | values
    status = Status.MISTRIAL if "reason" in values else Status.ACCEPTED
    return Trial(index, status, 50.0, **told)


def answer(record: SessionRecord, question: str) -> Answer:
    return next(answer for answer in answers(record) if question in answer.question)


def test_timing_is_said_by_the_median_and_the_largest_error_and_what_it_cost(record: SessionRecord) -> None:
    trials = [trial(0, isi_ms=51.0), trial(1, isi_ms=48.0), trial(2, isi_ms=54.0, t_hit_ms=1.0)]
    lost = [trial(3, isi_ms=63.0, reason=Kind.ISI_OFF), trial(4, reason=Kind.SATURATION)]
    _, said, detail = answer(with_history(record, [*trials, *lost]), "timing")
    assert said == "not in 1 of 5 trials"
    assert detail == (
        "Trials that count are off by 2.0 ms (median), at most 4.0 ms; 10 ms are tolerated. "
        "Rejected for this: 1 ISI off by more than the tolerance."
    )
    assert answer(with_history(record, trials), "timing").answer == "yes"


def test_an_isi_beyond_the_tolerance_is_not_right_where_nobody_rejected_it(record: SessionRecord) -> None:
    trials = [trial(0, isi_ms=150.0), trial(1, isi_ms=51.0)]
    assert answer(with_history(record, trials), "timing").answer == "not in 1 of 2 trials"


def test_timing_is_not_known_of_imported_trials_for_which_nothing_was_commanded(record: SessionRecord) -> None:
    imported = replace(record, header=record.header.model_copy(update={"kind": "imported"}))
    timed = [trial(n, isi_ms=50.0 + 1e-12, t_valve_ms=10.0, t_tms_ms=60.0) for n in range(3)]
    _, said, detail = answer(with_history(imported, timed), "timing")
    assert said == "not known"
    assert "No ISI was commanded" in detail
    assert answer(with_history(imported, [trial(0, isi_ms=51.0)]), "timing").answer == "yes"


def test_a_window_of_one_isi_is_no_range() -> None:
    assert _in_words(Window(0.0, 0.0)) == "One ISI alone: 0 ms."
    assert _in_words(Window(0.0, 10.0)) == "Window 0–10 ms."


def test_a_tense_muscle_is_not_at_rest_where_nobody_rejected_the_trial(record: SessionRecord) -> None:
    trials = [trial(0, background_rms_uv=450.0), trial(1, background_rms_uv=1.0)]
    assert answer(with_history(record, trials), "at rest").answer == "not in 1 of 2 trials"


def test_a_tense_muscle_is_not_at_rest_where_the_trial_was_lost_for_another_reason(record: SessionRecord) -> None:
    trials = [trial(0, background_rms_uv=80.0, reason=Kind.SATURATION), trial(1, background_rms_uv=1.0)]
    assert answer(with_history(record, trials), "at rest").answer == "not in 1 of 2 trials"


def test_a_device_that_only_repeats_what_was_wanted_is_not_taken_for_exact(record: SessionRecord) -> None:
    _, said, detail = answer(record, "timing")
    assert said == "not known: exactly 0 off in all trials"
    assert "no pulse or hit time to check it against" in detail


def test_an_isi_exactly_as_wanted_is_right_where_the_times_confirm_it(record: SessionRecord) -> None:
    timed = trial(0, t_valve_ms=100.0, t_tms_ms=150.0)
    assert (
        answer(with_history(record, [timed, trial(1)]), "timing").answer == "yes, in all trials that show it (1 of 2)"
    )
    untimed = trial(0, t_hit_ms=100.0, t_tms_ms=150.0)  # the space counts from the valve
    assert (
        answer(with_history(record, [untimed, trial(1)]), "timing").answer == "not known: exactly 0 off in all trials"
    )


def test_an_isi_that_its_times_contradict_is_not_right_where_nobody_rejected_it(record: SessionRecord) -> None:
    trials = [trial(0, t_valve_ms=100.0, t_tms_ms=110.0), trial(1, t_valve_ms=100.0, t_tms_ms=151.0)]
    _, said, detail = answer(with_history(record, trials), "timing")
    assert said == "not in 1 of 2 trials"
    assert detail.endswith("The times of pulse and valve contradict the ISI in trial 0.")


def test_timing_after_an_electrical_pulse_is_that_of_the_two_pulses(record: SessionRecord) -> None:
    header = record.header
    device = replace(header.device, reference="impact", conditioning="electrical")
    space = replace(header.space, reference="impact")
    pulsed = replace(record, header=header.model_copy(update={"device": device, "space": space}))
    assert "no magnetic pulse or electrical pulse time to check it against" in answer(pulsed, "timing").detail
    trials = [trial(0, t_hit_ms=100.0, t_tms_ms=110.0), trial(1, t_hit_ms=100.0, t_tms_ms=151.0)]
    said = answer(with_history(pulsed, trials), "timing").detail
    assert said.endswith("The times of magnetic pulse and electrical pulse contradict the ISI in trial 0.")


def test_a_muscle_that_was_never_at_rest_is_not_unknown(record: SessionRecord) -> None:
    trials = [trial(k, background_rms_uv=30.0 + k, reason=Kind.BACKGROUND_ACTIVITY) for k in range(3)]
    _, said, detail = answer(with_history(record, trials), "at rest")
    assert said == "not in 3 of 3 trials"
    assert detail == (
        "EMG before the pulse: 31 µV RMS (median), at most 32 µV; 10 µV are allowed. "
        "Rejected for this: 3 background activity."
    )


def test_a_rest_that_is_known_of_some_trials_only_is_not_told_of_all(record: SessionRecord) -> None:
    trials = [trial(0, background_rms_uv=1.0), trial(1)]
    assert answer(with_history(record, trials), "at rest").answer == "yes, in all trials that show it (1 of 2)"


def test_a_trial_that_an_operator_accepted_was_still_not_at_rest(record: SessionRecord) -> None:
    tense = trial(0, background_rms_uv=30.0, reason=Kind.BACKGROUND_ACTIVITY).accepted_anyway()
    _, said, detail = answer(with_history(record, [tense, trial(1, background_rms_uv=1.0)]), "at rest")
    assert said == "not in 1 of 2 trials"
    assert detail.endswith("Rejected for this: 1 background activity, accepted by the operator.")


def test_without_a_background_it_is_not_known(record: SessionRecord) -> None:
    assert answer(record, "at rest")[1:] == (
        "not known",
        "The log has no background EMG. No trial was rejected for this.",
    )


def test_why_it_stopped_is_the_last_decisions_reason(record: SessionRecord) -> None:
    assert answer(record, "stop")[1:] == ("The budget of 4 stimuli is used up.", "")


def test_lost_trials_are_named_as_far_as_they_are_few(record: SessionRecord) -> None:
    def lost(count: int) -> str:
        bad = [trial(k, reason=Kind.SATURATION) for k in range(1, count + 1)]
        return answer(replace(record, history=(trial(0), *bad), delivered=0), "lost").answer

    assert [lost(0), lost(1), lost(2)] == ["none", "1 of 2: trial 1", "2 of 3: trials 1, 2"]
    assert lost(11) == "11 of 12: trials 1, 2, 3, 4, 5, 6, 7, 8 and 3 more"


def test_a_control_trial_from_which_nothing_is_learnt_is_not_lost(record: SessionRecord) -> None:
    tap = Trial(1, Status.ACCEPTED, None, tap_alone=True, mep_mv=0.01)
    assert answer(replace(record, history=(trial(0), tap), delivered=0), "lost").answer == "none"


def test_a_session_that_broke_off_says_by_what(record: SessionRecord) -> None:
    changed = {"stop": False, "reason": "2 stimuli are left."}
    going_on = [e.model_copy(update=changed) if isinstance(e, EstimateRecord) else e for e in record.history]
    assert answer(with_history(record, going_on), "stop")[1:] == ("it has not stopped", "2 stimuli are left.")
    doubt = Event(kind="doubt", trial=3, text="What is said twice is said once.")
    fault = Event(kind="fault", trial=3, text="Interrupted by the operator.")
    assert answer(with_history(record, [*going_on, doubt, fault]), "stop")[1:] == (
        "it was interrupted", "Interrupted by the operator. 2 stimuli are left.",
    )  # fmt: skip


def test_nothing_at_all_has_answers_too(record: SessionRecord) -> None:
    assert [said for _, said, _ in answers(replace(record, history=(), delivered=0))] == [
        "none", "not known", "not known", "before the first estimate",
    ]  # fmt: skip


def test_a_log_in_a_folder_is_not_named_with_its_path(record: SessionRecord) -> None:
    assert str(Path(record.path).parent) not in " ".join(answer.detail for answer in answers(record))


def test_what_is_not_known_of_some_stimuli_is_not_told_of_all(record: SessionRecord) -> None:
    trials = [trial(0, isi_ms=51.0, background_rms_uv=2.0), trial(1, isi_ms=48.0, background_rms_uv=2.0)]
    lost = with_history(record, [*trials, Intent(trial=2, isi_ms=50.0)])
    for question in ("timing", "at rest"):
        assert answer(lost, question).answer == "yes, in all trials that show it (2 of 3)"


def test_a_device_that_repeats_what_was_wanted_hides_no_trial_that_was_lost_for_its_timing(
    record: SessionRecord,
) -> None:
    lost = trial(1, isi_ms=None, mep_mv=None, reason=Kind.NO_IMPACT)
    assert answer(with_history(record, [trial(0), lost]), "timing").answer == "not in 1 of 2 trials"
