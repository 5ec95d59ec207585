"""What is known about a window, in a few lines."""

from __future__ import annotations

import math
from typing import TypeAlias

_Edge: TypeAlias = tuple[float | None, float | None, float | None]


def summary(
    probability: float | None,
    window: object | None,
    nothing: str,
    start: _Edge,
    end: _Edge,
    depressed: tuple[object, float] | None = None,
) -> str:
    """A window in a line, and each of its edges in another, where they are known; and where the MEP is depressed."""
    chance = "" if probability is None else f" (probability of a window: {probability:.2f})"
    lines = [f"{nothing.capitalize() if window is None else f'Window: {window}'}{chance}"]
    for name, edge in (("Start", start), ("End", end)):
        median, low, high = ("" if edge_ms is None else _edge(edge_ms) for edge_ms in edge)
        if window is not None and low:
            lines.append(f"{name}: {median}, 90 % interval {low} to {high}")
    if depressed is not None:
        lines.append(f"Depressed: {depressed[0]} (probability of it: {depressed[1]:.2f})")
    return "\n".join(lines)


def _edge(edge_ms: float) -> str:
    if math.isinf(edge_ms):
        return "before the range" if edge_ms < 0 else "beyond the range"
    return f"{edge_ms:.0f} ms"
