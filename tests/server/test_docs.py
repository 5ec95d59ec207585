"""The page about the server: its example runs as it stands there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from isiw.log.record import read_session
from server.serving import TOKEN, client_of

PAGE = Path(__file__).parents[2] / "docs" / "lab" / "server.md"


@pytest.mark.skipif(not (shutil.which("curl") and shutil.which("bash")), reason="needs curl and bash")
def test_the_loop_with_curl_runs_as_it_stands_there(tmp_path: Path) -> None:
    (script,) = (
        block for block in re.findall(r"```sh\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL) if "curl" in block
    )
    with client_of(tmp_path) as client:
        environment = os.environ | {"ISIW_URL": str(client.base_url), "ISIW_TOKEN": TOKEN}
        ran = subprocess.run(  # noqa: S603 - our own script
            [shutil.which("bash") or "", "-c", script],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
    assert '"ok":false' not in ran.stdout
    record = read_session(tmp_path / "P01.mcap")
    assert [trial.mep_mv for trial in record.table.told] == [0.1, 0.11, 0.12]
    assert [event.kind for event in record.events] == ["client", "note", "change"]
    assert [(event.text, event.key) for event in record.events[1:]] == [
        ("coil at 5 mm", "n1"),
        ("coil re-seated", "c1"),
    ]
    assert record.finished
