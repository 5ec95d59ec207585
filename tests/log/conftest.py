from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from isiw.log.headers import Header
from isiw.log.writer import LogWriter
from log.written import make_header, write_trials


@pytest.fixture
def header() -> Header:
    return make_header()


@pytest.fixture
def finished_log(tmp_path: Path, header: Header) -> Path:
    """A closed log of eight trials."""
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, range(8))
    return tmp_path / "s.mcap"


@pytest.fixture
def broken_log(tmp_path: Path, header: Header) -> Path:
    """A log of eight trials as a killed session leaves it: never closed."""
    log = LogWriter.create(tmp_path / "running" / "s.mcap", header)
    write_trials(log, range(8))
    part = tmp_path / "s.mcap.part"
    shutil.copy(tmp_path / "running" / "s.mcap.part", part)
    log.close()
    shutil.rmtree(tmp_path / "running")
    return part
