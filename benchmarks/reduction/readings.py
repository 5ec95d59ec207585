"""What the dissertation leaves open, as readings: one value for each of its gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from benchmarks.reduction.dissertation import METHODS
from isiw.errors import InvalidValueError
from isiw.models.curves import FloorKind

TRUTHS: Final = ("measured, baseline", "measured, .135", "true")
"""What a window is judged by: the run of measured means above the baseline (the text's words, 4.2.1), those with at
least 0.135 of the largest excess, or the true window of `cohorts`."""


@dataclass(frozen=True)
class Reading:
    """One way to read the text.

    Args:
        observation: what a method is told at an ISI: one recorded "trial", the "mean" of the ten, or a "live" trial
            of the same person.
        outside: whether ISIs outside the measured window answer as they were "recorded", or with "zero", as the text's
            figures have it.
        floor: what becomes of the floor; None is each method's own default (the particle filter: raw, others: subtracted).
        edges: whether both edges must settle, or either.
        last: of how many values.
        acquisition: what chooses the next ISI of a regression.
        range_end: whether the range with accelerometer ends 500 ms after the "valve" command, or after the "hit".

    Raises:
        InvalidValueError: another word for the observation, the outside or the range's end.
    """

    observation: Literal["trial", "mean", "live"] = "trial"
    outside: Literal["recorded", "zero"] = "recorded"
    floor: FloorKind | None = None
    edges: Literal["both", "either"] = "both"
    last: int = 5
    acquisition: str = "variance"
    range_end: Literal["valve", "hit"] = "valve"

    def __post_init__(self) -> None:
        known = {
            "observation": ("trial", "mean", "live"),
            "outside": ("recorded", "zero"),
            "range_end": ("valve", "hit"),
        }
        for name, words in known.items():
            if getattr(self, name) not in words:
                raise InvalidValueError(f"{name} is unknown", got=getattr(self, name), expected=" or ".join(words))
        if self.observation == "live" and self.outside == "zero":
            raise InvalidValueError("only a recorded sweep has an outside", got="live", expected="trial or mean")

    def settings(self, method: str) -> dict[str, Any]:
        """The settings of a named strategy under this reading; none for isiw's own strategies."""
        if method not in {*METHODS, "nr2"}:
            return {}
        floor = {} if self.floor is None else {"floor": self.floor}
        if method == "pf":
            return floor
        return floor | {"stop_edges": self.edges, "stop_last": self.last, "acquisition": self.acquisition}


BASE: Final = Reading()
"""The text where it says something, the library's defaults where it does not."""

LIVE: Final = Reading(observation="live")
"""No recorded data set: each trial is a new one of the person."""

READINGS: Final[dict[str, Reading]] = {
    "base": BASE,
    "observation: mean of ten": replace(BASE, observation="mean"),
    "observation: live trial": LIVE,
    "outside the window: zero": replace(BASE, outside="zero"),
    "floor: zeroed": replace(BASE, floor="zeroed"),
    "floor: raw": replace(BASE, floor="raw"),
    "edges: either": replace(BASE, edges="either"),
    "last: six values": replace(BASE, last=6),
    "acquisition: edge variance": replace(BASE, acquisition="edge-variance"),
    "acquisition: straddle": replace(BASE, acquisition="straddle"),
    "acquisition: upper bound": replace(BASE, acquisition="ucb"),
    "acquisition: expected improvement": replace(BASE, acquisition="log-ei"),
    "pseudo-code: either edge, six": replace(BASE, edges="either", last=6),
    "zero outside, mean of ten": replace(BASE, outside="zero", observation="mean"),
    "zero outside, six": replace(BASE, outside="zero", last=6),
    "zero outside, edge variance": replace(BASE, outside="zero", acquisition="edge-variance"),
    "zeroed, edge variance": replace(BASE, floor="zeroed", acquisition="edge-variance"),
    "zeroed, mean of ten": replace(BASE, floor="zeroed", observation="mean"),
}
"""One factor at a time around the base, then combinations."""
