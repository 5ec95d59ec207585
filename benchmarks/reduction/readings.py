"""What the dissertation leaves open, as readings: one value for each of its gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from benchmarks.reduction.dissertation import METHODS
from isiw.errors import InvalidValueError
from isiw.models.shared.floor import FloorKind

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
        floor: what becomes of the floor; None is each method's own default (PF: raw, the others: subtracted).
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

READINGS: Final[dict[str, tuple[Reading, str]]] = {
    "base": (BASE, "kim11"),
    "observation: mean of ten": (replace(BASE, observation="mean"), "kim11"),
    "observation: live trial": (LIVE, "kim11"),
    "outside the window: zero": (replace(BASE, outside="zero"), "kim11"),
    "floor: zeroed": (replace(BASE, floor="zeroed"), "kim11"),
    "floor: raw": (replace(BASE, floor="raw"), "kim11"),
    "edges: either": (replace(BASE, edges="either"), "kim11"),
    "last: six values": (replace(BASE, last=6), "kim11"),
    "pseudo-code: either edge, six": (replace(BASE, edges="either", last=6), "kim11"),
    "acquisition: edge variance": (replace(BASE, acquisition="edge-variance"), "kim11"),
    "acquisition: straddle": (replace(BASE, acquisition="straddle"), "kim11"),
    "acquisition: upper bound": (replace(BASE, acquisition="ucb"), "kim11"),
    "acquisition: expected improvement": (replace(BASE, acquisition="log-ei"), "kim11"),
    "range end: hit + 500": (replace(BASE, range_end="hit"), "kim11"),
    "people: constant-CV noise": (BASE, "gaussian"),
    "mean of ten, zero outside": (replace(BASE, observation="mean", outside="zero"), "kim11"),
    "mean of ten, six": (replace(BASE, observation="mean", last=6), "kim11"),
    "mean of ten, constant-CV noise": (replace(BASE, observation="mean"), "gaussian"),
    "zero outside, edge variance": (replace(BASE, outside="zero", acquisition="edge-variance"), "kim11"),
    "zero outside, constant-CV noise": (replace(BASE, outside="zero"), "gaussian"),
    "raw, mean of ten": (replace(BASE, floor="raw", observation="mean"), "kim11"),
    "raw, constant-CV noise": (replace(BASE, floor="raw"), "gaussian"),
    "zeroed, constant-CV noise": (replace(BASE, floor="zeroed"), "gaussian"),
    "six, constant-CV noise": (replace(BASE, last=6), "gaussian"),
    "either edge, constant-CV noise": (replace(BASE, edges="either"), "gaussian"),
    "edge variance, constant-CV noise": (replace(BASE, acquisition="edge-variance"), "gaussian"),
}
"""Readings and the cohort they are tried on: one factor at a time around the base, then combinations. The noise of the
people is no reading of the text, but it is as little known."""
