"""Logs of searches for the motor threshold, also as earlier versions wrote them: each opens, and goes on."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import pytest

from isiw.log.threshold import outcomes, read_threshold
from isiw.session import resume_threshold, run_simulated, search_of

FOLDER = Path(__file__).parents[1] / "data" / "logs" / "threshold"
LOGS = sorted(path.name for path in FOLDER.glob("*.mcap*"))
DIGESTS = {"1bcf6c0-bayes.mcap": "0dcf210f786c235fe1403c2eb4479d515818d9ace696b449bbac9e92bcac98ed"}


@pytest.mark.parametrize("name", LOGS)
def test_it_is_what_it_was(name: str) -> None:
    assert hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() == DIGESTS[name]


@pytest.mark.parametrize("name", LOGS)
def test_it_opens_whole_and_goes_on(name: str, tmp_path: Path) -> None:
    shutil.copyfile(FOLDER / name, tmp_path / name)
    record = read_threshold(tmp_path / name)
    assert record.losses == ()
    assert len(outcomes(record)) == len(record.intents) > 5
    with resume_threshold(tmp_path / name) as resumed:
        assert resumed.search.pulses == search_of(record).pulses
        assert resumed.decision().stop
        run_simulated(resumed, print)
    assert len(read_threshold(tmp_path / name).intents) == len(record.intents)
