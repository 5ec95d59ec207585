"""Logs with values, keys, records and topics that isiw did not write: an answer or a message, never a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.log_mutations import faults, outcome_of, write_base

from benchmarks import log_mutations

pytestmark = pytest.mark.needs_pictures

CHEAP = (
    ("export", "LOG", "OUT"),
    ("export", "LOG", "OUT", "--pseudonymise"),
    ("timing", "LOG"),
    ("exclude", "LOG", "1", "--reason", "cough"),
    ("include", "LOG", "1"),
    ("threshold", "LOG", "--show"),
    ("interval", "LOG", "--show"),
)
"""Commands that draw nothing and learn nothing; the benchmark has the others as well."""


@pytest.mark.slow
def test_a_hundred_mutated_logs_are_shown_and_resumed_or_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_base(tmp_path, trials=2)
    assert list(faults(tmp_path, 100, seed=1, others=CHEAP)) == []


def test_a_traceback_would_be_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("a fault of isiw")

    monkeypatch.setattr("isiw.log.record.salvage", broken)
    assert "a fault of isiw" in outcome_of("show", str(tmp_path / "s.mcap"))
    assert log_mutations.ABSURD
