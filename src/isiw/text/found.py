"""What was found, in words: the window and its edges, or that too little was measured to speak of one."""

from __future__ import annotations

import math
from typing import Final, TypeAlias

__all__ = ["ENOUGH_PAIRS", "NO_MEP", "SURE", "TOO_FEW", "finding", "lacking", "nothing_found", "rules_out"]

ENOUGH_PAIRS: Final = 3
"""With fewer pairs of stimuli nothing was found: rest, a response, and one of them again are the least."""

TOO_FEW: Final = "Fewer than three pairs of stimuli count so far, too few to speak of a window."
"""What is said instead."""

NO_MEP: Final = "No MEP was seen in any trial that counts, so nothing is known about a window."
"""What is said where every amplitude was below the detection limit."""

SURE: Final = 0.95
"""Probability from which on it is said outright that there is a window, or none; below it "probably", or undecided."""

_Edge: TypeAlias = tuple[float | None, float | None, float | None]


def lacking(pairs: int | None, *, silent: bool) -> str | None:
    """What is said where too little was measured to speak of a window; None where enough was.

    Args:
        pairs: how many pairs of stimuli count; None where that is not known.
        silent: whether no trial that counts showed an MEP.
    """
    if silent:
        return NO_MEP
    return None if pairs is None or pairs >= ENOUGH_PAIRS else TOO_FEW


def rules_out(probability: float | None) -> bool:
    """Whether nothing reported means that there is none; with more probability than this it is undecided.

    Args:
        probability: that there is a window, or a depression; None where the method has none.
    """
    return probability is None or 1 - probability >= SURE


def nothing_found(probability: float | None, *, has_answer: bool) -> str:
    """What is said in short where no window is reported.

    Args:
        probability: that there is a window; None where the method has none.
        has_answer: whether the method has one yet.
    """
    if not has_answer:
        return "no answer yet"
    if probability is not None and probability >= 0.5:
        return "window not reported"
    return "no window" if rules_out(probability) else "undecided"


def finding(
    probability: float | None,
    window: object | None,
    nothing: str,
    start: _Edge,
    end: _Edge,
    depressed: tuple[object | None, float | None] = (None, None),
) -> str:
    """A window in a line, and each of its edges in another, where they are known; and where the MEP is depressed.

    Args:
        probability: that there is a window.
        window: the reported decision, which prints as its ISIs.
        nothing: what is said where it is None, as by `nothing_found`.
        start: median, and lower and upper end of the 90 % interval, of its start [ms]; None where not known.
        end: those of its end [ms].
        depressed: the reported ISIs that depress the MEP, and the probability of any; None where nobody looked.
    """
    chance = "" if probability is None else f" (probability of a window: {probability:.2f})"
    lines = [f"{nothing.capitalize() if window is None else f'Window: {window}'}{chance}"]
    for name, edge in (("Start", start), ("End", end)):
        median, low, high = ("" if edge_ms is None else _edge(edge_ms) for edge_ms in edge)
        if window is not None and low:
            lines.append(f"{name}: {median}, 90 % interval {low} to {high}")
    segment, anywhere = depressed
    if anywhere is not None:
        nowhere = "nowhere" if rules_out(anywhere) else "undecided"
        lines.append(f"Depressed: {nowhere if segment is None else segment} (probability of it: {anywhere:.2f})")
    return "\n".join(lines)


def _edge(edge_ms: float) -> str:
    if math.isinf(edge_ms):
        return "before the range" if edge_ms < 0 else "beyond the range"
    return f"{edge_ms:.0f} ms"
