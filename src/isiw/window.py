"""The window: the ISIs that enhance the MEP, what is believed about it, and the least-excess rule that defines it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from isiw.checks import check_probabilities, number
from isiw.errors import InvalidValueError
from isiw.findings import lacking
from isiw.later import WorkedOut
from isiw.text.summary import summary
from isiw.types import ArrayLike, BoolArray, FloatArray, IntArray

EDGE_LEVEL = 0.135
"""The share of the largest excess that a window's edge has: two SDs down a Gaussian [Kim2020, 4.3]."""

MIN_EXCESS_MV = 0.002
MIN_EXCESS_OF_BASELINE = 0.10

LEAST_DEPRESSED_MV = 0.05
"""Where the expected MEP without a tap is smaller there is none to depress: what counts as an MEP [Rossini2015]."""

SURE = 0.95
"""Probability from which on it is said outright that there is a window, or none; below it "probably", or undecided."""

Interval: TypeAlias = tuple[float, float]

_NOTHING: Final[Mapping[str, float]] = {}


def rules_out(probability: float | None) -> bool:
    """Whether nothing reported means that there is none; with more probability than this it is undecided."""
    return probability is None or 1 - probability >= SURE


def nothing_found(probability: float | None, *, has_answer: bool) -> str:
    """What is said in short where no window is reported."""
    if not has_answer:
        return "no answer yet"
    if probability is not None and probability >= 0.5:
        return "window not reported"
    return "no window" if rules_out(probability) else "undecided"


def depression(depressed: Window | None, probability: float | None) -> tuple[object, float] | None:
    """Which ISIs depress the MEP, in short, and the probability of any; None where nobody looked."""
    if probability is None:
        return None
    return depressed or ("nowhere" if rules_out(probability) else "undecided"), probability


@dataclass(frozen=True)
class Window:
    """The ISIs that enhance the MEP: disjoint segments and their hull.

    Args:
        start_ms: first enhancing ISI [ms].
        end_ms: last enhancing ISI [ms].
        segments: disjoint intervals (start, end) [ms] in ascending order; one by default.

    Raises:
        InvalidValueError: values that are not finite, an end before a start, or segments that overlap or miss the hull.
    """

    start_ms: float
    end_ms: float
    segments: tuple[Interval, ...] = ()

    def __post_init__(self) -> None:
        segments = tuple((float(a), float(b)) for a, b in self.segments) or (
            (float(self.start_ms), float(self.end_ms)),
        )
        flat = [edge for segment in segments for edge in segment]
        if not all(math.isfinite(edge) for edge in flat):
            raise InvalidValueError("a window's edges must be finite", got=segments)
        if any(b < a for a, b in segments) or any(b >= a for (_, b), (a, _) in itertools.pairwise(segments)):
            raise InvalidValueError("a window's segments must ascend without overlap", got=segments)
        if (self.start_ms, self.end_ms) != (flat[0], flat[-1]):
            raise InvalidValueError(
                "start and end are the hull of the segments", got=(self.start_ms, self.end_ms), expected=str(flat)
            )
        object.__setattr__(self, "segments", segments)
        object.__setattr__(self, "start_ms", flat[0])
        object.__setattr__(self, "end_ms", flat[-1])

    @classmethod
    def from_mask(cls, grid_ms: ArrayLike, mask: ArrayLike) -> Window | None:
        """The window of the marked grid points, or None where none is marked.

        Args:
            grid_ms: ascending ISIs [ms], shape (t,).
            mask: which of them enhance the MEP, shape (t,).

        Raises:
            InvalidValueError: not one value of the mask for each ISI.
        """
        grid, inside = np.asarray(grid_ms, dtype=float), np.asarray(mask, dtype=bool)
        if grid.shape != inside.shape or grid.ndim != 1:
            raise InvalidValueError(
                "each ISI needs one value",
                got=f"{inside.size} values for {grid.size} ISIs",
                remedy="Give both on the same grid, as space.grid_ms and person.expected_mep_mv(space) are.",
            )
        if not inside.any():
            return None
        steps = np.flatnonzero(np.diff(np.concatenate(([False], inside, [False])).astype(int)))
        segments = tuple((float(grid[a]), float(grid[b - 1])) for a, b in zip(steps[::2], steps[1::2], strict=True))
        return cls(segments[0][0], segments[-1][1], segments)

    @property
    def width_ms(self) -> float:
        """Width of the hull [ms]."""
        return self.end_ms - self.start_ms

    def mask(self, grid_ms: ArrayLike) -> BoolArray:
        """Which of the grid points [ms] lie in the window, shape of `grid_ms`."""
        grid = np.asarray(grid_ms, dtype=float)
        inside = np.zeros(grid.shape, dtype=bool)
        for start, end in self.segments:
            inside |= (grid >= start - 1e-9) & (grid <= end + 1e-9)
        return inside

    def __str__(self) -> str:
        return " and ".join(f"{a:g}–{b:g} ms" for a, b in self.segments)


