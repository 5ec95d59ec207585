"""The description of the calls: it is today's, and the server keeps to it whatever it is sent."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from isiw.server import Rules, make_app
from server.serving import BEARER, TOKEN, client_of

COMMITTED = Path(__file__).parents[2] / "docs" / "lab" / "openapi.json"


def test_the_committed_description_is_todays(tmp_path: Path) -> None:
    today = make_app(tmp_path, Rules(TOKEN)).openapi()
    assert json.loads(COMMITTED.read_text("utf-8")) == today, "run: python docs/write_openapi.py"


@pytest.mark.slow
def test_no_call_fails_the_server_or_is_answered_otherwise_than_described(tmp_path: Path) -> None:
    from benchmarks.server_tries import tried  # noqa: PLC0415 - what it imports takes half a second

    with client_of(tmp_path) as client:
        answers, wrong = tried(str(client.base_url), BEARER, examples=4)
    assert wrong == []
    assert sum(answers.values()) > 60
    assert {200, 422} <= set(answers)
