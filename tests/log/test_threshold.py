"""Logs of searches for the motor threshold, also as earlier versions wrote them: each opens, and goes on."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import pytest

from isiw.errors import LogError
from isiw.log.salvage import salvage
from isiw.log.schema import PulseOutcome
from isiw.log.writer import LogWriter
from isiw.session import open_threshold, read_threshold, resume_threshold
from isiw.session.threshold import search_of
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.studies.threshold import run_simulated

FOLDER = Path(__file__).parents[1] / "data" / "logs" / "threshold"
LOGS = sorted(path.name for path in FOLDER.glob("*.mcap*"))
DIGESTS = {"1bcf6c0-bayes.mcap": "0dcf210f786c235fe1403c2eb4479d515818d9ace696b449bbac9e92bcac98ed"}


@pytest.mark.parametrize("name", LOGS)
def test_it_is_what_it_was(name: str) -> None:
    assert hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() == DIGESTS[name]


@pytest.fixture
def begun(tmp_path: Path) -> Path:
    """The log of a search, of which one pulse was asked and none was answered."""
    search = make_threshold_search("bayes", IntensityRange(20, 80))
    with open_threshold(search, tmp_path / "t.mcap", min_iti_s=0.0) as recorder:
        recorder.ask()
    return tmp_path / "t.mcap"


def test_a_log_without_an_outcome_yet_is_in_the_way_as_one_of_a_threshold(begun: Path) -> None:
    with pytest.raises(LogError, match=r"isiw threshold .*t\.mcap --resume"):
        open_threshold(make_threshold_search("bayes", IntensityRange(20, 80)), begun)


def test_a_second_record_of_a_pulse_is_left_out_and_told(begun: Path) -> None:
    record = read_threshold(begun)
    with LogWriter.continuing(begun, salvage(begun), record.header) as log:
        for mep_mv in (0.1, 0.2):
            log.append(PulseOutcome(trial=0, intensity_pct_mso=50.0, mep_mv=mep_mv))
    again = read_threshold(begun)
    assert [outcome.mep_mv for outcome in again.outcomes] == [0.1]
    assert again.losses == ("A second record of trial 0 is left out.",)


@pytest.mark.parametrize("name", LOGS)
def test_it_opens_whole_and_goes_on(name: str, tmp_path: Path) -> None:
    shutil.copyfile(FOLDER / name, tmp_path / name)
    record = read_threshold(tmp_path / name)
    assert record.losses == ()
    assert len(record.outcomes) == len(record.intents) > 5
    with resume_threshold(tmp_path / name) as resumed:
        assert resumed.search.pulses == search_of(record).pulses
        assert resumed.decision().stop
        run_simulated(resumed, print)
    assert len(read_threshold(tmp_path / name).intents) == len(record.intents)