def least_excess_mv(peak_mv: ArrayLike, baseline_mv: ArrayLike, share: float = EDGE_LEVEL) -> FloatArray:
    """The least-excess rule: what the expected MEP at an ISI inside the window exceeds the baseline by, at least [mV].

    It is a share of the largest excess. Where that is below 10 % of the baseline or below 2 µV nothing is enhanced, and
    the least excess is infinite. `isiw.models.windows.least_excess_mv` is the same rule for tensors.
    """
    peak = np.asarray(peak_mv, dtype=float)
    enough_mv = np.maximum(MIN_EXCESS_OF_BASELINE * np.asarray(baseline_mv, dtype=float), MIN_EXCESS_MV)
    return np.where(peak >= enough_mv, share * peak, np.inf)


def window_from_excess(grid_ms: ArrayLike, excess_mv: ArrayLike, baseline_mv: float) -> Window | None:
    """The window by the least-excess rule, or None where nothing is enhanced."""
    excess = np.asarray(excess_mv, dtype=float)
    if not (np.isfinite(excess).all() and math.isfinite(baseline_mv)):
        raise InvalidValueError("the expected MEP must be finite at every ISI", got=(float(excess.max()), baseline_mv))
    return Window.from_mask(grid_ms, excess >= least_excess_mv(excess.max(), baseline_mv))


class ProfileBand(NamedTuple):
    """The expected MEP by ISI: median and a credible band [mV], each of shape (t,)."""

    median_mv: FloatArray
    low_mv: FloatArray
    high_mv: FloatArray


class BestISI(NamedTuple):
    """The ISI of the largest expected MEP, given that there is a window: posterior median and 90 % interval [ms]."""

    isi_ms: float
    low_ms: float
    high_ms: float


class Enhancement(NamedTuple):
    """By how much the expected MEP is larger than without a tap [mV].

    The shift of a recruitment curve's input that does so [% RMT] is None where the model has no such curve.
    """

    mep_mv: float
    shift_pct_rmt: float | None = None


