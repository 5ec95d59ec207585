"""Thirty sessions with an instrument that lies, stalls and hangs up."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks.line_peer import check, run
from benchmarks.pulse_peer import Lie
from benchmarks.remembering import SPACE

import isiw


@pytest.mark.slow
def test_nothing_is_lost_or_given_twice_in_thirty_sessions(tmp_path: Path) -> None:
    counts, lies = Counter[str](), Counter[Lie]()
    for seed in range(30):
        peer, happened = run(tmp_path / f"{seed}.mcap", 30_000 + seed, 6, 0.03)
        counts, lies = counts + happened, lies + peer.happened
    assert counts["trials"] == 180
    assert lies.total() > 20


def test_the_check_notices_what_is_lost_and_what_is_given_twice(tmp_path: Path) -> None:
    peer, _ = run(tmp_path / "log.mcap", 0, 3, 0.0)
    record, limits = isiw.read_session(tmp_path / "log.mcap"), isiw.Limits.of_space(SPACE, min_iti_s=0.0)
    check(peer, record, limits)
    first, *others = peer.ledger
    peer.ledger = [first, *peer.ledger]
    with pytest.raises(AssertionError, match="twice"):
        check(peer, record, limits)
    peer.ledger = others
    with pytest.raises(AssertionError, match="not fired"):
        check(peer, record, limits)
    peer.ledger = [replace(first, isi_ms=199.0), *others]
    with pytest.raises(AssertionError, match="intent"):
        check(peer, record, limits)
