"""Bodies: JSON as it is, forms for clients that know nothing else, and malformed ones in words."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from isiw.log.record import read_session
from server.serving import PLAN, SETTINGS, SPACE, client_of, created, done, refused

ARABIC_12 = "\u0661\u0662"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("requests")


@pytest.fixture(scope="module")
def client(folder: Path) -> Iterator[httpx.Client]:
    with client_of(folder) as client:
        yield client


def test_a_whole_session_by_forms_is_that_by_json(client: httpx.Client, folder: Path) -> None:
    plan = {**PLAN, "id": "form"}
    done(client.post("/sessions", data={key: v if key == "id" else json.dumps(v) for key, v in plan.items()}))
    asked = done(client.post("/sessions/form/ask", data={"trial": "0", "wait_s": "1"}))
    outcome = {"trial": "0", "isi_ms": str(asked["isi_ms"]), "mep_mv": "0.1"}
    assert done(client.post("/sessions/form/tell", data=outcome))["mep_mv"] == 0.1
    done(client.post("/sessions/form/ask", data={"trial": "1"}))
    done(client.post("/sessions/form/mistrial", data={"trial": "1", "reason": "no impact"}))
    done(client.post("/sessions/form/tell", data={"trial": "2", "isi_ms": "", "mep_mv": "0.02"}))
    done(client.post("/sessions/form/note", data={"text": "a = b & c, 5 µV + 100 %", "key": ""}))
    done(client.post("/sessions/form/close", data={"close": "1"}))
    record = read_session(folder / "form.mcap")
    assert [trial.mep_mv for trial in record.table] == [0.1, None, 0.02]
    assert [event.text for event in record.events] == ["a = b & c, 5 µV + 100 %"]
    assert record.header.space.high_ms == SPACE["high_ms"]
    assert record.header.strategy.settings["particles"] == SETTINGS["particles"]


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (b"{", "application/json", 400),
        (b"\xff", "application/json", 400),
        (b"[]", "application/json", 422),
        (b"null", "application/json", 422),
        (b"", "application/json", 422),
        (b"{}", "text/plain", 415),
        (b"{}", "", 415),
        (b"id=%ff", "application/x-www-form-urlencoded", 400),
        (b"\xff", "application/x-www-form-urlencoded", 400),
        (b"id=a&id=b", "application/x-www-form-urlencoded", 400),
        (b"a=1&" * 100, "application/x-www-form-urlencoded", 400),
        (b"seed=" + b"[" * 50_000, "application/x-www-form-urlencoded", 422),
        (b"[" * 50_000, "application/json", 400),
        (b'{"id": "a", "seed": 1e400}', "application/json", 422),
        (b'{"id": "a", "seed": ' + b"9" * 5000 + b"}", "application/json", 400),
        (b'{"id": "a", "unknown": 1}', "application/json", 422),
        (b'{"id": "a", "space": {"low_ms": NaN}}', "application/json", 422),
        (b'{"id": "a", "visit": {"subject": "\\ud800"}}', "application/json", 400),
        (b'{"id": "a", "seed": 1, "seed": 2}', "application/json", 400),
        (b'{"id": "a", "visit": {"day": 1, "day": 2}}', "application/json", 400),
        (b'id=a&visit={"day":1,"day":2}', "application/x-www-form-urlencoded", 400),
        (b'{"id": "a", "strategy": {"settings": {"x": ' + b"9" * 5000 + b"}}}", "application/json", 400),
        (b"id=a&seed=1_0", "application/x-www-form-urlencoded", 422),
        (f"id=a&seed={ARABIC_12}".encode(), "application/x-www-form-urlencoded", 422),
    ],
)
def test_a_malformed_body_is_refused_in_words_and_begins_nothing(
    client: httpx.Client, folder: Path, body: bytes, kind: str, status: int
) -> None:
    response = client.post("/sessions", content=body, headers={"Content-Type": kind})
    assert (response.status_code, response.json()["ok"]) == (status, False), response.text
    assert response.json()["error"]["message"]
    assert not (folder / "a.mcap.part").exists()


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"strategy": {"name": "defualt"}}, "strategy.name", "default"),
        ({"strategy": {"name": "even", "settings": {"particels": 9}}}, "strategy.settings", "particles"),
        ({"space": {"low_ms": 0, "high_ms": 320}}, "space", "needs its reference, the event that its ISIs count from"),
        ({"space": {"low": 100}}, "space.low", "is unknown; got 100; expected one of high_ms"),
        ({"visit": {"day": 0}}, "visit.day", "at least 1"),
        ({"seed": True}, "seed", "expected a whole number"),
        ({"limits": {"period_s": 60.0}}, None, "limits.period_s does nothing without limits.max_period_pulses"),
        ({"visit": 5}, "visit", "expected a table"),
        ({"limits": {"min_iti_s": 5.0, "max_block_pulses": 3, "rest_s": 2.0}}, None, "so it would have no effect"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_by_the_name_of_its_field(
    client: httpx.Client, folder: Path, changes: dict[str, object], field: str, words: str
) -> None:
    response = client.post("/sessions", json={**PLAN, "id": "b", **changes})
    error = response.json()["error"]
    assert (response.status_code, error["field"]) == (422, field)
    assert words in error["message"]
    assert not (folder / "b.mcap.part").exists()


def test_a_misspelt_field_is_told_before_the_one_that_is_missing_because_of_it(client: httpx.Client) -> None:
    error = refused(client.post("/sessions", json={"idd": "a"}), 422, "InvalidValueError")
    assert error["field"] == "idd"
    assert "is unknown" in error["message"]


def test_a_protocol_with_control_trials_is_refused_as_ask_answers_with_an_isi(client: httpx.Client) -> None:
    plan = {**PLAN, "id": "c", "protocol": {"tms_alone": 0.1}}
    assert "control trials" in refused(client.post("/sessions", json=plan), 422, "InvalidValueError")["message"]


def test_a_trials_number_in_a_header_is_read_as_in_a_body(client: httpx.Client) -> None:
    session = created(client, "f")
    for odd in ("1_0", "+1", "1.0", ARABIC_12, "9" * 5000):
        response = client.get(f"{session}/progress", headers={"Last-Event-ID": odd.encode()})  # type: ignore[arg-type] # sent as it is
        refused(response, 422, "InvalidValueError")


def test_a_setting_may_be_null(client: httpx.Client) -> None:
    plan = {**PLAN, "id": "d", "strategy": {"name": "even", "settings": {"hit_delay_ms": None, "particles": 10}}}
    done(client.post("/sessions", json=plan))
    done(client.post("/sessions/d/close"))
    done(client.post("/sessions/d/resume"))
    done(client.post("/sessions", json=plan))


def test_a_path_that_is_none_is_answered_in_words(client: httpx.Client) -> None:
    created(client, "e")
    refused(client.get("/nowhere"), 404, "NotFound")
    response = client.put("/sessions/e")
    refused(response, 405, "MethodNotAllowed")
    assert response.headers["Allow"] == "GET"
    refused(client.get("/sessions/e/picture", params={"format": "exe"}), 422, "InvalidValueError")
    refused(client.get("/sessions/e?errors=500"), 422, "InvalidValueError")


@pytest.mark.parametrize("name", ["CON", "nul", "aux"])
def test_an_id_that_windows_keeps_for_itself_is_refused(client: httpx.Client, folder: Path, name: str) -> None:
    before = list(folder.iterdir())
    response = client.post("/sessions", json={**PLAN, "id": name})
    assert response.json()["error"]["message"].startswith("a log cannot have this name, which Windows keeps for itself")
    assert list(folder.iterdir()) == before
