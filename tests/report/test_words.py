from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw import sentences
from isiw.change import Misfit
from isiw.decision import StopKind
from isiw.design import DesignSpace
from isiw.log.headers import StrategyRecipe
from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import Event, Intent
from isiw.report.words import TRIAL_HEADINGS, counts_sentence, final_statement, trial_rows, truth_sentence
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.strategy.catalogue import measured_of
from isiw.summary import summary
from isiw.sweeps import Channel, Measurement
from isiw.trials import Status, Trial
from isiw.types import Reference
from isiw.visit import Visit
from isiw.window import Window
from report.sessions import with_estimate
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def record(tmp_path: Path) -> SessionRecord:
    device = ScriptedDevice(lambda s: Measurement(0.0512, s.isi_ms, background_rms_uv=50.0 if s.trial == 1 else 2.0))
    Session(device, scripted_strategy(4), log=tmp_path / "s.mcap").run()
    return read_session(tmp_path / "s.mcap")


def test_the_statement_has_window_intervals_counts_and_reason(record: SessionRecord) -> None:
    assert final_statement(record) == (
        "The tap probably enhances the MEP at ISIs of 33–93 ms after the valve command "
        "(probability 0.90, Bayes factor 9).\n"
        "If there is a window, start 28–38 ms, end after 150 ms (90 % each). "
        "Given a window, it ends beyond the range with probability 0.67. "
        "4 pairs were delivered; 3 count; mistrials: 1 background activity. "
        "The budget of 4 stimuli is used up."
    )


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (-math.inf, -math.inf, "start before 0 ms"),
        (-math.inf, 12.0, "start before 12 ms"),
        (12.0, math.inf, "start after 12 ms"),
        (math.inf, math.inf, "start after 200 ms"),
    ],
)
def test_an_edge_beyond_the_range_is_said_in_words(record: SessionRecord, low: float, high: float, words: str) -> None:
    assert words in final_statement(with_estimate(record, start_low_ms=low, start_high_ms=high))


def test_where_too_few_pairs_are_left_no_reason_speaks_of_a_window(record: SessionRecord) -> None:
    known = with_estimate(record, reason="F1 is high.", stop=True, stop_kind=StopKind.KNOWN)
    left = [
        replace(entry, isi_ms=None, commanded_isi_ms=None) if isinstance(entry, Trial) and entry.index > 1 else entry
        for entry in known.history
    ]
    said = final_statement(type(record)(record.path, record.header, tuple(left), (), True))
    assert said.startswith(sentences.few_pairs(1, 4))
    assert "F1 is high." not in said


def test_a_reason_of_a_users_own_rule_is_printed_whatever_its_words(record: SessionRecord) -> None:
    over = with_estimate(record, reason="The lab's time window is over.", stop=True)
    silent = replace(over, history=tuple(replace(e, mep_mv=0.0) if isinstance(e, Trial) else e for e in over.history))
    assert not silent.rests_on_data
    assert "The lab's time window is over." in final_statement(silent)


def test_after_an_electrical_pulse_no_tap_is_spoken_of(record: SessionRecord) -> None:
    header, space = record.header, DesignSpace(0, 200, reference="impact")
    device = replace(header.device, reference="impact", conditioning="electrical")
    pulsed = replace(record, header=header.model_copy(update={"device": device, "space": space}))
    said = final_statement(pulsed)
    assert "The electrical pulse probably enhances the MEP at ISIs of 33–93 ms after the electrical pulse" in said
    assert "By this method, which gives no probability, the electrical pulse enhances" in final_statement(
        with_estimate(pulsed, probability=None)
    )


def test_control_trials_are_named_after_the_stimulus_that_was_given(record: SessionRecord) -> None:
    alone = Trial(4, Status.ACCEPTED, None, tap_alone=True)
    device = replace(record.header.device, conditioning="electrical")
    tapped = replace(record, history=(*record.history, alone))
    pulsed = replace(tapped, header=tapped.header.model_copy(update={"device": device}))
    for given, name in ((tapped, "tap"), (pulsed, "electrical pulse")):
        said = f"5 stimuli were delivered: 4 pairs and 1 {name} alone; 3 count (the {name} alone does not); "
        assert counts_sentence(given).startswith(said)
        assert trial_rows(given)[4][1] == f"{name} alone"
        assert f"1 of a{'n' if name != 'tap' else ''} {name} alone" in str(given)


