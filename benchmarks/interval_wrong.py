"""Laws of manual interval production that are wrong on purpose, and what holds because it was fitted."""

from __future__ import annotations

from typing import Final

from isiw.dissertation.interval import Producer

__all__ = ["PUT_IN", "WRONG", "WRONG_GROUPS"]

WRONG_GROUPS: Final = 200
WRONG: Final[dict[str, Producer]] = {
    "people who do not learn": Producer(learning=0.0),
    "twice the timing noise": Producer(timing_cv=2.0 * Producer().timing_cv),
    "people who take a told target for longer, not shorter": Producer(offset_ms=-Producer().offset_ms),
    "people who never search": Producer(start_sd_ms=0.0, search_ms=0.0),
}
"""Laws that are wrong on purpose: what comes out as printed has to fail for one of them."""

PUT_IN: Final = {
    **{f"{name} of mode {mode} at target 300 ms": "fitted" for name in ("Mean", "SD") for mode in (1, 2, 3, 4)},
    "Range, Bayesian optimisation, A = 100": "fitted: the range that is searched was read off this table",
}
"""What holds because it was fitted."""
