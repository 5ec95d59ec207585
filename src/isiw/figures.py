"""The estimate of a window in figures: what logs keep, and pictures and sentences are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from isiw.change import Change, Misfit
from isiw.types import Number, Numbers
from isiw.window import Interval, Window


class Edge(NamedTuple):
    """An edge, given a window: median, 90 % interval [ms], ±inf beyond the range, and how probably it is there."""

    median_ms: float | None = None
    low_ms: float | None = None
    high_ms: float | None = None
    beyond: float | None = None

    @property
    def is_known(self) -> bool:
        """True if it has an interval."""
        return self.low_ms is not None and self.high_ms is not None

    def within(self, low_ms: float, high_ms: float) -> Interval:
        """The ends of its interval, those beyond a range at the range's ends [ms]."""
        low, high = np.clip(np.array([self.low_ms, self.high_ms], dtype=float), low_ms, high_ms).tolist()
        return low, high


class BestISI(NamedTuple):
    """The ISI of the largest expected MEP, given that there is a window: posterior median and 90 % interval [ms]."""

    isi_ms: float
    low_ms: float
    high_ms: float


class Reported(BaseModel):
    """Reported figures of a window: `segments_ms` are starts and ends in turn, `best_isi_ms` a median and interval.

    `hypotheses` are probabilities by name, given a window; the band is that of the expected MEP at `grid_ms`.
    """

    model_config = ConfigDict(frozen=True, ser_json_inf_nan="strings", extra="ignore")

    probability: float | None = Field(description="That there is a window.")
    segments_ms: tuple[float, ...] = Field(
        default=(), description="The reported window: starts and ends in turn; empty if none."
    )
    start_ms: Number | None = None
    start_low_ms: Number | None = None
    start_high_ms: Number | None = None
    end_ms: Number | None = None
    end_low_ms: Number | None = None
    end_high_ms: Number | None = None
    expected_f1: float | None = None
    best_isi_ms: tuple[float, ...] = ()
    hypotheses: dict[str, float] = Field(default_factory=dict)
    grid_ms: tuple[float, ...] = ()
    profile_mv: Numbers = ()
    band_low_mv: Numbers = ()
    band_high_mv: Numbers = ()


class Estimate(Reported):
    """An estimate of a window in figures: logs keep them, and pictures and sentences are made of them.

    `start_beyond`, `end_beyond` and `split` are probabilities given a window: that an edge lies beyond the range, and
    that there is more than one segment. `unusual` are probabilities by name; `excluded_mv` and `excluded_pct_rmt` are
    the largest enhancement that is excluded with 90 % probability. `depressed_ms` are the segments in which the tap
    depresses the MEP, and `depressed_probability` is that there are any; None if nobody looked for them. `change` is
    what probably changed during the session, whatever the ISI. `beforehand` is the probability of a window before the
    first trial. `tap_may_explain` says whether the tap's own response may be what is larger within the window, and
    `tap_is_likely` that the tap alone was measured there and evokes as much; `misfit` what speaks against the law.
    `enhancement_mv` and `enhancement_ratio` are medians and intervals of the `Magnitude`.
    """

    start_beyond: float | None = None
    end_beyond: float | None = None
    split: float | None = None
    unusual: dict[str, float] = Field(default_factory=dict)
    excluded_mv: float | None = None
    excluded_pct_rmt: float | None = None
    depressed_ms: tuple[float, ...] = ()
    depressed_probability: float | None = None
    change: Change | None = None
    beforehand: float | None = None
    tap_may_explain: bool = False
    tap_is_likely: bool = False
    misfit: Misfit | None = None
    enhancement_mv: tuple[float, ...] = ()
    enhancement_ratio: tuple[float, ...] = ()

    @property
    def has_answer(self) -> bool:
        """True if the method has one: some have none before they have measured enough."""
        return self.probability is not None or self.window is not None or bool(self.grid_ms)

    @property
    def window(self) -> Window | None:
        """The reported window."""
        return Window.of_edges(self.segments_ms)

    @property
    def depressed(self) -> Window | None:
        """The reported ISIs that depress the MEP."""
        return Window.of_edges(self.depressed_ms)

    @property
    def start(self) -> Edge:
        """The start of the window's hull."""
        return Edge(self.start_ms, self.start_low_ms, self.start_high_ms, self.start_beyond)

    @property
    def end(self) -> Edge:
        """The end of the window's hull."""
        return Edge(self.end_ms, self.end_low_ms, self.end_high_ms, self.end_beyond)

    @property
    def best_isi(self) -> BestISI | None:
        """The ISI of the largest expected MEP."""
        return BestISI(*self.best_isi_ms) if self.best_isi_ms else None
