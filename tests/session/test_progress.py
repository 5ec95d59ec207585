"""The live table of a session."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from isiw.decision import StopDecision
from isiw.estimate import WindowEstimate
from isiw.findings import Kind
from isiw.log.record import read_session
from isiw.session.console import PROGRESS_HEADINGS, PROGRESS_LEGEND, fitted, progress_row, standing
from isiw.session.loop import Session
from isiw.session.sink import SessionUpdate
from isiw.session.terminal import COLUMNS
from isiw.text.stimuli import STIMULI
from isiw.trials import Status, Trial
from isiw.window import Window
from scripted import SPACE, ScriptedDevice, scripted_strategy


def update_with(estimate: WindowEstimate, trial: Trial) -> SessionUpdate:
    return SessionUpdate(trial, estimate, StopDecision(stop=False, reason=""), 3.0, 17)


def test_progress_tells_trial_isi_mep_window_intervals_and_what_is_left() -> None:
    samples = np.array([[-math.inf, 90.0], [10.0, 95.0], [12.0, math.inf]])
    estimate = WindowEstimate(0.876, Window(10, 95), 10.0, 95.0, edge_samples_ms=samples)
    row = progress_row(update_with(estimate, Trial(3, Status.ACCEPTED, 40.0, isi_ms=41.0, mep_mv=0.0312)))
    assert row == ("3", "40 ms", "31 µV", "0.88", "10–95 ms", "<–12", "90–>", "17")
    assert len(row) == len(PROGRESS_HEADINGS)


def test_progress_of_a_method_without_posterior_has_gaps() -> None:
    trial = Trial(3, Status.MISTRIAL, None, Kind.NO_IMPACT)
    assert progress_row(update_with(WindowEstimate(None, None), trial)) == (
        "3", "TMS alone", "mistrial: no impact", "", "–", "", "", "17"
    )  # fmt: skip


def test_a_tap_alone_is_told_from_tms_alone() -> None:
    tap = Trial(3, Status.ACCEPTED, None, tap_alone=True)
    assert progress_row(update_with(WindowEstimate(None, None), tap))[1:3] == ("tap alone", "–")
    pulsed = progress_row(update_with(WindowEstimate(None, None), tap), STIMULI["electrical"])
    assert pulsed[1] == "electrical pulse alone"
    pulse = Trial(3, Status.ACCEPTED, None, mep_mv=0.05)
    assert progress_row(update_with(WindowEstimate(None, None), pulse))[1:3] == ("TMS alone", "50 µV")


def test_the_longest_row_and_the_legend_fit_80_columns_and_terminals_obey_nothing_in_them() -> None:
    row = ("99999", "\x1b[2J123.5 ms", "mistrial: a reason that is much too long", "0.99", "100–200 ms, 210–300 ms")
    assert len(fitted((*row, "<–123", "123–>", "99999"))) <= COLUMNS
    assert fitted(row).startswith("99999 123.5 ms  mistrial: a reason that is… 0.99 100–200 m…")
    assert all(len(line) < COLUMNS for line in PROGRESS_LEGEND)


def window_update(window: Window | None, *, told: int = 9) -> SessionUpdate:
    grid = SPACE.grid_ms
    profile = 0.01 + 0.1 * np.exp(-(((grid - 100.0) / 30.0) ** 2))
    quantiles = np.stack([profile, profile, profile])
    estimate = WindowEstimate(0.9, window, grid_ms=grid, profile_quantiles_mv=quantiles, pairs=told)
    trial = Trial(3, Status.ACCEPTED, 40.0, isi_ms=41.0, mep_mv=0.0312)
    return SessionUpdate(trial, estimate, StopDecision(stop=False, reason=""), 35.0, 17, 104.0)


def test_a_line_draws_the_profile_with_the_window_and_tells_what_is_next_and_left() -> None:
    line = standing(window_update(Window(80.0, 120.0)), SPACE)
    assert line.endswith("▁ 200 ms  next 35 ms, 17 left, ~1:44 min")
    assert len(line) < COLUMNS
    inside = line[line.index("[") + 1 : line.index("]")]
    assert len(inside) == sum(80.0 <= isi_ms < 120.0 for isi_ms in np.linspace(0, 200, 28))
    assert "█" in inside
    assert "█" not in line.replace(inside, "")


def test_a_line_without_a_window_has_no_brackets_and_without_a_profile_no_signs() -> None:
    assert "[" not in standing(window_update(None), SPACE)
    bare = SessionUpdate(Trial(0, Status.ACCEPTED, 4.0, isi_ms=4.0, mep_mv=1.0), WindowEstimate(None, None),
                         StopDecision(stop=False, reason=""), None, 17)  # fmt: skip
    assert standing(bare, SPACE) == "17 left"


@pytest.mark.parametrize(
    ("terminal", "progress", "own", "rows"),
    [
        (True, None, False, 6),
        (True, None, True, 0),
        (True, False, False, 0),
        (False, None, False, 0),
        (False, True, True, 6),
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


@pytest.mark.parametrize("error", [UnicodeEncodeError("ascii", "µ", 0, 1, "not there"), BrokenPipeError()])
def test_a_table_that_cannot_be_shown_any_more_ends_no_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    rows: list[object] = []

    def show(row: object) -> None:
        rows.append(row)
        if len(rows) == 2:
            raise error

    monkeypatch.setattr("isiw.session.console.show_progress", show)
    session = Session(ScriptedDevice(), scripted_strategy(5), log=tmp_path / "s.mcap")
    session.run(progress=True, keys=False)
    record = read_session(tmp_path / "s.mcap")
    assert (len(rows), len(record.table)) == (2, 5)
    assert ["cannot be shown any more" in event.text for event in record.events if event.kind == "fault"] == [True]
