"""The estimate of one person's window as a model has it, with posterior samples; `figures` is what logs keep of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np

from isiw.change import Change, Misfit
from isiw.checks import Checked, Share, number
from isiw.errors import InvalidValueError
from isiw.figures import BestISI, Edge, Estimate
from isiw.lazy import WorkedOut
from isiw.summary import lacking, summary
from isiw.types import ArrayLike, FloatArray, IntArray
from isiw.window import Interval, Window

_NOTHING: Final[Mapping[str, float]] = {}

FiguresT = TypeVar("FiguresT", bound=Estimate)

PROFILE_DECIMALS: Final = 6  # a nanovolt; the profile is a picture of the posterior, not a measurement


class ProfileBand(NamedTuple):
    """The expected MEP by ISI: median and a credible band [mV], each of shape (t,)."""

    median_mv: FloatArray
    low_mv: FloatArray
    high_mv: FloatArray


class Enhancement(NamedTuple):
    """By how much the tap enlarges the expected MEP [mV], and the shift of the recruitment curve's input [% RMT]."""

    mep_mv: float
    shift_pct_rmt: float | None = None


class Magnitude(NamedTuple):
    """The size of the enhancement at the best ISI, given that there is a window: medians and 90 % intervals.

    Args:
        mep_mv: by how much the expected MEP is larger than without a tap [mV].
        ratio: how many times as large as that of TMS alone it is, the EMG floor in both.
    """

    mep_mv: tuple[float, float, float]
    ratio: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class WindowEstimate(Checked):
    """The estimate of one person's window. What a non-Bayesian method does not have is None.

    A stopping rule needs the probability, the edges and the F1 only; bands, the best ISI, what is excluded, unusual or
    changed may be given as `Later`.

    Args:
        probability: probability that there is a window.
        window: the reported decision; None if the probability is below one half.
        start_ms: posterior median of the hull's start, given a window [ms]; -inf if it lies before the range.
        end_ms: posterior median of the hull's end, given a window [ms]; +inf if it lies beyond the range.
        grid_ms: the ISIs of `profile_quantiles_mv`, shape (t,).
        edge_samples_ms: posterior samples of (start, end) given a window, ±inf beyond the range, shape (s, 2).
        profile_quantiles_mv: the 0.05, 0.5 and 0.95 quantiles of the expected MEP by ISI [mV], shape (3, t).
        spread_ms: SD of the ISIs that a particle search has narrowed itself down to [ms].
        split_probability: probability that the window has more than one segment, given that there is one.
        hypothesis_samples: which of the model's hypotheses, such as the kind of noise, each of `edge_samples_ms`
            belongs to, as an index of `hypothesis_names`, shape (s,).
        hypothesis_names: what the hypotheses are called.
        expected_f1: posterior mean of the F1 of the reported decision.
        best_isi: the ISI of the largest expected MEP, given that there is a window: median and 90 % interval [ms].
        magnitude: the size of the enhancement at the best ISI, given that there is a window.
        largest_excluded: an enhancement [mV] that, with 90 % probability, is larger than the largest at any ISI of the
            space; its shift [% RMT] is that of the window's peak, wherever it lies.
        unusual: how probable it is that parts of this person are of another law than the usual one, by their names.
        pairs: how many pairs of stimuli it rests on; None if that is not known.
        silent: whether no trial that it rests on showed an MEP, so that nothing is known about a window.
        in_doubt: whether realised ISIs were reported that are far from those asked, and nobody has confirmed them; then
            there is no window.
        depressed: the ISIs that depress the MEP, as reported; None if there are none, or if nobody looked for them.
        depressed_probability: probability that there are any; None if the model does not look for them.
        change: what probably changed during the session, whatever the ISI; None if nothing did, or it is not sought.
        time_alone: probability that there is no window, but amplitudes changed with time; None if the model lacks it.
        beforehand: probability of a window before the first trial; None if it is not known.
        tap_may_explain: whether the tap's own response may be what is larger within the window, as nobody knows what
            the tap alone does there, or it evokes as much.
        tap_is_likely: whether it was measured what the tap alone does there, and it evokes as much.
        misfit: what amplitudes say against the law of responses; None if the model does not doubt it.

    Raises:
        InvalidValueError: a probability outside 0–1, or a window or a depression reported against it.
    """

    probability: Share | None
    window: Window | None
    start_ms: float | None = None
    end_ms: float | None = None
    grid_ms: FloatArray | None = field(default=None, repr=False)
    edge_samples_ms: FloatArray | None = field(default=None, repr=False)
    profile_quantiles_mv: WorkedOut[FloatArray | None] = field(
        default=WorkedOut("profile_quantiles_mv", None), repr=False
    )
    spread_ms: float | None = None
    split_probability: float | None = None
    hypothesis_samples: IntArray | None = field(default=None, repr=False)
    hypothesis_names: tuple[str, ...] = field(default=(), repr=False)
    expected_f1: Share | None = None
    best_isi: WorkedOut[BestISI | None] = field(default=WorkedOut("best_isi", None))
    magnitude: WorkedOut[Magnitude | None] = field(default=WorkedOut("magnitude", None))
    largest_excluded: WorkedOut[Enhancement | None] = field(default=WorkedOut("largest_excluded", None))
    unusual: WorkedOut[Mapping[str, float]] = field(default=WorkedOut("unusual", _NOTHING), repr=False)
    pairs: int | None = None
    silent: bool = False
    in_doubt: bool = False
    depressed: Window | None = None
    depressed_probability: Share | None = None
    change: WorkedOut[Change | None] = field(default=WorkedOut("change", None))
    time_alone: WorkedOut[float | None] = field(default=WorkedOut("time_alone", None))
    beforehand: float | None = None
    tap_may_explain: bool = False
    tap_is_likely: bool = False
    misfit: WorkedOut[Misfit | None] = field(default=WorkedOut("misfit", None))

    def noting(self, **facts: Any) -> WindowEstimate:
        """The same with other facts; what is still to be worked out remains so."""
        noted = object.__new__(type(self))
        noted.__dict__.update(self.__dict__ | facts)
        return noted

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.depressed is not None and (self.depressed_probability or 0.0) < 0.5:
            raise InvalidValueError(
                "a depression is reported although none is more probable", got=self.depressed_probability
            )
        if self.window is not None and self.probability is not None and self.probability < 0.5:
            raise InvalidValueError("a window is reported although 'no window' is more probable", got=self.probability)

    def doubted(self) -> WindowEstimate:
        """The same where realised ISIs are in doubt: no window is reported."""
        return self.noting(in_doubt=True, window=None, start_ms=None, end_ms=None, edge_samples_ms=None, depressed=None)

    @property
    def hypotheses(self) -> dict[str, float] | None:
        """Probability of each of the model's hypotheses by name, given a window; None if it has none."""
        if self.hypothesis_samples is None or not len(self.hypothesis_samples):
            return None
        counts = np.bincount(self.hypothesis_samples, minlength=len(self.hypothesis_names))
        shares = (counts / counts.sum()).tolist()
        return dict(zip(self.hypothesis_names, shares, strict=True))

    def __str__(self) -> str:
        return self.too_little or summary(self.in_figures(Estimate))

    @property
    def has_answer(self) -> bool:
        """True if anything is said about a window; not where a method waits for more trials, nor without any MEP."""
        says = self.window is not None or self.probability is not None or self.grid_ms is not None
        return says and not self.silent and not self.in_doubt

    @property
    def rests_on_data(self) -> bool:
        """True if enough was measured to speak of a window; with less it is the prior."""
        return self.too_little is None

    @property
    def too_little(self) -> str | None:
        """A sentence if too little was measured, or too doubtful, to report a window; None if enough was."""
        found = lacking(self.pairs, silent=self.silent, in_doubt=self.in_doubt)
        return None if found is None else f"{found}"

    def interval(self, level: float = 0.9) -> tuple[Interval, Interval] | None:
        """Credible intervals of start and end, given that there is a window [ms].

        Args:
            level: the credible level, in 0–1.

        Returns:
            ((start low, start high), (end low, end high)), an edge beyond the range being ±inf; None if the method
            has no posterior of the edges.

        Raises:
            InvalidValueError: a level outside 0–1.
        """
        level = number("a credible level", level, above=0, below=1)
        if self.edge_samples_ms is None or not len(self.edge_samples_ms):
            return None
        (start_low, end_low), (start_high, end_high) = _central(self.edge_samples_ms, level).tolist()
        return (start_low, start_high), (end_low, end_high)

    @property
    def edges(self) -> tuple[Edge, Edge]:
        """Start and end."""
        intervals = self.interval(0.9)
        if intervals is None:
            return Edge(self.start_ms), Edge(self.end_ms)
        (start, end), (before, beyond) = intervals, self.beyond_probability or (None, None)
        return Edge(self.start_ms, start[0], start[1], before), Edge(self.end_ms, end[0], end[1], beyond)

    def robust_interval(self, level: float = 0.9, min_share: float = 0.02) -> tuple[Interval, Interval] | None:
        """Intervals of start and end that hold whichever hypothesis is true: the hull of those given each [ms].

        Args:
            level: the credible level, in 0–1.
            min_share: the least probability of a hypothesis that is taken into account, given that there is a window.

        Returns:
            As `interval` does; the same if the method has no hypotheses.

        Raises:
            InvalidValueError: a level or a share outside 0–1.
        """
        min_share = number("the least share of a hypothesis", min_share, least=0, most=1)
        whole = self.interval(level)
        if whole is None or self.hypothesis_samples is None or self.edge_samples_ms is None:
            return whole
        counts = np.bincount(self.hypothesis_samples)
        probable = np.flatnonzero(counts >= max(1.0, min_share * len(self.hypothesis_samples)))
        given = [_central(self.edge_samples_ms[self.hypothesis_samples == kind], level) for kind in probable]
        lows, highs = np.stack([np.transpose(whole), *given], axis=1)
        (start_low, end_low), (start_high, end_high) = lows.min(0).tolist(), highs.max(0).tolist()
        return (start_low, start_high), (end_low, end_high)

    @property
    def beyond_probability(self) -> tuple[float, float] | None:
        """Probabilities that the window starts before the range, and ends beyond it, given that there is one.

        Returns:
            (start, end), each in 0–1; None without samples of the edges.
        """
        if self.edge_samples_ms is None or not len(self.edge_samples_ms):
            return None
        start, end = np.isinf(self.edge_samples_ms).mean(axis=0).tolist()
        return start, end

    def profile(self, isi_ms: ArrayLike) -> ProfileBand | None:
        """Median and 90 % band of the expected MEP at some ISIs.

        Args:
            isi_ms: ISIs [ms], shape (t,). Beyond `grid_ms` the values at its ends are repeated: they are no estimate.

        Returns:
            The band [mV], or None if the method has none.
        """
        if self.grid_ms is None or self.profile_quantiles_mv is None:
            return None
        isi = np.atleast_1d(np.asarray(isi_ms, dtype=float))
        low, median, high = (np.interp(isi, self.grid_ms, row) for row in self.profile_quantiles_mv)
        return ProfileBand(median, low, high)

    def in_figures(self, kind: type[FiguresT], **more: Any) -> FiguresT:
        """The estimate in figures, with its 90 % intervals.

        Args:
            kind: what holds the figures: an `Estimate`, or a kind of it.
            **more: further fields of that kind.
        """
        edges: dict[str, Any] = {
            f"{name}_{part}": value
            for name, edge in zip(("start", "end"), self.edges, strict=True)
            for part, value in zip(("ms", "low_ms", "high_ms", "beyond"), edge, strict=True)
        }
        excluded, (size_mv, ratio) = self.largest_excluded, self.magnitude or ((), ())
        figures: dict[str, Any] = {name: getattr(self, name) for name in _SAME} | {
            "segments_ms": () if self.window is None else self.window.edges_ms,
            "split": self.split_probability,
            "hypotheses": self.hypotheses or {},
            "unusual": dict(self.unusual),
            "best_isi_ms": tuple(self.best_isi or ()),
            "enhancement_mv": tuple(round(size, PROFILE_DECIMALS) for size in size_mv),
            "enhancement_ratio": tuple(round(size, PROFILE_DECIMALS) for size in ratio),
            "excluded_mv": None if excluded is None else excluded.mep_mv,
            "excluded_pct_rmt": None if excluded is None else excluded.shift_pct_rmt,
            "depressed_ms": () if self.depressed is None else self.depressed.edges_ms,
        }
        return kind(**figures, **edges, **_profile(self), **more)


_SAME: Final = ("probability", "expected_f1", "depressed_probability", "change", "beforehand", "tap_may_explain",
                "tap_is_likely", "misfit")  # fmt: skip
"""Figures that an estimate with samples has by the same names."""


def _central(edges_ms: FloatArray, level: float) -> FloatArray:
    """Lower and upper quantile of start and end, shape (2, 2)."""
    tail = (1.0 - level) / 2.0
    # An order statistic never averages a finite edge with an infinite one; of two as near, that of an even index.
    picks = [round((len(edges_ms) - 1) * share) for share in (tail, 1.0 - tail)]
    central_ms: FloatArray = np.sort(edges_ms, axis=0)[picks]
    return central_ms


def _profile(estimate: WindowEstimate) -> Mapping[str, Any]:
    if estimate.grid_ms is None or (band := estimate.profile(estimate.grid_ms)) is None:
        return {}
    named = {"profile_mv": band.median_mv, "band_low_mv": band.low_mv, "band_high_mv": band.high_mv}
    rounded = {name: tuple(np.asarray(mv, float).round(PROFILE_DECIMALS).tolist()) for name, mv in named.items()}
    return {"grid_ms": tuple(estimate.grid_ms.tolist()), **rounded}
