"""A value of any kind in a few words, for messages about what should have been something else."""

from __future__ import annotations

from typing import Final

from isiw.text.harmless import one_line

LONGEST: Final = 80


def shown(value: object) -> str:
    """The beginning of what a value prints as, and its type, such as "0.12 (float)"; None is None."""
    if value is None:
        return "None"
    try:
        text = one_line(repr(value))
    except Exception:  # noqa: BLE001 - an object of somebody else's may fail in any way
        return f"an object of the type {type(value).__name__}"
    return f"{text if len(text) <= LONGEST else f'{text[:LONGEST]}…'} ({type(value).__name__})"
