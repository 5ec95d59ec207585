"""What the dissertation leaves open, as readings: one value for each of its gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from benchmarks.reduction.dissertation import METHODS
from benchmarks.reduction.recorded import BASELINES
from isiw.errors import InvalidValueError
from isiw.models.shared.history import FloorKind

TRUTHS: Final = (*(f"measured, {baseline}" for baseline in BASELINES), "measured, .135", "true")
"""What a window is judged by: the run of measured means above the MEP of TMS alone at 100 % RMT (the text's words,
4.2.1) or at the 90 % of the pairs, those with at least 0.135 of the largest excess, or the true window of `cohorts`."""


@dataclass(frozen=True)
class Reading:
    """One way to read the text.

    Args:
        observation: what a method is told at an ISI: one recorded "trial", the "mean" of the ten, or a "live" trial
            of the same person.
        outside: whether ISIs outside the measured window answer as they were "recorded", or with "zero", as the text's
            figures have it.
        floor: what becomes of the floor; None is each method's own default (NR: the lowest tenth is subtracted, SVMR
            and GPR: the median, PF: raw).
        edges: whether both edges must settle, or either.
        last: of how many values.
        acquisition: what chooses the next ISI of a regression.
        range_end: whether the range with accelerometer ends 500 ms after the "valve" command, or after the "hit".
        baseline: which TMS alone the measured window is above, one of `BASELINES`.

    Raises:
        InvalidValueError: another word for the observation, the outside, the range's end or the baseline.
    """

    observation: Literal["trial", "mean", "live"] = "trial"
    outside: Literal["recorded", "zero"] = "recorded"
    floor: FloorKind | None = None
    edges: Literal["both", "either"] = "both"
    last: int = 5
    acquisition: str = "variance"
    range_end: Literal["valve", "hit"] = "valve"
    baseline: str = BASELINES[0]

    def __post_init__(self) -> None:
        known = {
            "observation": ("trial", "mean", "live"),
            "outside": ("recorded", "zero"),
            "range_end": ("valve", "hit"),
            "baseline": BASELINES,
        }
        for name, words in known.items():
            if getattr(self, name) not in words:
                raise InvalidValueError(f"{name} is unknown", got=getattr(self, name), expected=" or ".join(words))
        if self.observation == "live" and self.outside == "zero":
            raise InvalidValueError("only a recorded sweep has an outside", got="live", expected="trial or mean")

    @property
    def truth(self) -> str:
        """The measured window of this reading, one of `TRUTHS`."""
        return f"measured, {self.baseline}"

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

PEOPLE: Final = "kim11-measured"
"""On whom readings are tried; on constant-CV noise: `gaussian`."""

_ALONE: Final[dict[str, dict[str, Any]]] = {
    "base": {},
    "TMS alone at 90 %, zero outside": {"baseline": BASELINES[1], "outside": "zero"},
    "observation: mean of ten": {"observation": "mean"},
    "outside the window: zero": {"outside": "zero"},
    "floor: raw": {"floor": "raw"},
    "floor: median of all MEPs": {"floor": "median"},
    "pseudo-code: either edge, six": {"edges": "either", "last": 6},
    "range end: hit + 500": {"range_end": "hit"},
}

READINGS: Final[dict[str, tuple[Reading, str]]] = {
    **{name: (replace(BASE, **changes), PEOPLE) for name, changes in _ALONE.items()},
    "constant-CV noise": (BASE, "gaussian"),
}
"""Readings and the cohort they are tried on: one factor at a time around the base, and other people. The
noise of the people is no reading of the text, but it is as little known."""