@dataclass(frozen=True, eq=False)
class WindowEstimate:
    """What is believed about one person's window. What a non-Bayesian method does not have is None.

    A stopping rule needs the probability, the edges and the F1 only; bands, the best ISI, what is excluded and what is
    unusual may be given as `Later`.

    Args:
        probability: probability that there is a window.
        window: the reported decision; None where the probability is below one half.
        start_ms: posterior median of the hull's start, given a window [ms]; -inf where it lies before the range.
        end_ms: posterior median of the hull's end, given a window [ms]; +inf where it lies beyond the range.
        grid_ms: the ISIs of `profile_quantiles_mv`, shape (t,).
        edge_samples_ms: posterior samples of (start, end) given a window, ±inf beyond the range, shape (s, 2).
        profile_quantiles_mv: the 0.05, 0.5 and 0.95 quantiles of the expected MEP by ISI [mV], shape (3, t).
        spread_ms: SD of the ISIs that a particle search has narrowed itself down to [ms].
        split_probability: probability that the window has more than one segment, given that there is one.
        hypothesis_samples: which of the model's hypotheses, such as the kind of noise, each of `edge_samples_ms`
            belongs to, as an index of `hypothesis_names`, shape (s,).
        hypothesis_names: what the hypotheses are called.
        expected_f1: posterior mean of the F1 of the reported decision.
        best_isi: the ISI of the largest expected MEP.
        largest_excluded: an enhancement that, with 90 % probability, is larger than the largest at any ISI of the
            space; its shift is that of the window's peak, wherever it lies.
        unusual: how probable it is that parts of this person are of another law than the usual one, by their names.
        pairs: how many pairs of stimuli it rests on; None where that is not known.
        silent: whether no trial that it rests on showed an MEP, so that nothing is known about a window.
        depressed: the ISIs that depress the MEP, as far as they are reported; None where there are none, or where
            nobody looked for them.
        depressed_probability: probability that there are any; None where nobody looked for them.

    Raises:
        InvalidValueError: a probability outside 0–1, a window or a depression reported against it, not one hypothesis a
            sample, or one without a name.
    """

    probability: float | None
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
    expected_f1: float | None = None
    best_isi: WorkedOut[BestISI | None] = field(default=WorkedOut("best_isi", None))
    largest_excluded: WorkedOut[Enhancement | None] = field(default=WorkedOut("largest_excluded", None))
    unusual: WorkedOut[Mapping[str, float]] = field(default=WorkedOut("unusual", _NOTHING), repr=False)
    pairs: int | None = None
    silent: bool = False
    depressed: Window | None = None
    depressed_probability: float | None = None

    def noting(self, **facts: Any) -> WindowEstimate:
        """The same with other `pairs`, `silent` or `unusual`; what is still to be worked out remains so."""
        noted = object.__new__(type(self))
        noted.__dict__.update(self.__dict__ | facts)
        return noted

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def __post_init__(self) -> None:
        self._check_hypotheses()
        check_probabilities(self, "expected_f1", "depressed_probability", optional=True)
        if self.depressed is not None and (self.depressed_probability or 0.0) < 0.5:
            raise InvalidValueError(
                "a depression is reported although none is more probable", got=self.depressed_probability
            )
        if self.probability is None:
            return
        check_probabilities(self, "probability")
        if self.window is not None and self.probability < 0.5:
            raise InvalidValueError("a window is reported although 'no window' is more probable", got=self.probability)

    def _check_hypotheses(self) -> None:
        kinds = self.hypothesis_samples
        if kinds is None:
            return
        samples = 0 if self.edge_samples_ms is None else len(self.edge_samples_ms)
        if len(kinds) != samples:
            raise InvalidValueError(
                "every sample of the edges has one hypothesis", got=len(kinds), expected=str(samples)
            )
        if samples and not 0 <= kinds.min() <= kinds.max() < len(self.hypothesis_names):
            raise InvalidValueError(
                "every hypothesis has a name", got=int(kinds.max()), expected=f"an index of {self.hypothesis_names}"
            )

    @property
    def hypotheses(self) -> dict[str, float] | None:
        """Probability of each of the model's hypotheses by name, given a window; None where it has none."""
        if self.hypothesis_samples is None or not len(self.hypothesis_samples):
            return None
        counts = np.bincount(self.hypothesis_samples, minlength=len(self.hypothesis_names))
        shares = (counts / counts.sum()).tolist()
        return dict(zip(self.hypothesis_names, shares, strict=True))

    def __str__(self) -> str:
        if self.too_little is not None:
            return self.too_little
        start, end = self.interval(0.9) or ((None, None), (None, None))
        depressed = depression(self.depressed, self.depressed_probability)
        nothing = nothing_found(self.probability, has_answer=self.has_answer)
        edges = (self.start_ms, *start), (self.end_ms, *end)
        return summary(self.probability, self.window, nothing, *edges, depressed)

    @property
    def has_answer(self) -> bool:
        """Whether anything is said about a window; not where a method waits for more trials, nor without any MEP."""
        says = self.window is not None or self.probability is not None or self.grid_ms is not None
        return says and not self.silent

    @property
    def rests_on_data(self) -> bool:
        """Whether enough was measured to speak of a window; with less it is what was believed beforehand."""
        return self.too_little is None

    @property
    def too_little(self) -> str | None:
        """What is said where too little was measured to speak of a window; None where enough was."""
        found = lacking(self.pairs, silent=self.silent)
        return None if found is None else f"{found}"

    def interval(self, level: float = 0.9) -> tuple[Interval, Interval] | None:
        """Credible intervals of start and end, given that there is a window [ms].

        Args:
            level: the credible level, in 0–1.

        Returns:
            ((start low, start high), (end low, end high)), an edge beyond the range being ±inf; None where the method
            has no posterior of the edges.

        Raises:
            InvalidValueError: a level outside 0–1.
        """
        level = number("a credible level", level, above=0, below=1)
        if self.edge_samples_ms is None or not len(self.edge_samples_ms):
            return None
        (start_low, end_low), (start_high, end_high) = _central(self.edge_samples_ms, level).tolist()
        return (start_low, start_high), (end_low, end_high)

    def robust_interval(self, level: float = 0.9, min_share: float = 0.02) -> tuple[Interval, Interval] | None:
        """Intervals of start and end that hold whichever hypothesis is true: the hull of those given each [ms].

        Args:
            level: the credible level, in 0–1.
            min_share: the least probability of a hypothesis that is taken into account, given that there is a window.

        Returns:
            As `interval` does; the same where the method has no hypotheses.

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
        """Probability that the window starts before the range, and that it ends beyond it, given that there is one."""
        if self.edge_samples_ms is None or not len(self.edge_samples_ms):
            return None
        start, end = np.isinf(self.edge_samples_ms).mean(axis=0).tolist()
        return start, end

    def profile(self, isi_ms: ArrayLike) -> ProfileBand | None:
        """Median and 90 % band of the expected MEP at some ISIs.

        Args:
            isi_ms: ISIs [ms], shape (t,). Beyond `grid_ms`, as where a sweep has not come yet, the values at its ends
                are repeated: there they are no estimate.

        Returns:
            The band [mV], or None where the method has none.
        """
        if self.grid_ms is None or self.profile_quantiles_mv is None:
            return None
        isi = np.atleast_1d(np.asarray(isi_ms, dtype=float))
        low, median, high = (np.interp(isi, self.grid_ms, row) for row in self.profile_quantiles_mv)
        return ProfileBand(median, low, high)


def _central(edges_ms: FloatArray, level: float) -> FloatArray:
    """Lower and upper quantile of start and end, shape (2, 2)."""
    tail = (1.0 - level) / 2.0
    # An order statistic never averages a finite edge with an infinite one; of two as near, that of an even index.
    picks = np.rint((len(edges_ms) - 1) * np.array([tail, 1.0 - tail])).astype(int)
    central_ms: FloatArray = np.sort(edges_ms, axis=0)[picks]
    return central_ms
