"""Several clients of one session: no trial is given to two, and none of them is given one too early."""

from __future__ import annotations

import itertools
import threading
import time
from pathlib import Path
from typing import Any

import httpx
import pytest

from isiw.findings import Kind
from isiw.log.record import read_session
from server.serving import BEARER, NOBODY, PLAN, client_of, created, done, mep_mv, refused, server

PAUSE_S = 0.3


@pytest.fixture
def session(client: httpx.Client) -> str:
    return created(client, client="A")


def asked(client: httpx.Client, session: str, trial: int | None, who: str | None) -> httpx.Response:
    body = {"trial": trial, "client": who}
    return client.post(f"{session}/ask", json={name: value for name, value in body.items() if value is not None})


def outcome(answer: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"trial": answer["trial"], "isi_ms": answer["isi_ms"], "mep_mv": mep_mv(answer["isi_ms"]), **more}


@pytest.mark.slow
@pytest.mark.parametrize("keys", [("A", "B"), ("A", None), (None, None)], ids=str)
def test_two_clients_that_name_the_same_trial_are_not_both_given_it(
    client: httpx.Client, keys: tuple[str | None, str | None], tmp_path: Path
) -> None:
    session = created(client, limits={"min_iti_s": PAUSE_S}, client=keys[0])
    pulses: list[float] = []

    def loop(who: str | None) -> None:
        with httpx.Client(base_url=client.base_url, headers=BEARER, verify=NOBODY, timeout=120.0) as own:
            for trial in range(3):
                response = asked(own, session, trial, who)
                if response.status_code == 200:
                    pulses.append(time.monotonic())
                    own.post(f"{session}/tell", json=outcome(response.json()))

    both = [threading.Thread(target=loop, args=(who,)) for who in keys]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    record = read_session(tmp_path / "P07.mcap")
    assert len(pulses) == len(record.table) > 0
    assert all(after - before > PAUSE_S / 2 for before, after in itertools.pairwise(pulses))


def test_a_trial_of_another_client_is_refused_and_the_same_client_is_answered_as_before(
    client: httpx.Client, session: str
) -> None:
    first = done(asked(client, session, 0, "A"))
    for who in ("B", None):
        error = refused(asked(client, session, 0, who), 409, "OtherClient")
        assert "trial 0 was given to another client" in error["message"]
        assert error["field"] == "client"
    assert done(asked(client, session, 0, "A")) == {**first, "again": True}
    refused(asked(client, session, None, "A"), 409, "TrialOpen")


def test_no_other_client_asks_for_the_trial_that_comes_next(client: httpx.Client, session: str, tmp_path: Path) -> None:
    for who in ("B", None):
        refused(asked(client, session, 0, who), 409, "OtherClient")
        refused(asked(client, session, None, who), 409, "OtherClient")
    assert read_session(tmp_path / "P07.mcap").intents == ()


def test_who_states_no_key_is_given_an_isi_once(client: httpx.Client) -> None:
    session = created(client)
    answer = done(asked(client, session, 0, None))
    assert "by another client" in refused(asked(client, session, 0, None), 409, "TrialOpen")["message"]
    done(client.post(f"{session}/tell", json=outcome(answer)))
    assert done(asked(client, session, 1, None))["again"] is False
    refused(asked(client, session, 1, "A"), 409, "OtherClient")


def test_a_client_that_hangs_up_while_it_waits_begins_no_trial(client: httpx.Client, tmp_path: Path) -> None:
    session = created(client, limits={"min_iti_s": 0.6})
    with pytest.raises(httpx.ReadTimeout):
        httpx.post(f"{client.base_url}{session}/ask", json={"trial": 0}, headers=BEARER, verify=NOBODY, timeout=0.2)
    time.sleep(0.6)
    assert read_session(tmp_path / "P07.mcap").intents == ()
    assert done(asked(client, session, 0, None))["again"] is False