def test_an_unusual_window_is_said_with_its_probability_once_it_is_worth_saying(record: SessionRecord) -> None:
    statement = final_statement(with_estimate(record, start_beyond=0.25, end_beyond=0.0, split=0.6))
    assert "before the range with probability 0.25 and has more than one segment with probability 0.60" in statement


@pytest.mark.parametrize(
    ("probability", "said"),
    [
        (0.05, "No window was found (probability of a window: 0.05, Bayes factor 0.053).\n4 pairs"),
        (
            0.07,
            "It is undecided whether there is a window (probability of a window: 0.07, Bayes factor 0.075).\n4 pairs",
        ),
    ],
)
def test_no_window_is_a_finding_once_it_has_95_percent(
    record: SessionRecord, probability: float | None, said: str
) -> None:
    assert final_statement(with_estimate(record, segments_ms=(), probability=probability)).startswith(said)


@pytest.mark.parametrize(
    ("grid_ms", "said"),
    [
        ((), "The method has no answer yet: it has not measured enough for one."),
        ((0.0, 10.0), "The scan of ISIs is not finished: of 0–200 ms it has measured 0–10 ms"),
        ((0.0, 100.0, 200.0), "No window was found.\n4 pairs"),
    ],
)
def test_a_method_without_a_probability_says_what_it_has_measured(
    record: SessionRecord, grid_ms: tuple[float, ...], said: str
) -> None:
    nothing = with_estimate(record, segments_ms=(), probability=None, grid_ms=grid_ms)
    assert final_statement(nothing).startswith(said)


def test_isis_that_are_expected_to_be_wrong_are_a_guess(record: SessionRecord) -> None:
    said = final_statement(with_estimate(record, probability=0.69, expected_f1=0.4, beforehand=None))
    assert said.startswith(
        "The tap probably enhances the MEP, but at which ISIs is not known well; the best guess is 33–93 ms after the "
        "valve command (probability 0.69)."
    )


_UNDECIDED = "It is undecided whether there is a window"


@pytest.mark.parametrize(
    ("probability", "beforehand", "said"),
    [
        (0.6, 0.69, f"{_UNDECIDED} (probability of a window: 0.60, Bayes factor 0.67); the best guess is 33–93 ms"),
        (0.86, 0.69, f"{_UNDECIDED} (probability of a window: 0.86, Bayes factor 2.8); the best guess is 33–93 ms"),
        (0.88, 0.69, "The tap probably enhances the MEP at ISIs of 33–93 ms"),
        (0.6, 0.2, "The tap probably enhances the MEP at ISIs of 33–93 ms"),
        (0.96, 0.97, "The tap enhances the MEP at ISIs of 33–93 ms"),
    ],
)
def test_a_window_that_trials_hardly_speak_for_is_undecided(
    record: SessionRecord, probability: float, beforehand: float, said: str
) -> None:
    changed = with_estimate(record, probability=probability, beforehand=beforehand)
    assert final_statement(changed).startswith(said)
    assert ("Undecided, if there is a window: 33–93 ms" in summary(changed.estimates[-1])) == ("undecided" in said)


def test_a_strategy_that_was_not_told_the_stated_intensity_is_named(record: SessionRecord) -> None:
    said = "Do: state the intensity to the strategy next time, which assumes about 90 % of RMT"
    visit = Visit(intensity_pct_rmt=110.0)

    def statement(**settings: Any) -> str:
        recipe = StrategyRecipe(name="default", seed=0, settings=settings)
        header = record.header.model_copy(update={"visit": visit, "strategy": recipe})
        return final_statement(replace(record, header=header))

    assert f"{said}: make_strategy(..., intensity_pct_rmt=110)." in statement()
    assert said not in statement(intensity_pct_rmt=110.0)


def test_a_method_without_a_probability_is_said_to_have_none(record: SessionRecord) -> None:
    said = "By this method, which gives no probability, the tap enhances the MEP at ISIs of 33–93 ms"
    assert final_statement(with_estimate(record, probability=None)).startswith(said)


