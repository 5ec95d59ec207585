"""The description of the calls: it is today's, and the server keeps to it whatever it is sent."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from isiw.server import Rules, make_app
from server.serving import TOKEN, client_of

COMMITTED = Path(__file__).parents[2] / "docs" / "lab" / "openapi.json"
FOLDER_OF_NOTHING = "isiw-openapi"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    with client_of(tmp_path_factory.mktemp("described")) as client:
        yield client


def test_the_committed_description_is_todays(tmp_path: Path) -> None:
    today = make_app(tmp_path, Rules(TOKEN)).openapi()
    assert json.loads(COMMITTED.read_text("utf-8")) == today, "run: python docs/write_openapi.py"
