"""The live table of a session: a row a trial."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from isiw.session.updates import SessionUpdate
from isiw.text import plain
from isiw.trials import Trial
from isiw.window import Interval, WindowEstimate

__all__ = ["PROGRESS_HEADINGS", "aligned", "asked", "outcome", "progress_row", "show_progress"]

PROGRESS_HEADINGS = ("trial", "ISI", "MEP", "P(window)", "window", "start", "end", "left")
"""What `progress_row` holds; start and end are 90 % intervals, left is what the budget still allows."""

_WIDTHS = (5, 9, 30, 9, 14, 8, 8, 4)


def progress_row(update: SessionUpdate) -> tuple[str, ...]:
    """One trial in words and figures, as in `PROGRESS_HEADINGS`.

    Args:
        update: what is known after the trial.
    """
    trial, estimate = update.trial, update.estimate
    found = _found(estimate) if estimate.rests_on_data else ("", "–", "", "")
    return (str(trial.index), asked(trial), outcome(trial), *found, str(update.stimuli_left))


def show_progress(row: Sequence[str]) -> None:
    """Print a row of the table.

    Args:
        row: its cells.
    """
    sys.stdout.write(f"{plain(aligned(row))}\n")
    sys.stdout.flush()


def aligned(row: Sequence[str]) -> str:
    """A row whose cells stand below those of other rows."""
    return "  ".join(cell.ljust(width) for cell, width in zip(row, _WIDTHS, strict=False)).rstrip()


def asked(trial: Trial) -> str:
    """What a trial was to be: its ISI, or which control trial."""
    if trial.commanded_isi_ms is not None:
        return f"{trial.commanded_isi_ms:.4g} ms"
    if trial.tap_alone:
        return "tap alone"
    return "TMS alone" if trial.is_control else "–"


def outcome(trial: Trial) -> str:
    """What came of a trial."""
    if trial.reason is not None:
        return f"mistrial: {trial.reason}"
    text = "–" if trial.mep_mv is None else f"{1e3 * trial.mep_mv:.0f} µV"
    return f"{text} (excluded)" if trial.excluded else text


def _found(estimate: WindowEstimate) -> tuple[str, ...]:
    """Probability, window, start and end; where too little was measured to speak of them, they are not said."""
    start, end = estimate.interval(0.9) or (None, None)
    return (
        "" if estimate.probability is None else f"{estimate.probability:.2f}",
        "none" if estimate.window is None else str(estimate.window),
        _short(start),
        _short(end),
    )


def _short(interval: Interval | None) -> str:
    if interval is None:
        return ""
    low, high = interval
    return f"{'<' if math.isinf(low) else f'{low:.0f}'}–{'>' if math.isinf(high) else f'{high:.0f}'}"