@pytest.mark.parametrize(
    ("excluded_mv", "pct_rmt", "said"),
    [
        (0.0142, 8.7, "An enhancement of more than 14 µV (8.7 % of RMT) is excluded with 90 % probability."),
        (0.0142, 12.3, "An enhancement of more than 14 µV (12 % of RMT) is excluded with 90 % probability."),
        (0.0, 10.4, "An enhancement of more than 2 µV is excluded with 90 % probability."),
        (0.0049, None, "An enhancement of more than 4.9 µV is excluded with 90 % probability."),
    ],
)
def test_without_a_window_the_largest_enhancement_that_is_excluded_is_said(
    record: SessionRecord, excluded_mv: float, pct_rmt: float | None, said: str
) -> None:
    excluded = {"excluded_mv": excluded_mv, "excluded_pct_rmt": pct_rmt}
    assert said in final_statement(with_estimate(record, segments_ms=(), probability=0.02, **excluded))
    assert "An enhancement" not in final_statement(with_estimate(record, **excluded))


def test_the_best_isi_is_said_with_its_interval_where_there_is_a_window(record: SessionRecord) -> None:
    said = "Largest MEP at 64 ms (90 %: 51–78 ms)."
    best = {"best_isi_ms": (64.2, 51.0, 77.6)}
    assert said in final_statement(with_estimate(record, probability=0.97, **best))
    unsure = final_statement(with_estimate(record, probability=0.59, **best))
    assert f"Given a window, l{said.removeprefix('L')}" in unsure
    assert "argest MEP" not in final_statement(with_estimate(record, segments_ms=(), probability=0.02, **best))


def test_the_expected_f1_is_said(record: SessionRecord) -> None:
    assert "Expected F1: 0.84 (1: exact)." in final_statement(with_estimate(record, expected_f1=0.841))


def run_by(record: SessionRecord, name: str, *, delay_ms: tuple[float, float] | None, **settings: Any) -> SessionRecord:
    strategy = StrategyRecipe(name=name, seed=0, settings=settings)
    device = replace(record.header.device, hit_delay_ms=delay_ms)
    return replace(record, header=record.header.model_copy(update={"strategy": strategy, "device": device}))


def test_a_hit_delay_that_nobody_stated_is_said_to_have_cost_stimuli(record: SessionRecord) -> None:
    said = "Do: state the device's hit delay (DeviceInfo.hit_delay_ms), which usually saves stimuli."
    unstated = run_by(record, "default", delay_ms=None)
    assert said in final_statement(unstated)
    wave = Channel(np.zeros(10), 1000.0, "m/s^2")
    with_sensor = replace(unstated, waveforms={(0, "acceleration"): wave}, path=Path("a lab/s.mcap"))
    assert f"{said} isiw timing 'a lab/s.mcap' measures it." in final_statement(with_sensor)


def test_a_hit_delay_that_only_the_device_was_told_is_said_to_have_cost_stimuli(record: SessionRecord) -> None:
    said = final_statement(run_by(record, "default", delay_ms=(150.0, 5.0)))
    assert "state the device's hit delay to the strategy" in said
    assert "make_strategy(..., hit_delay_ms=(150, 5))" in said


@pytest.mark.parametrize(
    ("reference", "settings", "found", "said"),
    [
        ("impact", {}, {"segments_ms": (), "probability": 0.3}, True),
        ("impact", {}, {"probability": 0.6, "beforehand": 0.69}, True),
        ("impact", {}, {"probability": 0.97}, False),
        ("impact", {"conditioning": "tap"}, {"segments_ms": (), "probability": 0.3}, False),
        ("valve", {}, {"segments_ms": (), "probability": 0.3}, False),
    ],
)
def test_that_what_comes_first_can_be_stated_is_said_if_no_window_is_named(
    record: SessionRecord, reference: Reference, settings: dict[str, Any], found: dict[str, Any], *, said: bool
) -> None:
    run = with_estimate(run_by(record, "default", delay_ms=None, **settings), **found)
    space = replace(run.header.space, reference=reference)
    statement = final_statement(replace(run, header=run.header.model_copy(update={"space": space})))
    assert ('Do: state what comes first (conditioning = "tap" or "electrical")' in statement) == said


