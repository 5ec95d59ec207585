"""What is written after a trial beyond the estimate: what is predicted, and why the next ISI is asked."""

from __future__ import annotations

import json
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import EstimateRecord, decode
from isiw.log.writer import encode
from isiw.session.examination import estimate_record
from isiw.session.loop import Session
from isiw.session.resuming import open_session
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.choice import Asked, candidate_isis
from isiw.strategy.course import Course
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Measurement
from known import instance, known
from scripted import SPACE, ScriptedDevice


def strategy(trials: int = 6) -> Strategy:
    return make_strategy(space=SPACE, seed=1, max_trials=trials, particles=200)


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    device = ScriptedDevice(
        lambda s: Measurement(0.02 + 0.013 * s.trial, s.isi_ms, background_rms_uv=50.0 if s.trial == 4 else 2.0)
    )
    log = tmp_path_factory.mktemp("estimate_record") / "s.mcap"
    Session(device, strategy(7), log=log).run()
    return read_session(log)


def test_the_scores_of_all_candidates_are_logged_with_the_isi_that_they_chose(record: SessionRecord) -> None:
    chosen = [e for e in record.estimates if e.chosen_by == "acquisition"]
    assert chosen
    for estimate in chosen:
        assert list(estimate.scored_ms) == candidate_isis(SPACE).tolist()
        score = estimate.scores[estimate.scored_ms.index(known(estimate.next_isi_ms))]
        assert score == max(estimate.scores)


def test_it_is_logged_what_chose_an_isi(record: SessionRecord) -> None:
    assert record.table[4].reason is not None
    by = [e.chosen_by for e in record.estimates]
    assert by[4] == "again"
    assert record.estimates[4].scores == record.estimates[3].scores
    assert by[-1] == ""
    initial = {e.trial + 1 for e in record.estimates if e.chosen_by == "initial"}
    assert all(e.scores == () for e in record.estimates if e.trial + 1 in initial)


def test_asking_and_predicting_change_no_ask() -> None:
    watched, unwatched = strategy(), strategy()
    for mep_mv in (0.02, 0.3):
        assert watched.ask() == unwatched.ask()
        for each in (watched, unwatched):
            each.tell(each.ask(), mep_mv)
        known(watched.prediction_mv())
        estimate_record(watched, 0, watched.decision(), watched.ask())
    assert watched.ask() == unwatched.ask()


def test_a_fallback_is_no_choice_of_the_scores(monkeypatch: pytest.MonkeyPatch) -> None:
    late = strategy()
    while not (late.choice and late.choice.by == "acquisition"):
        late.tell(late.ask(), 0.02)
        late.ask()
    late.tell(late.ask(), 0.02)
    go, chosen = threading.Event(), Course.chosen
    monkeypatch.setattr(Course, "chosen", lambda *of: chosen(*of) if go.wait(30) else ())
    isi_ms = late.ask(deadline_s=0.0)
    go.set()
    assert known(late.choice).by == "fallback"
    written = estimate_record(late, 0, late.decision(), isi_ms)
    assert (written.chosen_by, written.scores) == ("fallback", ())


def test_a_lab_with_its_own_loop_has_the_prediction_but_no_next_isi(tmp_path: Path) -> None:
    with open_session(strategy(), tmp_path / "own.mcap") as session:
        session.tell(session.ask(), 0.05)
    (estimate,) = read_session(tmp_path / "own.mcap").estimates
    assert estimate.predicted_high_mv
    assert (estimate.next_isi_ms, estimate.chosen_by, estimate.scores) == (None, "", ())


def test_an_estimate_from_before_there_were_scores_is_read(record: SessionRecord) -> None:
    written = json.loads(encode("/estimate", record.estimates[3]))
    for name in ("predicted_low_mv", "predicted_high_mv", "chosen_by", "scored_ms", "scores"):
        del written[name]
    old = instance(EstimateRecord, decode("/estimate", json.dumps(written).encode()))
    assert (old.scores, old.chosen_by, old.predicted_low_mv) == ((), "", ())


def test_a_score_that_is_not_finite_is_kept_as_such() -> None:
    asked = strategy()
    asked.tell(asked.ask(), 0.02)
    asked.ask()
    choice = known(asked.choice)
    scores = candidate_isis(SPACE) * float("nan")
    scored = replace(choice, by="acquisition", scores=scores)
    asked._asked = Asked(scored)  # noqa: SLF001 - no acquisition function gives one here
    written = encode("/estimate", estimate_record(asked, 0, asked.decision(), choice.isi_ms))
    assert np.isnan(instance(EstimateRecord, decode("/estimate", written)).scores).all()
