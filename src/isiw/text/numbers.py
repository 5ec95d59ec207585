"""Numbers of things, in words."""

from __future__ import annotations

__all__ = ["counted"]


def counted(count: int, one: str, several: str | None = None) -> str:
    """A number of things in words, such as "1 session" and "2 sessions".

    Args:
        count: how many.
        one: what one of them is called; the verb may follow.
        several: what several are called; by default with an s.
    """
    return f"{count} {one if count == 1 else several or f'{one}s'}"
