"""The logged search for the motor threshold: on disk first, within its limits, and the same after an interruption."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

import isiw
from isiw.devices.clock import VirtualClock
from isiw.devices.info import DeviceInfo
from isiw.errors import DeviceError, InvalidValueError, LimitExceededError, LogError
from isiw.log.pulses import earlier_pulse_ages
from isiw.log.schema import Intent, PulseOutcome, ThresholdEstimateRecord
from isiw.session import ThresholdRecorder, open_session, open_threshold, read_threshold, resume_threshold
from isiw.session.threshold import search_of
from isiw.strategy.threshold import IntensityRange, MaximumLikelihood, ThresholdSearch, make_threshold_search
from isiw.studies.threshold import open_simulated, run_simulated
from logs import damage
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy

SIMULATED = DeviceInfo("nobody", "impact", simulated=True)
SPACE = IntensityRange(20, 80)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "t.mcap"


def search(method: str = "maximum-likelihood") -> ThresholdSearch:
    return make_threshold_search(method, SPACE)


def opened(log: Path, method: str = "maximum-likelihood", max_pulses: int = 100) -> ThresholdRecorder:
    return open_threshold(search(method), log, device=SIMULATED, subject="P1", max_pulses=max_pulses)


def test_an_interval_in_milliseconds_is_refused_before_a_log_is_begun(log: Path) -> None:
    with pytest.raises(InvalidValueError, match="Is it in ms"):
        open_threshold(search(), log, device=SIMULATED, min_iti_s=5000.0)
    assert list(log.parent.iterdir()) == []


def answer(recorder: ThresholdRecorder, pulses: int) -> list[float]:
    asked = []
    for _ in range(pulses):
        asked.append(recorder.ask())
        recorder.tell(0.2 if asked[-1] >= 52.5 else 0.01)
    return asked


def killed(log: Path) -> Path:
    """What would be left of an open log if its process were killed now."""
    left = log.with_name("killed.mcap.part")
    shutil.copyfile(log.with_name(f"{log.name}.part"), left)
    return left.with_suffix("")


def test_what_is_asked_is_on_disk_before_it_can_be_given_and_told_before_it_is_learnt(log: Path) -> None:
    with opened(log) as recorder:
        asked = recorder.ask()
        (intent,) = read_threshold(killed(log)).intents
        assert (intent.intensity_pct_mso, intent.isi_ms) == (asked, None)
        recorder.tell(0.2)
        assert [type(entry) for entry in read_threshold(killed(log)).history] == [
            Intent,
            PulseOutcome,
            ThresholdEstimateRecord,
        ]
    record = read_threshold(log)
    assert record.finished
    assert record.losses == ()
    assert (record.header.subject, record.header.intensities) == ("P1", SPACE)


@pytest.mark.parametrize("method", ["bayes", "maximum-likelihood", "five-of-ten"])
def test_a_search_that_was_killed_asks_what_it_would_have_asked(log: Path, method: str) -> None:
    with opened(log, method) as recorder:
        answer(recorder, 4)
        left = killed(log)
        expected = answer(recorder, 3)
    with resume_threshold(left) as resumed:
        assert resumed.given == 4
        assert answer(resumed, 3) == expected
        assert resumed.estimate() == recorder.estimate()
    assert search_of(read_threshold(left)).pulses == recorder.search.pulses


def test_a_pulse_without_an_outcome_counts_and_is_not_learnt(log: Path) -> None:
    with opened(log) as recorder:
        answer(recorder, 2)
        recorder.ask()
        left = killed(log)
    with resume_threshold(left) as resumed:
        assert resumed.given == 3
        assert resumed.outcomes[-1].reason == "outcome unknown"
        assert len(resumed.search.pulses) == 2


def test_pulses_that_a_damaged_log_has_lost_count(log: Path) -> None:
    with opened(log) as recorder:
        answer(recorder, 4)
    for block in range(10, 13):  # a header, then intent, outcome and estimate of each
        damage(log, block)
    assert len(read_threshold(log).losses) >= 3
    with resume_threshold(log) as resumed:
        assert resumed.given == 4
        assert (resumed.outcomes[-1].reason, resumed.outcomes[-1].intensity_pct_mso) == ("outcome unknown", None)


def test_no_more_pulses_are_given_than_the_limit(log: Path) -> None:
    with opened(log, max_pulses=3) as recorder:
        answer(recorder, 2)
        recorder.ask()
        recorder.lost("the coil slipped")
        with pytest.raises(LimitExceededError, match="limit of 3 pulses"):
            recorder.ask()
    with resume_threshold(log) as resumed, pytest.raises(LimitExceededError):
        resumed.ask()


def test_pulses_keep_their_distance_the_first_one_too(log: Path) -> None:
    clock = FakeRealClock()
    with open_threshold(search(), log, clock=clock, min_iti_s=7.0) as recorder:
        began_s = clock.now_s()
        answer(recorder, 2)
        assert clock.now_s() - began_s >= 14.0


def test_nobody_real_is_stimulated_by_a_clock_that_does_not_wait(log: Path) -> None:
    with pytest.raises(DeviceError, match="virtual clock"):
        open_threshold(search(), log, clock=VirtualClock())
    assert not log.exists()


@pytest.mark.parametrize("mep_mv", [math.nan, -0.1, 80.0])
def test_a_value_that_cannot_be_is_not_logged_and_can_be_told_right(log: Path, mep_mv: float) -> None:
    with opened(log) as recorder:
        asked = recorder.ask()
        with pytest.raises(InvalidValueError):
            recorder.tell(mep_mv)
        assert recorder.ask() == asked
        recorder.tell(0.08)
    assert len(read_threshold(log).history) == 3


def test_a_first_amplitude_in_volts_is_not_logged_and_can_be_told_right(log: Path) -> None:
    with opened(log) as recorder:
        recorder.ask()
        with pytest.raises(InvalidValueError, match=r"Is it in V\? Multiply by 1000"):
            recorder.tell(0.0012)
        recorder.tell(1.2)
    assert [outcome.mep_mv for outcome in recorder.outcomes] == [1.2]


def test_after_it_is_closed_nothing_is_asked(log: Path) -> None:
    with opened(log) as recorder:
        answer(recorder, 1)
    with pytest.raises(LogError, match="the log is closed"):
        recorder.ask()


def test_an_error_after_it_was_closed_stays_the_error_it_is(log: Path) -> None:
    def loop() -> None:
        with opened(log) as recorder:
            recorder.close()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        loop()


def test_nothing_is_told_that_was_not_asked(log: Path) -> None:
    with opened(log) as recorder:
        with pytest.raises(InvalidValueError, match=r"waiting for an outcome"):
            recorder.tell(0.1)
        with pytest.raises(InvalidValueError, match=r"waiting for an outcome"):
            recorder.lost("why")
        recorder.ask()
        with pytest.raises(InvalidValueError, match="reason"):
            recorder.lost(" ")


def test_an_excluded_pulse_does_not_count_any_more(log: Path) -> None:
    with opened(log) as recorder:
        answer(recorder, 3)
        recorder.exclude(1, "the hand moved")
        assert len(recorder.search.pulses) == 2
        with pytest.raises(InvalidValueError, match=r"got 1; .*: 0, 2"):
            recorder.exclude(1, "again")
    with resume_threshold(log) as resumed:
        assert [outcome.reason for outcome in resumed.outcomes] == ["", "the hand moved", ""]
        assert resumed.estimate() == recorder.estimate()


def test_no_window_is_learnt_from_the_log_of_a_threshold_and_no_threshold_from_that_of_a_window(
    log: Path, tmp_path: Path
) -> None:
    with opened(log) as recorder:
        answer(recorder, 1)
    with pytest.raises(LogError, match="isiw threshold"):
        isiw.read_session(log)
    with pytest.raises(LogError, match="isiw threshold"):
        isiw.resume(log, ScriptedDevice())
    window = tmp_path / "w.mcap"
    open_session(scripted_strategy(3), window).close()
    with pytest.raises(LogError, match="search for a window"):
        read_threshold(window)
    with pytest.raises(LogError, match="search for a window"):
        resume_threshold(window)


def test_a_log_is_never_overwritten_and_the_way_on_is_named(log: Path) -> None:
    with opened(log) as recorder:
        answer(recorder, 1)
    with pytest.raises(LogError, match=r"isiw threshold .*t\.mcap --resume"):
        opened(log)


def test_pulses_on_the_way_to_a_threshold_count_among_a_persons_earlier_ones(log: Path) -> None:
    with open_threshold(search(), log, clock=FakeRealClock(), subject="P1") as recorder:
        answer(recorder, 4)
    assert len(earlier_pulse_ages(log.parent, "P1", 3600.0, but=log.with_name("other.mcap")).ages_s) == 4


def test_a_simulated_search_goes_on_as_if_it_had_not_been_interrupted(log: Path, tmp_path: Path) -> None:
    def interrupt(text: str) -> None:
        if text.startswith("Pulse 5"):
            raise KeyboardInterrupt

    interrupted = tmp_path / "interrupted.mcap"
    with open_simulated(search(), log, cohort="hand", seed=3) as recorder:
        run_simulated(recorder, lambda _text: None)
    with pytest.raises(KeyboardInterrupt), open_simulated(search(), interrupted, cohort="hand", seed=3) as recorder:
        run_simulated(recorder, interrupt)
    assert len(search_of(read_threshold(interrupted)).pulses) == 5
    with resume_threshold(interrupted) as recorder:
        run_simulated(recorder, lambda _text: None)
    assert search_of(read_threshold(interrupted)).pulses == search_of(read_threshold(log)).pulses


def test_a_search_with_pulses_of_its_own_is_refused(log: Path) -> None:
    used = search()
    used.tell(50, 0.1)
    with pytest.raises(InvalidValueError, match="not this log's"):
        open_threshold(used, log)


def test_something_else_than_a_search_is_refused(log: Path) -> None:
    with pytest.raises(InvalidValueError, match="cannot use this search"):
        open_threshold(MaximumLikelihood(), log)  # type: ignore[arg-type] # what is tested


def test_a_method_of_ones_own_is_logged_and_needed_again(log: Path) -> None:
    def own() -> ThresholdSearch:
        return ThresholdSearch("my own", MaximumLikelihood(), SPACE)

    with open_threshold(own(), log, device=SIMULATED) as recorder:
        answer(recorder, 3)
        expected = recorder.ask()
    with pytest.raises(InvalidValueError, match="method is unknown"):
        resume_threshold(log)
    with pytest.raises(InvalidValueError, match="another range"):
        resume_threshold(log, ThresholdSearch("my own", MaximumLikelihood(), IntensityRange(20, 90)))
    with resume_threshold(log, own()) as resumed:
        assert resumed.ask() == expected


def test_a_pulse_is_excluded_by_a_whole_number(log: Path) -> None:
    with opened(log) as recorder:
        answer(recorder, 2)
        with pytest.raises(InvalidValueError, match="the number of a pulse must be a whole number"):
            recorder.exclude(True, "a cough")
