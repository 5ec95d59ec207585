"""Sessions over HTTP: the same logs as any other, and nothing is told twice or lost."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Never

import httpx
import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError, LogError
from isiw.findings import Kind
from isiw.log.record import read_session
from isiw.log.schema import Record
from isiw.log.writer import encode
from isiw.server.answers import Refusal
from isiw.server.driven import DrivenSession
from isiw.server.requests import AskRequest, CreateRequest, TellRequest
from isiw.server.sessions import Sessions
from isiw.session.afterwards import exclude
from isiw.session.examination import Examination
from isiw.strategy.catalogue import make_strategy
from isiw.summary import IN_DOUBT, JUDGED_SINCE, TOO_FEW
from server.serving import PLAN, SETTINGS, SEVERAL, SPACE, client_of, created, done, mep_mv, refused, told


@pytest.fixture
def session(client: httpx.Client) -> str:
    return created(client)


def notes_in(log: Path) -> list[tuple[str, str | None]]:
    return [(event.text, event.key) for event in read_session(log).events if event.kind == "note"]


def without_key(topic: str, record: Record) -> bytes:
    """A record as it was written before events had a field for a key."""
    return json.dumps(
        {name: value for name, value in json.loads(encode(topic, record)).items() if name != "key"}
    ).encode()


def test_a_whole_session_leaves_the_log_of_a_session(client: httpx.Client, session: str, tmp_path: Path) -> None:
    asked = told(client, session, 6)
    assert done(client.get(f"{session}/decision"))["stop"] is True
    closed = done(client.post(f"{session}/close"))
    assert (closed["open"], closed["trials"]) == (False, 6)
    record = read_session(tmp_path / "P07.mcap")
    assert record.finished
    assert (record.header.subject, record.header.visit.muscle) == ("P07", "FCR")
    assert [trial.isi_ms for trial in record.table.told] == asked


def test_it_asks_what_the_same_strategy_asks_in_process(client: httpx.Client, session: str) -> None:
    alone = make_strategy("even", space=DesignSpace(**SPACE), seed=7, **SETTINGS)  # type: ignore[arg-type]
    asked = []
    for _ in range(4):
        asked.append(alone.ask())
        alone.tell(asked[-1], mep_mv(asked[-1]))
    assert told(client, session, 4) == asked


def test_the_strategy_is_told_the_intensity_that_the_visit_states(client: httpx.Client, tmp_path: Path) -> None:
    visit = PLAN["visit"] | {"intensity_pct_rmt": 110.0}
    created(client, "P08", visit=visit)
    assert read_session(tmp_path / "P08.mcap").header.strategy.settings["intensity_pct_rmt"] == 110.0


def test_pairs_of_several_intensities_are_asked_and_logged_with_what_was_set(
    client: httpx.Client, tmp_path: Path
) -> None:
    session = created(client, "P08", **SEVERAL)
    set_pct_rmt, outcomes = (90.0, 110.0, 100.0, None), []
    for given in set_pct_rmt:  # the third was delivered with another intensity than asked, the fourth with none known
        asked = done(client.post(f"{session}/ask"))
        outcomes.append({"trial": asked["trial"], "isi_ms": asked["isi_ms"], "mep_mv": 0.1, "intensity_pct_rmt": given})
        assert asked["intensity_pct_rmt"] == (90.0, 110.0)[asked["trial"] % 2]
        assert done(client.get(session))["open_intensity_pct_rmt"] == asked["intensity_pct_rmt"]
        if given is not None:
            told = done(client.post(f"{session}/tell", json=outcomes[-1]))
            assert done(client.post(f"{session}/tell", json=outcomes[-1])) == told
    error = refused(client.post(f"{session}/tell", json=outcomes[3]), 422, "InvalidValueError")
    assert (error["field"], "intensity_pct_rmt = 110" in error["expected"]) == ("intensity_pct_rmt", True)
    done(client.post(f"{session}/mistrial", json={"trial": 3}))
    refused(client.post(f"{session}/tell", json=outcomes[1] | {"intensity_pct_rmt": 90}), 409, "OtherOutcome")
    record = read_session(tmp_path / "P08.mcap")
    assert [intent.intensity_pct_rmt for intent in record.intents] == [90.0, 110.0, 90.0, 110.0]
    assert [trial.intensity_pct_rmt for trial in record.table] == [None, 110.0, 100.0, 110.0]
    assert [trial.status for trial in record.table] == ["accepted", "accepted", "accepted", "mistrial"]


@pytest.mark.parametrize("most", [None, 100])
def test_an_intensity_beyond_the_limits_is_refused_before_there_is_a_session(
    client: httpx.Client, tmp_path: Path, most: float | None
) -> None:
    plan = {**PLAN, **SEVERAL, "limits": {"max_intensity_pct_rmt": most}}
    assert "110 % RMT" in refused(client.post("/sessions", json=plan), 422, "InvalidValueError")["got"]
    assert not list(tmp_path.iterdir())


def test_the_intent_is_on_disk_before_the_answer(client: httpx.Client, session: str, tmp_path: Path) -> None:
    answer = done(client.post(f"{session}/ask"))
    assert [intent.isi_ms for intent in read_session(tmp_path / "P07.mcap").intents] == [answer["isi_ms"]]


def test_an_open_trial_is_asked_for_again_only_by_its_number_as_it_may_have_been_delivered(
    client: httpx.Client,
) -> None:
    session, own = created(client, client="A"), {"client": "A"}
    first = done(client.post(f"{session}/ask", json=own))
    assert first["again"] is False
    error = refused(client.post(f"{session}/ask", json=own), 409, "TrialOpen")
    assert "trial=0" in error["remedy"]
    assert done(client.post(f"{session}/ask", json={"trial": 0, **own})) == {**first, "again": True}
    refused(client.post(f"{session}/ask", json={"trial": 1, **own}), 409, "WrongTrial")


def test_the_same_outcome_told_again_is_one_trial_and_answered_as_at_first(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    outcome = {"trial": 0, "isi_ms": done(client.post(f"{session}/ask"))["isi_ms"], "mep_mv": 0.1}
    first = done(client.post(f"{session}/tell", json=outcome))
    told(client, session, 2)
    assert done(client.post(f"{session}/tell", json=outcome)) == first
    assert len(read_session(tmp_path / "P07.mcap").table) == 3


def test_another_outcome_is_refused_with_what_is_recorded(client: httpx.Client, session: str) -> None:
    isi_ms = told(client, session, 1)[0]
    error = refused(
        client.post(f"{session}/tell", json={"trial": 0, "isi_ms": isi_ms, "mep_mv": 0.9}), 409, "OtherOutcome"
    )
    assert f"isi_ms={isi_ms}" in error["expected"]
    refused(client.post(f"{session}/mistrial", json={"trial": 0}), 409, "OtherOutcome")


def test_a_mistrial_counts_with_its_reason_and_is_one_when_told_again(client: httpx.Client, session: str) -> None:
    done(client.post(f"{session}/ask"))
    lost = {"trial": 0, "reason": "no impact"}
    first = done(client.post(f"{session}/mistrial", json=lost))
    assert (first["status"], first["reason"]) == ("mistrial", "no impact")
    assert done(client.post(f"{session}/mistrial", json=lost)) == first
    assert done(client.get(session))["trials"] == 1


def test_what_was_not_asked_for_has_no_outcome(client: httpx.Client, session: str) -> None:
    refused(client.post(f"{session}/tell", json={"trial": 0, "isi_ms": 50, "mep_mv": 0.1}), 409, "NotAsked")
    refused(client.post(f"{session}/mistrial", json={"trial": 0}), 409, "NotAsked")
    done(client.post(f"{session}/ask"))
    refused(client.post(f"{session}/tell", json={"trial": 1, "isi_ms": 50, "mep_mv": 0.1}), 409, "NotAsked")


def test_tms_alone_is_told_without_being_asked(client: httpx.Client, session: str, tmp_path: Path) -> None:
    alone = {"trial": 0, "isi_ms": None, "mep_mv": 0.02}
    first = done(client.post(f"{session}/tell", json=alone))
    assert done(client.post(f"{session}/tell", json=alone)) == first
    assert read_session(tmp_path / "P07.mcap").table[0].commanded_isi_ms is None


def test_tms_alone_at_an_intensity_is_told_logged_and_one_when_told_again(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    outcome = {"trial": 0, "isi_ms": None, "mep_mv": 0.9, "intensity_pct_rmt": 120}
    assert done(client.post(f"{session}/tell", json=outcome)) == done(client.post(f"{session}/tell", json=outcome))
    refused(client.post(f"{session}/tell", json=outcome | {"intensity_pct_rmt": 110}), 409, "OtherOutcome")
    assert done(client.get(f"{session}/trials"))["trials"][0]["intensity_pct_rmt"] == 120.0
    assert [trial.intensity_pct_rmt for trial in read_session(tmp_path / "P07.mcap").table] == [120.0]


def test_pulses_that_were_given_before_are_known_before_the_first_ask_and_after_resuming(
    client: httpx.Client, tmp_path: Path
) -> None:
    earlier = {"mep_mv": [0.02, 0.9, 1.4], "intensity_pct_rmt": [95, 115, 130]}
    plan = {"earlier": earlier, "limits": {"min_iti_s": 0.0, "max_pulses": 4}}
    said = refused(client.post("/sessions", json={**PLAN, "id": "P08", **plan}), 422, "InvalidValueError")
    assert "at least 9" in said["expected"]
    session = created(client, "P08", strategy={"name": "even", "settings": {**SETTINGS, "max_trials": 1}}, **plan)
    done(client.post(f"{session}/close"))
    done(client.post(f"{session}/resume", json={}))
    assert [trial.intensity_pct_rmt for trial in read_session(tmp_path / "P08.mcap").header.earlier] == [95, 115, 130]
    assert len(told(client, session, 1)) == 1
    refused(client.post(f"{session}/ask"), 409, "LimitExceededError")
    uneven = {"mep_mv": [0.02], "intensity_pct_rmt": [95, 115]}
    assert (
        "1 and 2"
        in refused(client.post("/sessions", json={**PLAN, "id": "P09", "earlier": uneven}), 422, "InvalidValueError")[
            "message"
        ]
    )
    parts = {"mep_mv": [0.02], "intensity_pct_rmt": [1.2]}
    said = refused(client.post("/sessions", json={**PLAN, "id": "P09", "earlier": parts}), 422, "InvalidValueError")
    assert "Multiply by 100" in said["remedy"]
    assert not (tmp_path / "P09.mcap").exists()


def test_tms_alone_that_was_refused_stays_open_until_it_is_told_rightly(client: httpx.Client, session: str) -> None:
    alone = {"trial": 0, "isi_ms": None, "mep_mv": 60.0}
    refused(client.post(f"{session}/tell", json=alone), 422, "InvalidValueError")
    for request in ({}, {"trial": 0}, {"trial": 1}):
        error = refused(client.post(f"{session}/ask", json=request), 409, "TrialOpen")
        assert "TMS alone" in error["message"]
    done(client.post(f"{session}/tell", json={**alone, "mep_mv": 0.06}))
    assert done(client.post(f"{session}/ask"))["trial"] == 1


def test_a_tap_alone_is_told_without_being_asked_and_uses_up_no_budget(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    tap = {"trial": 0, "isi_ms": 40.0, "mep_mv": 0.05, "pulse": False}
    first = done(client.post(f"{session}/tell", json=tap))
    assert done(client.post(f"{session}/tell", json=tap)) == first
    refused(client.post(f"{session}/tell", json=tap | {"pulse": True}), 409, "OtherOutcome")
    assert done(client.get(session))["told"] == 0
    trial = read_session(tmp_path / "P07.mcap").table[0]
    assert (trial.tap_alone, trial.commanded_isi_ms, trial.isi_ms, trial.mep_mv) == (True, None, 40.0, 0.05)
    assert done(client.post(f"{session}/ask"))["trial"] == 1


def test_no_window_is_named_where_too_little_was_told(client: httpx.Client, session: str) -> None:
    def estimate() -> dict[str, object]:
        answer = done(client.get(f"{session}/estimate"))
        return {name: answer[name] for name in ("text", "probability", "segments_ms", "start_ms", "expected_f1")}

    nothing: dict[str, object] = {"probability": None, "segments_ms": [], "start_ms": None, "expected_f1": None}
    told(client, session, 2)
    assert estimate() == {"text": f"{TOO_FEW}", **nothing}
    done(client.post(f"{session}/close"))
    assert estimate() == {"text": f"{TOO_FEW}", **nothing}
    done(client.post(f"{session}/resume"))
    told(client, session, 1)
    assert estimate()["probability"] is not None


def test_a_slip_is_refused_by_its_field_and_can_be_put_right(client: httpx.Client, session: str) -> None:
    isi_ms = done(client.post(f"{session}/ask"))["isi_ms"]
    missing = refused(client.post(f"{session}/tell", json={"trial": 0, "isi_ms": isi_ms}), 422, "InvalidValueError")
    assert missing["field"] == "mep_mv"
    text = {"trial": 0, "isi_ms": isi_ms, "mep_mv": "0.1"}
    assert refused(client.post(f"{session}/tell", json=text), 422, "InvalidValueError")["field"] == "mep_mv"
    refused(client.post(f"{session}/tell", json={**text, "mep_mv": 2e-5}), 422, "InvalidValueError")
    refused(client.post(f"{session}/tell", json={**text, "isi_ms": 900.0, "mep_mv": 0.1}), 422, "OutOfSpaceError")
    done(client.post(f"{session}/tell", json={**text, "mep_mv": 0.1}))


def test_doubts_come_with_the_answer_and_are_logged(client: httpx.Client, session: str, tmp_path: Path) -> None:
    for number in range(3):
        done(client.post(f"{session}/ask"))
        answer = done(client.post(f"{session}/mistrial", json={"trial": number, "reason": "no impact"}))
    assert "air supply" in answer["doubts"][0]
    assert [event.kind for event in read_session(tmp_path / "P07.mcap").events] == ["doubt"]


@pytest.mark.slow
def test_the_inter_trial_interval_is_waited_for_or_the_client_told_how_long_it_is(client: httpx.Client) -> None:
    begun_s = time.monotonic()  # the interval counts from the creation of the session on
    session = created(client, limits={"min_iti_s": 1.0})
    done(client.post(f"{session}/ask"))
    assert time.monotonic() - begun_s > 0.95
    done(client.post(f"{session}/mistrial", json={"trial": 0}))
    response = client.post(f"{session}/ask", json={"wait_s": 0})
    assert 0 < refused(response, 429, "TooEarly")["retry_s"] <= 1.0
    assert response.headers["Retry-After"] == "1"
    assert done(client.get(session))["open_trial"] is None


def test_limits_hold_and_their_refusal_keeps_the_session_open(client: httpx.Client) -> None:
    session = created(client, limits={"min_iti_s": 0.0, "max_pulses": 2})
    told(client, session, 2)
    refused(client.post(f"{session}/ask"), 409, "LimitExceededError")
    assert done(client.get(session))["open"] is True


def test_without_limits_those_of_a_configuration_file_hold(client: httpx.Client) -> None:
    begun = done(client.post("/sessions", json={"id": "P08", "strategy": {"settings": {"particles": 50}}}))
    assert begun["wait_s"] > 4
    refused(client.post("/sessions/P08/ask", json={"wait_s": 0.0}), 429, "TooEarly")


def test_an_excluded_trial_counts_again_once_it_is_included_and_both_may_be_repeated(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    told(client, session, 3)
    for _ in range(2):
        assert done(client.post(f"{session}/exclude", json={"trial": 1, "reason": "cough"}))["told"] == 2
    assert [row["excluded"] for row in done(client.get(f"{session}/trials"))["trials"]] == [False, True, False]
    for _ in range(2):
        assert done(client.post(f"{session}/include", json={"trial": 1}))["told"] == 3
    refused(client.post(f"{session}/exclude", json={"trial": 9}), 422, "InvalidValueError")
    assert [event.kind for event in read_session(tmp_path / "P07.mcap").events] == ["exclusion", "inclusion"]


def test_a_late_repetition_of_an_exclusion_or_an_inclusion_with_a_key_changes_nothing(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    told(client, session, 3)
    out, back = ({"trial": 1, "reason": "cough", "key": "k1"}, {"trial": 1, "key": "k2"})
    assert done(client.post(f"{session}/exclude", json=out))["told"] == 2
    assert done(client.post(f"{session}/include", json=back))["told"] == 3
    assert done(client.post(f"{session}/exclude", json=out))["told"] == 3
    done(client.post(f"{session}/close"))
    done(client.post(f"{session}/resume"))
    assert done(client.post(f"{session}/exclude", json=out))["told"] == 3
    assert done(client.post(f"{session}/exclude", json={"trial": 1}))["told"] == 2
    assert done(client.post(f"{session}/include", json=back))["told"] == 2
    refused(client.post(f"{session}/exclude", json=out | {"trial": 2}), 409, "OtherKey")
    refused(client.post(f"{session}/include", json=back | {"key": "k1"}), 409, "OtherKey")
    refused(client.post(f"{session}/exclude", json={"trial": 9, "key": "k3"}), 422, "InvalidValueError")
    events = [(event.kind, event.key) for event in read_session(tmp_path / "P07.mcap").events if event.key]
    assert events == [("exclusion", "k1"), ("inclusion", "k2")]


def test_what_is_so_already_is_remembered_with_its_key(client: httpx.Client, session: str) -> None:
    told(client, session, 3)
    done(client.post(f"{session}/exclude", json={"trial": 1}))
    for told_now in (2, 3):
        assert done(client.post(f"{session}/exclude", json={"trial": 1, "key": "k1"}))["told"] == told_now
        assert done(client.post(f"{session}/include", json={"trial": 1}))["told"] == 3


def test_an_id_that_is_another_sessions_on_other_systems_is_refused(client: httpx.Client, tmp_path: Path) -> None:
    created(client, "P07a")
    if (tmp_path / "p07A.mcap.part").exists():
        pytest.skip("the disk itself takes them for one")
    refused(client.post("/sessions", json={**PLAN, "id": "p07A"}), 409, "Exists")
    assert [path.name for path in tmp_path.iterdir()] == ["P07a.mcap.part"]


def test_a_note_with_a_key_is_logged_once_also_after_resuming(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    remark = {"text": "coil moved: 1 = 2 & 5 µV", "key": "n1"}
    for _ in range(2):
        done(client.post(f"{session}/note", json=remark))
    done(client.post(f"{session}/close"))
    done(client.post(f"{session}/resume"))
    done(client.post(f"{session}/note", json=remark))
    assert notes_in(tmp_path / "P07.mcap") == [("coil moved: 1 = 2 & 5 µV", "n1")]


def test_a_change_with_a_key_is_logged_once_and_named_in_the_log(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    told(client, session, 2)
    for _ in range(2):
        done(client.post(f"{session}/change", json={"text": "coil re-seated", "key": "c1"}))
    changes = [event for event in read_session(tmp_path / "P07.mcap").events if event.kind == "change"]
    assert [(event.trial, event.text) for event in changes] == [(1, "coil re-seated")]


@pytest.mark.parametrize(("call", "text"), [("change", "coil moved"), ("change", "break"), ("note", "another")])
def test_a_key_that_something_else_has_is_refused_and_swallows_nothing(
    client: httpx.Client, session: str, tmp_path: Path, call: str, text: str
) -> None:
    told(client, session, 2)
    done(client.post(f"{session}/note", json={"text": "break", "key": "1"}))
    error = refused(client.post(f"{session}/{call}", json={"text": text, "key": "1"}), 409, "OtherKey")
    assert (error["field"], error["expected"]) == ("key", "note: break")
    done(client.post(f"{session}/{call}", json={"text": text, "key": "2"}))
    events = [(event.kind, event.text, event.key) for event in read_session(tmp_path / "P07.mcap").events]
    assert events == [("note", "break", "1"), (call, text, "2")]


def test_a_note_whose_text_ends_like_a_key_swallows_no_later_one(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    done(client.post(f"{session}/note", json={"text": "as in the plan (key a1)"}))
    done(client.post(f"{session}/close"))
    done(client.post(f"{session}/resume"))
    done(client.post(f"{session}/note", json={"text": "coil moved", "key": "a1"}))
    assert notes_in(tmp_path / "P07.mcap") == [("as in the plan (key a1)", None), ("coil moved", "a1")]


def test_a_key_that_an_older_log_has_in_the_notes_text_is_still_recognised(
    client: httpx.Client, session: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as older:
        older.setattr("isiw.log.writer.encode", without_key)
        done(client.post(f"{session}/note", json={"text": "coil moved (key n1)"}))
    done(client.post(f"{session}/close"))
    done(client.post(f"{session}/resume"))
    for text, key in (("coil moved", "n1"), ("again", "n2")):
        done(client.post(f"{session}/note", json={"text": text, "key": key}))
    assert notes_in(tmp_path / "P07.mcap") == [("coil moved (key n1)", "n1"), ("again", "n2")]


def test_the_same_creation_once_more_is_answered_as_at_first_until_something_was_asked(client: httpx.Client) -> None:
    begun = done(client.post("/sessions", json=PLAN))
    assert done(client.post("/sessions", json=PLAN)) == begun
    refused(client.post("/sessions", json={**PLAN, "seed": 8}), 409, "Exists")
    told(client, "/sessions/P07", 1)
    assert "resume" in refused(client.post("/sessions", json=PLAN), 409, "Exists")["remedy"]


def test_a_closed_session_can_be_looked_at_and_goes_on_once_it_is_resumed(client: httpx.Client, session: str) -> None:
    told(client, session, 3)
    estimate = done(client.get(f"{session}/estimate"))
    rows = done(client.get(f"{session}/trials"))
    for _ in range(2):
        assert done(client.post(f"{session}/close"))["open"] is False
    assert done(client.get(f"{session}/estimate")) == estimate
    assert done(client.get(f"{session}/trials")) == rows
    refused(client.post(f"{session}/ask"), 409, "NotOpen")
    assert done(client.post(f"{session}/resume"))["trials"] == 3
    assert len(told(client, session, 1)) == 1


def test_what_was_excluded_in_a_closed_log_makes_its_answers_outdated(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    told(client, session, 5)
    closed = done(client.post(f"{session}/close"))
    assert closed["state"] == "ENDED"
    assert done(client.get(session)) == closed
    answers = [session, f"{session}/estimate", f"{session}/decision"]
    assert [done(client.get(answer))["judged_since"] for answer in answers] == [False] * 3
    exclude(tmp_path / "P07.mcap", 2, "coughed")
    assert [done(client.get(answer))["judged_since"] for answer in answers] == [True] * 3
    assert JUDGED_SINCE in done(client.get(f"{session}/estimate"))["text"]


def test_after_a_restart_the_limits_hold_that_were_logged(tmp_path: Path) -> None:
    with client_of(tmp_path) as client:
        session = created(client, limits={"min_iti_s": 0.0, "max_pulses": 3})
        told(client, session, 3)
    with client_of(tmp_path) as client:
        assert done(client.get("/sessions"))["sessions"] == [{"id": "P07", "open": False}]
        done(client.post(f"{session}/resume"))
        refused(client.post(f"{session}/ask"), 409, "LimitExceededError")


def test_who_resumes_an_open_session_does_not_know_what_came_of_its_open_trial(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    isi_ms = done(client.post(f"{session}/ask"))["isi_ms"]
    assert done(client.post(f"{session}/resume"))["trials"] == 1
    late = {"trial": 0, "isi_ms": isi_ms, "mep_mv": 0.1}
    for _ in range(2):
        assert "note" in refused(client.post(f"{session}/tell", json=late), 409, "Late")["remedy"]
    record = read_session(tmp_path / "P07.mcap")
    assert record.table[0].reason is Kind.OUTCOME_UNKNOWN
    assert [event.text for event in record.events] == [
        f"An outcome of trial 0 came too late and is not used: isi_ms={isi_ms} mep_mv=0.1"
    ]


def test_who_closes_a_session_makes_its_open_trial_a_mistrial(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    done(client.post(f"{session}/ask"))
    closed = done(client.post(f"{session}/close"))
    assert (closed["open"], closed["trials"], closed["open_trial"]) == (False, 1, None)
    assert read_session(tmp_path / "P07.mcap").table[0].reason is Kind.OUTCOME_UNKNOWN


@pytest.mark.parametrize("other", [{"pulse": False}, {"isi_sd_ms": 2.0}, {"background_rms_uv": 3.0}])
def test_an_outcome_that_differs_in_one_value_is_refused_by_its_name(
    client: httpx.Client, session: str, other: dict[str, object]
) -> None:
    outcome = {"trial": 0, "isi_ms": done(client.post(f"{session}/ask"))["isi_ms"], "mep_mv": 0.1}
    for _ in range(2):
        done(client.post(f"{session}/tell", json=outcome))
    error = refused(client.post(f"{session}/tell", json=outcome | other), 409, "OtherOutcome")
    name, value = min(other.items())
    assert f"{name}={value}" in error["got"]
    assert name not in error["expected"]


def test_what_breaks_a_log_closes_its_session(
    client: httpx.Client, session: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise LogError("the log cannot be written: no space left")

    monkeypatch.setattr(Examination, "intend", full)
    refused(client.post(f"{session}/ask"), 409, "LogError")
    monkeypatch.undo()
    refused(client.post(f"{session}/ask"), 409, "NotOpen")
    assert done(client.post(f"{session}/resume"))["open"] is True


def test_a_trial_that_was_logged_and_could_not_be_learnt_closes_its_session(
    client: httpx.Client, session: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusing(*_: object) -> None:
        raise InvalidValueError("not to be learnt")

    isi_ms = done(client.post(f"{session}/ask"))["isi_ms"]
    outcome = {"trial": 0, "isi_ms": isi_ms, "mep_mv": 0.1}
    monkeypatch.setattr("isiw.strategy.strategy.Strategy.learn", refusing)
    assert "not to be learnt" in refused(client.post(f"{session}/tell", json=outcome), 500, "InternalError")["message"]
    monkeypatch.undo()
    refused(client.post(f"{session}/tell", json=outcome), 409, "NotOpen")
    done(client.post(f"{session}/resume"))
    assert done(client.post(f"{session}/tell", json=outcome))["mep_mv"] == 0.1


def test_a_call_that_waited_for_one_that_broke_the_session_is_told_that_it_is_not_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusing(*_: object) -> Never:
        raise InvalidValueError("not to be learnt")

    sessions = Sessions(tmp_path)
    sessions.create(CreateRequest.model_validate(PLAN))
    session = sessions.opened("P07")
    with session.alone():
        asked = session.ask(AskRequest())
    monkeypatch.setattr("isiw.strategy.strategy.Strategy.learn", refusing)
    kinds = []
    for _ in range(2):
        with pytest.raises(Refusal) as caught, session.alone():
            session.tell(TellRequest(trial=0, isi_ms=asked.isi_ms, mep_mv=0.1))
        kinds.append((caught.value.status, caught.value.kind))
    assert kinds == [(500, "InternalError"), (409, "NotOpen")]


def test_a_session_that_cannot_be_closed_as_the_server_ends_is_told_and_keeps_no_other_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def failing(_: DrivenSession) -> Never:
        monkeypatch.undo()
        raise ZeroDivisionError

    with client_of(tmp_path) as client:
        for name in ("P07", "P08"):
            created(client, name)
        monkeypatch.setattr(DrivenSession, "close", failing)
    assert "The session P07 was not closed (ZeroDivisionError: ). It can be resumed." in capsys.readouterr().err
    assert (tmp_path / "P08.mcap").exists()


def test_what_nobody_foresaw_is_an_answer_in_words(
    client: httpx.Client, session: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(Examination, "intend", broken)
    assert "ZeroDivisionError" in refused(client.post(f"{session}/ask"), 500, "InternalError")["message"]


def test_only_so_many_sessions_are_open_at_once(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.server.sessions.MOST_OPEN", 1)
    session = created(client, "A")
    refused(client.post("/sessions", json={**PLAN, "id": "B"}), 409, "TooManyOpen")
    done(client.post(f"{session}/close"))
    created(client, "B")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_a_session_is_drawn(client: httpx.Client, session: str, kind: str, begins: bytes) -> None:
    told(client, session, 3)
    picture = client.get(f"{session}/picture", params={"format": kind})
    assert (picture.status_code, picture.content[:5]) == (200, (begins + picture.content[4:5])[:5])


def test_what_is_believed_can_be_asked_for_before_anything_is_told(client: httpx.Client, session: str) -> None:
    estimate = done(client.get(f"{session}/estimate"))
    assert len(estimate["grid_ms"]) == len(estimate["profile_mv"]) == 201
    assert done(client.get(f"{session}/decision"))["stop"] is False


def test_realised_isis_in_doubt_are_refused_until_they_are_confirmed(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    for number in range(6):
        asked_ms = done(client.post(f"{session}/ask"))["isi_ms"]
        outcome = {"trial": number, "isi_ms": max(0.0, asked_ms - 60), "mep_mv": mep_mv(asked_ms)}
        response = client.post(f"{session}/tell", json=outcome)
        if response.status_code != 200:
            break
    error = refused(response, 409, "InDoubt")
    assert error["field"] == "confirm"
    estimate = done(client.get(f"{session}/estimate"))
    assert (estimate["text"], estimate["segments_ms"], estimate["probability"]) == (f"{IN_DOUBT}", [], None)
    answer = done(client.post(f"{session}/tell", json=outcome | {"confirm": True}))
    assert done(client.post(f"{session}/tell", json=outcome | {"confirm": True})) == answer
    assert done(client.get(session))["told"] == number + 1
    assert [event.kind for event in read_session(tmp_path / "P07.mcap").events].count("note") == 1


def test_trials_in_doubt_are_excluded_by_the_client_that_has_reported_them_wrongly(
    client: httpx.Client, session: str
) -> None:
    doubts: list[str] = []
    while not any(f"{IN_DOUBT}" in each for each in doubts):
        answer = done(client.post(f"{session}/ask"))
        wrong = {
            "trial": answer["trial"],
            "isi_ms": max(0.0, answer["isi_ms"] - 60),
            "mep_mv": 0.1 + answer["trial"] / 100,
        }
        doubts += done(client.post(f"{session}/tell", json=wrong))["doubts"]
    rows = done(client.get(f"{session}/trials"))["trials"]
    for row in rows:
        if row["excluded"]:
            done(client.post(f"{session}/exclude", json={"trial": row["trial"], "reason": "reported wrongly"}))
    answer = done(client.post(f"{session}/ask"))
    done(client.post(f"{session}/tell", json={"trial": answer["trial"], "isi_ms": answer["isi_ms"], "mep_mv": 0.1}))
