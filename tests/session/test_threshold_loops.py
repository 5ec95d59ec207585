"""An operator at the keyboard: what is typed is taken as it is meant, or refused."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from isiw.devices.info import DeviceInfo
from isiw.errors import ConfigError, InvalidValueError, LimitExceededError
from isiw.log.pulses import pulse_ages
from isiw.log.salvage import salvage
from isiw.session import ThresholdRecorder, open_threshold, read_threshold, resume_threshold
from isiw.session.threshold import search_of
from isiw.session.threshold_loops import amplitude_of, run_by_hand
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.studies.threshold import open_simulated, run_simulated
from isiw.subjects.thresholds import StimulatedResponder, threshold_cohort
from known import known


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[ThresholdRecorder]:
    search = make_threshold_search("maximum-likelihood", IntensityRange(20, 80), pulses=4)
    with open_threshold(search, tmp_path / "t.mcap", device=DeviceInfo("nobody", "impact", simulated=True)) as opened:
        yield opened


def typed(recorder: ThresholdRecorder, *answers: str) -> tuple[list[str], list[str]]:
    """The questions and what was said, where an operator types these answers."""
    questions, said, left = list[str](), list[str](), iter(answers)

    def read(question: str) -> str:
        questions.append(question)
        try:
            return next(left)
        except StopIteration:
            raise EOFError from None

    run_by_hand(recorder, read, said.append)
    return questions, said


@pytest.mark.parametrize(
    ("text", "mep_mv"),
    [
        ("0.08", 0.08),
        ("80 uV", 0.08),
        ("80µV", 0.08),
        (" .5 mV ", 0.5),
        ("0,12", 0.12),
        ("5 mv", 5.0),
        ("0", 0.0),
        ("1,200 mV", 1.2),
        ("1.2 uV", 0.0012),
        ("1200 uV", 1.2),
    ],
)
def test_amplitudes_are_taken_with_their_unit(text: str, mep_mv: float) -> None:
    assert amplitude_of(text) == pytest.approx(mep_mv)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("80", "needs its unit"),
        ("", "not a valid answer"),
        ("-1", "not a valid answer"),
        ("nan", "not a valid answer"),
        ("0.1 V", "not a valid answer"),
        ("1,200 uV", "without a separator"),
        ("1.200 µV", "without a separator"),
    ],
)
def test_what_is_no_amplitude_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(InvalidValueError, match=complaint):
        amplitude_of(text)


def test_the_operator_answers_until_the_search_is_over(recorder: ThresholdRecorder) -> None:
    questions, said = typed(recorder, "n", "Y", "0.02", "200 uV")
    assert [outcome.mep_mv for outcome in recorder.outcomes] == [None, None, 0.02, 0.2]
    assert [outcome.response for outcome in recorder.outcomes] == [False, True, None, None]
    assert recorder.decision().stop
    assert questions[0] == "Pulse 1: set 45 % MSO, give one pulse. MEP: "
    assert questions[-1].startswith("The search is over.")
    assert "Resting motor threshold" in said[-1]


def test_a_slip_is_told_and_asked_again(recorder: ThresholdRecorder) -> None:
    questions, said = typed(recorder, "80", "0.00001", "what", "80 uV")
    assert len(recorder.outcomes) == 1
    assert questions[0] == questions[1] == questions[2] == questions[3]
    assert sum("Nothing was logged" in text for text in said) == 3


def test_an_answer_can_be_taken_back_and_a_pulse_can_be_lost(recorder: ThresholdRecorder) -> None:
    typed(recorder, "u", "0.01", "u", "x", "q", "0.01")
    assert [outcome.reason for outcome in recorder.outcomes] == [
        "taken back by the operator",
        "lost, said the operator",
    ]
    assert recorder.search.pulses == ()


def test_what_is_taken_back_is_the_last_pulse_and_no_earlier_one_where_that_was_lost(
    recorder: ThresholdRecorder,
) -> None:
    _, said = typed(recorder, "0.2", "0.08", "u", "n", "x", "u")
    assert [bool(outcome.reason) for outcome in recorder.outcomes] == [False, True, False, True]
    assert any(text.startswith("Pulse 2 (") and "MSO, 0.08 mV) no longer counts." in text for text in said)
    assert "no last answer to take back" in said[-1]


def test_the_answer_that_ended_the_search_can_be_taken_back_at_once_and_later(
    recorder: ThresholdRecorder, tmp_path: Path
) -> None:
    questions, _ = typed(recorder, "n", "y", "n", "y", "u", "y", "0.1", "")
    assert [bool(outcome.reason) for outcome in recorder.outcomes] == [False, False, False, True, False]
    assert "Enter ends, u takes the last answer back" in questions[-1]
    recorder.close()
    with resume_threshold(tmp_path / "t.mcap") as resumed:
        assert resumed.decision().stop
        typed(resumed, "u", "q")
        assert not resumed.decision().stop


def test_the_last_answer_before_a_limit_can_be_taken_back_too(tmp_path: Path) -> None:
    search = make_threshold_search("bayes", IntensityRange(20, 80))
    nobody = DeviceInfo("nobody", "impact", simulated=True)
    with open_threshold(search, tmp_path / "t.mcap", device=nobody, max_pulses=2) as recorder:
        with pytest.raises(LimitExceededError):
            typed(recorder, "n", "y", "u")
        assert [bool(outcome.reason) for outcome in recorder.outcomes] == [False, True]
        with pytest.raises(LimitExceededError):
            typed(recorder)


def test_where_the_operator_ends_the_search_the_pulse_that_was_asked_was_not_given(
    recorder: ThresholdRecorder, tmp_path: Path
) -> None:
    typed(recorder, "n", "q")
    recorder.close()
    log = tmp_path / "t.mcap"
    assert len(pulse_ages(salvage(log)).ages_s) == read_threshold(log).given == 1
    with resume_threshold(log) as resumed:
        assert [outcome.reason for outcome in resumed.outcomes] == [""]
        typed(resumed, "y")
    assert read_threshold(log).given == 3


def test_without_anybody_at_the_keyboard_it_ends_and_goes_on_later(recorder: ThresholdRecorder, tmp_path: Path) -> None:
    typed(recorder, "n")
    recorder.close()
    with resume_threshold(tmp_path / "t.mcap") as resumed:
        assert [outcome.reason for outcome in resumed.outcomes] == ["", "outcome unknown"]


def test_a_simulated_person_is_stimulated_to_the_end(tmp_path: Path) -> None:
    said = list[str]()
    with open_simulated(
        make_threshold_search("bayes", IntensityRange(20, 100)), tmp_path / "s.mcap", cohort="hand", seed=3
    ) as recorder:
        decision = run_simulated(recorder, said.append)
    assert decision.stop
    assert len(said) == recorder.given
    assert (recorder.estimate().sd_pct_mso or 9.0) <= 2.0


def test_a_log_that_does_not_say_who_is_simulated_is_refused(recorder: ThresholdRecorder) -> None:
    recorder.header = recorder.header.model_copy(update={"config": {"isiw_threshold": {"seed": 3}}})
    with pytest.raises(ConfigError, match="who is simulated"):
        run_simulated(recorder, print)


def test_where_nobody_is_simulated_nobody_answers(recorder: ThresholdRecorder) -> None:
    with pytest.raises(ConfigError, match="no simulated person"):
        run_simulated(recorder, print)


@pytest.mark.slow
def test_a_hot_spot_is_sought_by_hand_with_every_place_on_disk_before_it_is_read(tmp_path: Path) -> None:
    person = threshold_cohort("hand", 1, 6)[0].begin(1)
    at = float(round(1.2 * person.person.rmt_pct_mso))
    search = make_threshold_search("hot-spot", IntensityRange(20, at), stop_sd_mm=6.0)
    with open_threshold(search, tmp_path / "t.mcap", device=DeviceInfo("nobody", "impact", simulated=True)) as opened:
        opened.ask()
        opened.tell(person.respond(at, *known(opened.place_mm)))
        opened.ask()
        opened.lost("the coil slipped")
        opened.ask()
        place_mm = opened.place_mm
    record = read_threshold(tmp_path / "t.mcap")
    assert record.intents[-1].place_mm == place_mm
    assert [outcome.reason for outcome in record.outcomes] == ["", "the coil slipped"]
    with resume_threshold(tmp_path / "t.mcap") as resumed:
        questions, said = typed(resumed, "y", "q")
        assert f"set {at:g} % MSO, coil " in questions[0]
        assert "the hot spot is found by amplitudes" in said[1]
        run_simulated_by(resumed, person)
        x_mm, y_mm = known(resumed.estimate().hot_spot_mm)
        assert resumed.decision().stop
        assert resumed.given < 30
    assert math.hypot(x_mm - person.person.hot_spot.x_mm, y_mm - person.person.hot_spot.y_mm) < 10
    assert str(search_of(read_threshold(tmp_path / "t.mcap")).estimate()).startswith("Hot spot: ")


def run_simulated_by(recorder: ThresholdRecorder, person: StimulatedResponder) -> None:
    while not recorder.decision().stop:
        recorder.tell(person.respond(recorder.ask(), *known(recorder.place_mm)))