@pytest.mark.parametrize(("name", "said"), [("gp-straddle", True), ("gp-ei", True), ("default", False), ("", False)])
def test_a_strategy_that_claims_more_than_came_true_names_its_measured_coverage(
    record: SessionRecord, name: str, *, said: bool
) -> None:
    text = final_statement(run_by(record, name, delay_ms=None))
    assert (f"Warning: {name} claims more than came true on" in text) is said
    found = measured_of(name)
    share = "" if found is None else f"{100 * found.coverage[0]:.0f} %"
    assert (f"its 90 % intervals held {share} of the true edges" in text) is said


@pytest.mark.parametrize(("name", "said"), [("gp-straddle", True), ("default", False), ("", False)])
def test_what_a_strategy_for_taps_says_of_an_electrical_pulse_is_not_to_be_relied_on(
    record: SessionRecord, name: str, *, said: bool
) -> None:
    run = run_by(record, name, delay_ms=None)
    device = replace(run.header.device, conditioning="electrical")
    electrical = replace(run, header=run.header.model_copy(update={"device": device}))
    assert ("gp-straddle expects windows as after a tap" in final_statement(electrical)) is said
    assert "expects windows as after a tap" not in final_statement(run)


@pytest.mark.parametrize(
    ("name", "delay_ms", "settings"),
    [
        ("default", (150.0, 5.0), {"hit_delay_ms": [150.0, 5.0]}),
        ("default", None, {"hit_delay_ms": [150.0, 5.0]}),
        ("nr", None, {}),
        ("one-of-another-version", None, {}),
        ("", None, {}),
    ],
)
def test_a_hit_delay_that_was_stated_or_is_of_no_use_is_not_asked_for(
    record: SessionRecord, name: str, delay_ms: tuple[float, float] | None, settings: dict[str, Any]
) -> None:
    assert "hit delay" not in final_statement(run_by(record, name, delay_ms=delay_ms, **settings))


def test_isis_that_count_from_the_impact_need_no_hit_delay(record: SessionRecord) -> None:
    by_default = run_by(record, "default", delay_ms=None)
    header = by_default.header.model_copy(update={"space": DesignSpace(0, 200, reference="impact")})
    assert "hit delay" not in final_statement(replace(by_default, header=header))


def test_trials_in_which_the_fit_had_trouble_are_counted(record: SessionRecord) -> None:
    troubles = tuple(Event(kind="fit", trial=trial, text="no descent") for trial in (0, 2, 2))
    statement = final_statement(replace(record, history=(*troubles, *record.history)))
    assert "The fit had trouble in 2 of 4 trials; isiw show lists them." in statement
    assert "The fit" not in final_statement(record)


def test_a_window_of_two_segments_is_named_so(record: SessionRecord) -> None:
    statement = final_statement(with_estimate(record, segments_ms=(10.0, 30.0, 60.0, 80.0)))
    assert "10–30 ms and 60–80 ms" in statement


def test_a_session_that_is_not_over_says_how_to_go_on(record: SessionRecord) -> None:
    assert "isiw resume" in final_statement(with_estimate(record, stop=False, reason="5 stimuli are left."))


def test_an_exclusion_after_the_estimate_is_said(record: SessionRecord) -> None:
    exclude(record.path, 0, "sneezed")
    statement = final_statement(read_session(record.path))
    assert "1 excluded" in statement
    assert "excluded or included after this estimate" in statement


def test_without_a_trial_there_is_nothing_to_say(record: SessionRecord) -> None:
    empty = type(record)(record.path, record.header, (), (), False)
    assert final_statement(empty) == "No trial has been completed."


def test_where_no_estimate_can_be_read_it_is_said_what_was_given_and_what_is_lost(record: SessionRecord) -> None:
    def said(*history: Any, losses: tuple[str, ...] = ()) -> str:
        return final_statement(type(record)(record.path, record.header, history, losses, False))

    intents = [Intent(trial=number, isi_ms=70.0) for number in range(2)]
    assert said(losses=("Records 1 to 9 are lost.",)) == sentences.nothing_estimated(0, 0, damaged=True)
    assert said(*intents) == sentences.nothing_estimated(0, 2, damaged=False)
    assert said(*intents, losses=("Record 5 is lost.",)).startswith("No outcome can be read, and the log is damaged: 2")
    assert said(*intents, record.table[0]) == sentences.nothing_estimated(1, 2, damaged=False)


