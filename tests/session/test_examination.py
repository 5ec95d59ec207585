"""What a trial does to what is known is the same for every loop, and one call continues any log."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

import isiw
from isiw.errors import LogError
from isiw.log.new_verdicts import exclusion
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Intent
from isiw.log.writer import LogWriter
from isiw.models.particles.prior import Prior
from isiw.session import Recorder, ThresholdRecorder, examination, open_threshold
from isiw.session.assembly import ESTIMATE_VERSION
from isiw.session.examination import WindowExamination, examination_of
from isiw.session.sink import Sink
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.trials import Status, Stimulus, Trial
from log.written import make_header
from scripted import ScriptedDevice, scripted_strategy, told_to


def trial(number: int, mep_mv: float = 0.125) -> Trial:
    return Trial(number, Status.ACCEPTED, 40.0 + number, isi_ms=40.0 + number, mep_mv=mep_mv)


def begun(log: LogWriter) -> WindowExamination:
    """An examination, of which one trial is on disk and not learnt."""
    begun = examination_of(scripted_strategy(9), Sink(log=log))
    begun.intend(Intent.of(Stimulus(0, 40.0), 0.0))
    begun.came(trial(0))
    return begun


def kinds(path: Path) -> list[str]:
    return [type(record).__name__ for record in read_session(path).history]


def test_what_was_interrupted_after_it_was_learnt_is_learnt_once_and_logged_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise LogError("no space left")

    with LogWriter.create(tmp_path / "s.mcap", make_header()) as log:
        examined = begun(log)
        monkeypatch.setattr(examination, "estimate_record", full)
        with pytest.raises(LogError):
            examined.conclude()
        monkeypatch.undo()
        assert examined.conclude() is not None
        assert examined.conclude() is None
    assert told_to(examined.learner.strategy) == ((40.0, 0.125),)
    assert kinds(tmp_path / "s.mcap") == ["Intent", "Trial", "EstimateRecord"]


def test_after_a_verdict_nothing_is_delivered_before_all_trials_are_learnt_again(tmp_path: Path) -> None:
    with LogWriter.create(tmp_path / "s.mcap", make_header()) as log:
        examined = begun(log)
        examined.conclude()
        examined.judge(lambda trials: exclusion(trials, 0))
        assert not examined.intend(Intent.of(Stimulus(1, 41.0), 1.0))
        examined.conclude()
        assert examined.intend(Intent.of(Stimulus(1, 41.0), 1.0))
    assert told_to(examined.learner.strategy) == ()
    assert kinds(tmp_path / "s.mcap") == ["Intent", "Trial", "EstimateRecord", "Event", "EstimateRecord", "Intent"]


def test_one_call_continues_whatever_a_log_is_of(tmp_path: Path) -> None:
    own, threshold, closed = tmp_path / "own.mcap", tmp_path / "rmt.mcap", tmp_path / "s.mcap"
    with isiw.open_session(isiw.make_strategy("even", space=isiw.VALVE_SPACE, seed=2), own) as recorder:
        asked_ms = recorder.ask()
        recorder.tell(asked_ms, 0.1)
        next_ms = recorder.ask()
    with open_threshold(make_threshold_search("five-of-ten", IntensityRange(20, 80)), threshold, min_iti_s=0.0) as hand:
        hand.ask()
    isiw.Session(ScriptedDevice(), scripted_strategy(3), log=closed).run()
    with isiw.resume(own) as continued:
        assert isinstance(continued, Recorder)
        assert [trial.told for trial in continued.trials] == [True, False]
        assert continued.ask() == next_ms
    with isiw.resume(threshold) as continued:
        assert isinstance(continued, ThresholdRecorder)
        assert continued.given == 1
    assert isinstance(isiw.resume(closed, ScriptedDevice(), scripted_strategy(3)), isiw.Session)


def test_a_header_says_what_its_log_is_of_and_one_of_a_threshold_has_no_isis(tmp_path: Path) -> None:
    isiw.open_session(scripted_strategy(3), tmp_path / "own.mcap").close()
    open_threshold(make_threshold_search("bayes", IntensityRange(20, 80)), tmp_path / "rmt.mcap").close()

    def header(name: str) -> Any:
        return json.loads(salvage(tmp_path / name).messages[0].data)

    assert (header("own.mcap")["kind"], header("rmt.mcap")["kind"]) == ("session", "threshold")
    assert header("own.mcap").keys() >= {"belief_version", "engine_version"}
    assert header("rmt.mcap").keys().isdisjoint({"space", "signals", "limits", "strategy"})


def test_another_prior_has_another_belief_version() -> None:
    digest = hashlib.sha256(repr(Prior()).encode()).hexdigest()[:16]
    assert {ESTIMATE_VERSION: digest} == {8: "838bc06b089158cd"}  # of a new prior: the next number, and its digest


def test_an_option_that_a_session_does_not_have_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="min_iti"):
        isiw.Session(ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap", min_iti=5.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="subject"):
        isiw.resume(tmp_path / "s.mcap", ScriptedDevice(), subject="P08")  # type: ignore[call-overload]


def test_a_later_event_of_another_trial_changes_nothing(tmp_path: Path) -> None:
    with LogWriter.create(tmp_path / "s.mcap", make_header()) as log:
        examined = begun(log)
        examined.conclude()
        learner, trials = examined.learner, examined.trials
        assert learner.judged(trials, Event(kind="exclusion", trial=7)) == trials
