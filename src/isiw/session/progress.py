"""The live table of a session: a row a trial, and below it a line that says how it stands. All fits 80 columns."""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Sequence
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.sentences import asked, interval_cell, outcome
from isiw.session.sink import SessionUpdate
from isiw.session.terminal import COLUMNS, columns, folded, is_terminal
from isiw.text import plain
from isiw.text.stimuli import TAP, StimulusWords

PROGRESS_HEADINGS: Final = ("trial", "ISI", "MEP", "P", "window", "start", "end", "left")
"""What `progress_row` holds; start and end are 90 % intervals, left is what the budget still allows."""

PROGRESS_LEGEND: Final = (
    "P: probability of a window. start, end: 90 % intervals of its edges [ms],",
    "< before and > after the range of ISIs. left: stimuli that are still allowed.",
)
"""What the headings and signs of the table mean."""

SPARKS: Final = "▁▂▃▄▅▆▇█"
MOST_SPARKS: Final = 28

_WIDTHS = (5, 9, 27, 4, 10, 7, 7, 4)


def progress_row(update: SessionUpdate, first: StimulusWords = TAP) -> tuple[str, ...]:
    """One trial in words and figures, as in `PROGRESS_HEADINGS`.

    Args:
        update: what is known after the trial.
        first: what the conditioning stimulus is called.
    """
    trial, estimate = update.trial, update.estimate
    found = _found(estimate) if estimate.rests_on_data else ("", "–", "", "")
    return (str(trial.index), asked(trial, first), outcome(trial), *found, str(update.stimuli_left))


def show_progress(row: Sequence[str]) -> None:
    """Print a row of the table."""
    sys.stdout.write(f"{_short_of(fitted(row), _most())}\n")
    sys.stdout.flush()


def show_legend() -> None:
    """Print what comes before the first row: what the headings mean, and the headings."""
    legend = " ".join(PROGRESS_LEGEND) if _most() < COLUMNS else "\n".join(PROGRESS_LEGEND)
    sys.stdout.write(f"{folded(legend)}\n")
    show_progress(PROGRESS_HEADINGS)


def _most() -> int:
    """How many columns a row may have: where a terminal is narrower than the table, its last cells are cut off."""
    return columns() if is_terminal(sys.stdout) else COLUMNS


def aligned(row: Sequence[str]) -> str:
    """A row whose cells stand below those of other rows."""
    return " ".join(cell.ljust(width) for cell, width in zip(row, _WIDTHS, strict=False)).rstrip()


def fitted(row: Sequence[str]) -> str:
    """The same within 80 columns: what is too long for its column is cut short."""
    return aligned([_short_of(plain(cell), width) for cell, width in zip(row, _WIDTHS, strict=False)])


def _short_of(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 1]}…"


def standing(update: SessionUpdate, space: DesignSpace) -> str:
    """How a session stands, in a line: the expected MEP over the ISIs, [ ] around the window, what is next and left."""
    following = "" if update.next_isi_ms is None else f"next {update.next_isi_ms:.4g} ms, "
    pace = "" if update.left_s is None else f", ~{_minutes(update.left_s)} min"
    text = f"{following}{update.stimuli_left} left{pace}"
    drawn = f"{_profile(update.estimate, space)}{text}"
    return _short_of(text if len(drawn) >= columns() else drawn, COLUMNS - 1)


def _minutes(duration_s: float) -> str:
    return f"{round(duration_s) // 60}:{round(duration_s) % 60:02d}"


def _profile(estimate: WindowEstimate, space: DesignSpace) -> str:
    """The expected MEP, on a logarithmic scale from its smallest to its largest; empty where there is none."""
    if estimate.grid_ms is None:
        return ""
    isi_ms = np.linspace(space.low_ms, space.high_ms, MOST_SPARKS)
    band = estimate.profile(isi_ms)
    if band is None:
        return ""
    size = np.log(np.maximum(band.median_mv, 1e-6))
    level = (size - size.min()) / max(float(np.ptp(size)), math.log(2.0))  # what hardly differs is drawn flat
    sparks = [SPARKS[round(float(height) * (len(SPARKS) - 1))] for height in level]
    return f"{space.low_ms:g} {_bracketed(sparks, isi_ms.tolist(), estimate)} {space.high_ms:g} ms  "


def _bracketed(sparks: Sequence[str], isi_ms: Sequence[float], estimate: WindowEstimate) -> str:
    """The signs of a profile, with brackets around each segment of the window."""
    window = estimate.window if estimate.rests_on_data else None
    inside = [False, *([False] * len(sparks) if window is None else window.mask(isi_ms).tolist()), False]
    edges = {(False, True): "[", (True, False): "]"}
    marks = [edges.get(pair, "") for pair in itertools.pairwise(inside)]
    return "".join(itertools.chain(*zip(marks, [*sparks, ""], strict=True)))


def _found(estimate: WindowEstimate) -> tuple[str, ...]:
    """Probability, window, start and end; where too little was measured to speak of them, they are not said."""
    start, end = estimate.edges
    return (
        "" if estimate.probability is None else f"{estimate.probability:.2f}",
        str(estimate.window or ("–" if estimate.probability is None else "none")),
        interval_cell(start),
        interval_cell(end),
    )