def test_a_session_is_not_begun_by_two_clients(client: httpx.Client, session: str) -> None:
    done(client.post("/sessions", json={**PLAN, "client": "A"}))
    refused(client.post("/sessions", json={**PLAN, "client": "B"}), 409, "OtherClient")
    refused(client.post("/sessions", json=PLAN), 409, "OtherClient")
    assert done(asked(client, session, 0, "A"))["trial"] == 0


def test_a_takeover_ends_the_trial_of_the_earlier_client_and_its_key(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    answer = done(asked(client, session, 0, "A"))
    refused(client.post(f"{session}/resume", json={"client": "B"}), 409, "OtherClient")
    refused(client.post(f"{session}/resume"), 409, "OtherClient")
    for _ in range(2):
        assert done(client.post(f"{session}/resume", json={"client": "B", "takeover": True}))["trials"] == 1
    refused(asked(client, session, 1, "A"), 409, "OtherClient")
    refused(client.post(f"{session}/resume", json={"client": "A"}), 409, "OtherClient")
    refused(client.post(f"{session}/tell", json=outcome(answer, client="A")), 409, "Late")
    assert done(asked(client, session, 1, "B"))["trial"] == 1
    record = read_session(tmp_path / "P07.mcap")
    assert record.table[0].reason is Kind.OUTCOME_UNKNOWN
    assert [event.client for event in record.events if event.kind == "client"] == ["A", "B"]


@pytest.mark.slow
def test_what_a_client_was_given_before_a_takeover_keeps_the_interval(client: httpx.Client) -> None:
    session = created(client, limits={"min_iti_s": 1.0}, client="A")
    done(asked(client, session, 0, "A"))
    done(client.post(f"{session}/resume", json={"client": "B", "takeover": True}))
    response = client.post(f"{session}/ask", json={"trial": 1, "client": "B", "wait_s": 0})
    assert refused(response, 429, "TooEarly")["retry_s"] > 0.5


def test_a_session_that_was_closed_is_resumed_by_any_client(client: httpx.Client, session: str) -> None:
    done(client.post(f"{session}/close"))
    done(client.post(f"{session}/resume", json={"client": "B"}))
    refused(asked(client, session, 0, "A"), 409, "OtherClient")
    assert done(asked(client, session, 0, "B"))["trial"] == 0


@pytest.mark.slow
def test_the_key_outlives_a_server_that_is_killed(tmp_path: Path) -> None:
    with (
        server(tmp_path) as (_, url),
        httpx.Client(base_url=url, headers=BEARER, verify=NOBODY, timeout=120.0) as client,
    ):
        session = created(client, client="A")
        done(asked(client, session, 0, "A"))
    with client_of(tmp_path) as client:
        refused(client.post(f"{session}/resume", json={"client": "B"}), 409, "OtherClient")
        refused(client.post(f"{session}/resume"), 409, "OtherClient")
        assert done(client.post(f"{session}/resume", json={"client": "A"}))["trials"] == 1
        assert done(asked(client, session, 1, "A"))["trial"] == 1


def test_a_refused_outcome_of_an_open_trial_is_in_the_log_once(
    client: httpx.Client, session: str, tmp_path: Path
) -> None:
    answer = done(asked(client, session, 0, "A"))
    for _ in range(2):
        refused(client.post(f"{session}/tell", json=outcome(answer, client="B")), 409, "OtherClient")
        refused(client.post(f"{session}/tell", json=outcome(answer) | {"mep_mv": 60.0}), 422, "InvalidValueError")
        refused(client.post(f"{session}/mistrial", json={"trial": 0, "client": "B"}), 409, "OtherClient")
    notes = [(event.trial, event.text) for event in read_session(tmp_path / "P07.mcap").events if event.kind == "note"]
    assert [trial for trial, _ in notes] == [0, 0, 0]
    assert all(text.startswith("An outcome of trial 0 was refused: ") for _, text in notes)
    assert [words in text for words, (_, text) in zip(("isi_ms=", "mep_mv=60", "mistrial"), notes, strict=True)] == [
        True
    ] * 3
    assert done(client.post(f"{session}/tell", json=outcome(answer, client="A")))["status"] == "accepted"