def test_a_log_of_which_a_header_is_left_says_how_many_pulses_it_asks_for(record: SessionRecord) -> None:
    cut = type(record)(record.path, record.header, (), ("It was cut off.",), False, end_lost=True)
    assert final_statement(cut).startswith(
        "No trial can be read, and the log is damaged.\nDo: find out, with the stimulator's counter"
    )
    assert "--lost-pulses" in final_statement(cut)
    assert "\nWarning: The end of the log is missing." in final_statement(cut)


def test_the_truth_is_compared_by_f1(record: SessionRecord) -> None:
    window = Window(33, 93)
    assert truth_sentence(record, window) == sentences.truth(window, window, 1.0)
    assert truth_sentence(record, None) == sentences.truth(None, window, 0.0)
    unreported = with_estimate(record, segments_ms=(), probability=0.02)
    assert truth_sentence(unreported, window) == sentences.truth(window, None, 0.0)


def test_every_trial_has_a_row(record: SessionRecord) -> None:
    rows = trial_rows(record)
    assert len(rows) == 4
    assert all(len(row) == len(TRIAL_HEADINGS) for row in rows)
    assert rows[0][2] == "51 µV"
    assert rows[1][2] == "mistrial: background activity"


def test_a_person_unlike_most_is_told_so(record: SessionRecord) -> None:
    shares = {"the width of the window": 0.97, "the EMG floor": 0.4}
    statement = final_statement(with_estimate(record, unusual=shares))
    assert "the width of the window (probability 0.97)" in statement
    assert "EMG floor" not in statement


def test_a_stimulus_without_an_outcome_has_a_row_too(record: SessionRecord) -> None:
    last = len(record.table)
    rows = trial_rows(replace(record, history=(*record.history, Intent(trial=last, isi_ms=70.0))))
    assert rows[-1] == (str(last), "70 ms", "mistrial: outcome unknown", "–")


def test_a_usual_statement_has_at_most_90_words(tmp_path: Path) -> None:
    device = ScriptedDevice(lambda s: Measurement(0.05 + 0.01 * s.trial, s.isi_ms))
    Session(device, scripted_strategy(4), log=tmp_path / "s.mcap").run()
    found: dict[str, Any] = {"end_high_ms": 180.0, "end_beyond": 0.0, "best_isi_ms": (64.2, 51.0, 77.6)}
    found |= {"expected_f1": 0.853, "tap_may_explain": True}
    ends = "Another 10 stimuli would add little: the last 10 added less than 0.02 to the expected F1."
    record = read_session(tmp_path / "s.mcap")
    usual = with_estimate(record, **found, probability=0.99, reason=ends, stop_kind=StopKind.SMALL_GAIN)
    undecided = with_estimate(record, **found, probability=0.6, beforehand=0.69)
    for statement in (final_statement(usual), final_statement(undecided)):
        assert len(statement.split()) <= 90
        for part in ("Do: deliver the tap alone", "(90 % each)", "argest MEP at 64 ms", "Expected F1: 0.85", "4 count"):
            assert part in statement


def test_amplitudes_that_the_law_does_not_expect_are_said_and_leave_it_undecided(record: SessionRecord) -> None:
    doubted = Misfit(law=120.0)
    found = final_statement(with_estimate(record, probability=0.99, segments_ms=(30.0, 90.0), misfit=doubted))
    none = final_statement(with_estimate(record, probability=0.01, segments_ms=(), misfit=doubted))
    for statement in (found, none):
        assert statement.startswith("It is undecided whether there is a window")
        assert statement.count("The MEPs vary otherwise than the law of responses expects") == 1
    right = final_statement(with_estimate(record, probability=0.01, segments_ms=(), misfit=Misfit(2.0, 0.1)))
    assert right.startswith("No window was found")
    assert "Warning: The MEPs vary otherwise" not in right


def test_pulses_alone_that_do_not_fit_the_pairs_are_said_and_the_window_stays(record: SessionRecord) -> None:
    estimate = {"probability": 0.99, "segments_ms": (30.0, 90.0), "misfit": Misfit(law=2.0, curve=60.0)}
    found = with_estimate(record, **estimate)
    statement = final_statement(found)
    assert "The pulses given alone and the pairs do not fit each other" in statement
    assert "undecided" not in statement
    assert "The pulses given alone and the pairs do not fit each other" in summary(found.estimates[-1])
