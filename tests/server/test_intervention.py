"""The log of an intervention among those of a server: what is said of it, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from isiw.intervention import Arm
from isiw.session.afterwards import open_arm
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from pairing.paired import answering, device, intervention, session
from server.serving import PLAN, client_of, done, refused

BEFORE, GIVEN = 3, 8
READ = "", "/estimate", "/decision", "/trials", "/picture"
DRIVEN = "/resume", "/ask", "/tell", "/mistrial", "/note", "/change", "/exclude", "/include", "/close"
BODIES: dict[str, Any] = {
    "/tell": {"trial": GIVEN, "isi_ms": 100.0, "mep_mv": 0.1},
    "/mistrial": {"trial": GIVEN, "reason": "lost"},
    "/exclude": {"trial": 0, "reason": "cough"},
    "/include": {"trial": 0, "reason": "none"},
    "/note": {"text": "the coil"},
    "/change": {"text": "the coil"},
}


@pytest.fixture(params=[Arm.WINDOW, Arm.TMS_ALONE])
def log(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """The log of a concealed intervention that was interrupted between its pairs."""
    rig, usual = device(), answering()

    def answer(stimulus: Stimulus) -> Measurement:
        if stimulus.trial == GIVEN:
            raise KeyboardInterrupt
        return usual(stimulus)

    rig.answer = answer
    with suppress(KeyboardInterrupt):
        session(tmp_path / "P07.mcap", intervention(request.param, before=BEFORE), rig).run()
    return tmp_path / "P07.mcap"


@pytest.fixture
def client(log: Path) -> Iterator[httpx.Client]:
    with client_of(log.parent) as client:
        yield client


def test_nothing_that_would_show_a_concealed_arm_is_read_over_http_until_it_is_opened(
    client: httpx.Client, log: Path
) -> None:
    for path in READ:
        error = refused(client.get(f"/sessions/P07{path}"), 409, "LogError")
        assert "the arm of this intervention is concealed" in error["message"]
        assert not any(words in error["message"] for words in ("window", "outside", "alone"))
    open_arm(log)
    trials = done(client.get("/sessions/P07/trials"))["trials"]
    assert len(trials) == GIVEN + 1


def test_no_call_over_http_drives_or_changes_an_intervention(client: httpx.Client, log: Path) -> None:
    before = {path.name: path.read_bytes() for path in log.parent.iterdir()}
    for path in DRIVEN:
        answer = client.post(f"/sessions/P07{path}", json=BODIES.get(path, {}))
        assert answer.status_code in {404, 409, 422}, (path, answer.text)
        assert answer.json()["ok"] is False
    assert client.get("/sessions/P07/progress").status_code == 409
    refused(client.post("/sessions", json=PLAN), 409, "LogError")
    assert {path.name: path.read_bytes() for path in log.parent.iterdir()} == before
