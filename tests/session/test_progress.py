"""The live table of a session."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from isiw.session.loop import Session
from isiw.session.progress import PROGRESS_HEADINGS, progress_row
from isiw.session.updates import SessionUpdate
from isiw.strategy.stopping import StopDecision
from isiw.trials import MistrialReason, Status, Trial
from isiw.window import Window, WindowEstimate
from scripted import ScriptedDevice, scripted_strategy


def update_with(estimate: WindowEstimate, trial: Trial) -> SessionUpdate:
    return SessionUpdate(trial, estimate, StopDecision(stop=False, reason=""), 3.0, 17)


def test_progress_tells_trial_isi_mep_window_intervals_and_what_is_left() -> None:
    samples = np.array([[-math.inf, 90.0], [10.0, 95.0], [12.0, math.inf]])
    estimate = WindowEstimate(0.876, Window(10, 95), 10.0, 95.0, edge_samples_ms=samples)
    row = progress_row(update_with(estimate, Trial(3, Status.ACCEPTED, 40.0, isi_ms=41.0, mep_mv=0.0312)))
    assert row == ("3", "40 ms", "31 µV", "0.88", "10–95 ms", "<–12", "90–>", "17")
    assert len(row) == len(PROGRESS_HEADINGS)


def test_progress_of_a_method_without_posterior_has_gaps() -> None:
    trial = Trial(3, Status.MISTRIAL, None, MistrialReason.NO_IMPACT)
    assert progress_row(update_with(WindowEstimate(None, None), trial)) == (
        "3", "TMS alone", "mistrial: no impact", "", "none", "", "", "17"
    )  # fmt: skip


def test_a_tap_alone_is_told_from_tms_alone() -> None:
    tap = Trial(3, Status.ACCEPTED, None, tap_alone=True)
    assert progress_row(update_with(WindowEstimate(None, None), tap))[1:3] == ("tap alone", "–")
    pulse = Trial(3, Status.ACCEPTED, None, mep_mv=0.05)
    assert progress_row(update_with(WindowEstimate(None, None), pulse))[1:3] == ("TMS alone", "50 µV")


@pytest.mark.parametrize(
    ("terminal", "progress", "own", "rows"),
    [
        (True, None, False, 4),
        (True, None, True, 0),
        (True, False, False, 0),
        (False, None, False, 0),
        (False, True, True, 4),
    ],
)
def test_progress_is_shown_in_a_terminal_and_can_be_turned_off_and_on(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    terminal: bool,
    progress: bool | None,
    own: bool,
    rows: int,
) -> None:
    seen: list[SessionUpdate] = []
    session = Session(
        ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap", on_trial=seen.append if own else None
    )
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal)
    session.run(progress=progress, keys=False)
    assert len(capsys.readouterr().out.splitlines()) == rows
    assert len(seen) == (3 if own else 0)
