"""The effective window from response counts: an earlier definition, which needs a threshold [Kim2020, 3.3.4].

A trial responds if its MEP exceeds a person's own threshold, chosen by eye in the text (4.1.1) and from TMS alone
here; an ISI is effective if more than 40 % of its trials respond. Chapter 4 gives it up, as the window depends on the
threshold.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from isiw.checks import choice, number
from isiw.dissertation.profiles import paired
from isiw.errors import InvalidValueError
from isiw.findings import AMPLITUDE_MV
from isiw.lazy import pd
from isiw.signals.plausible import require_amplitude
from isiw.trials import RESPONSE_MV, Trial
from isiw.types import ArrayLike, FloatArray, IntArray
from isiw.window import Window

Segments: TypeAlias = Literal["all", "peak"]

EFFECTIVE_SHARE = 0.40
"""An ISI is effective when more than this share of its trials respond (3.3.4)."""

BIN_MS: Final = 5.0
"""Into such steps ISIs are put that hardly repeat; the dissertation's own step [Kim2020, 4.2.1]."""


@dataclass(frozen=True, eq=False)
class CountStudy:
    """A sweep over ISIs, counted.

    Args:
        counts: as `response_counts` returns it.
        window: the effective ISIs about the largest share; None if there are none.
        threshold_mv: what an MEP had to exceed [mV].
        alone_share: share of the trials of TMS alone that exceeded it; NaN without such trials.
    """

    counts: pd.DataFrame
    window: Window | None
    threshold_mv: float
    alone_share: float


class TrialsByIsi(NamedTuple):
    """The trials that count: ISIs in steps [ms] and MEPs [mV] of pairs, shape (n,), and MEPs of TMS alone [mV]."""

    isi_ms: FloatArray
    mep_mv: FloatArray
    alone_mv: FloatArray


def by_isi(trials: Iterable[Trial]) -> TrialsByIsi:
    """The trials that count, at the intensity of the pairs, with ISIs that hardly repeat put into steps."""
    measured = [t for t in trials if t.told and t.mep_mv is not None and t.intensity_pct_rmt is None]
    pairs = [trial for trial in measured if trial.isi_ms is not None]
    commanded_ms = np.array([trial.commanded_isi_ms for trial in pairs], dtype=np.float64)
    if len(np.unique(commanded_ms)) > len(commanded_ms) / 2:
        commanded_ms = BIN_MS * np.round(commanded_ms / BIN_MS)
    alone_mv = np.array([trial.mep_mv for trial in measured if trial.isi_ms is None], dtype=np.float64)
    return TrialsByIsi(commanded_ms, np.array([trial.mep_mv for trial in pairs], dtype=np.float64), alone_mv)


def measured_profile(trials: TrialsByIsi) -> tuple[FloatArray, FloatArray, IntArray]:
    """The ISIs, ascending [ms], the mean MEP at each [mV], and the number of trials there, shape (t,) each."""
    at_ms, which, counts = np.unique(trials.isi_ms, return_inverse=True, return_counts=True)
    return at_ms, np.bincount(which, trials.mep_mv, minlength=len(at_ms)) / counts, counts


def count_trials(trials: TrialsByIsi, threshold_mv: float | None = None, share: float = EFFECTIVE_SHARE) -> CountStudy:
    """The response counts of a session.

    Args:
        trials: its trials, as `by_isi` has them.
        threshold_mv: what an MEP has to exceed to be a response [mV]; by default by its own trials of TMS alone, or
            else the usual 50 µV.
        share: the share of responses that an effective ISI exceeds.

    Raises:
        InvalidValueError: values that are no MEPs, or a threshold or a share that cannot be.
    """
    known = len(trials.alone_mv) > 0
    if threshold_mv is None:
        threshold_mv = max(response_threshold_mv(trials.alone_mv), 1e-6) if known else RESPONSE_MV
    counts = response_counts(trials.isi_ms, trials.mep_mv, threshold_mv)
    alone_share = float((trials.alone_mv > threshold_mv).mean()) if known else float("nan")
    return CountStudy(counts, effective_window(counts, share, segments="peak"), threshold_mv, alone_share)


def response_counts(isi_ms: ArrayLike, mep_mv: ArrayLike, threshold_mv: float) -> pd.DataFrame:
    """The number of trials that respond at each ISI."""
    isi, mep = paired(isi_ms, mep_mv)
    if mep.min(initial=0.0) < 0:
        raise InvalidValueError("an amplitude is negative", got=float(mep.min()), expected="peak-to-peak amplitudes")
    require_amplitude(float(mep.max(initial=0.0)))
    threshold_mv = number("threshold_mv", threshold_mv, above=0, most=AMPLITUDE_MV.most)
    trials = pd.DataFrame({"isi_ms": isi, "response": mep > threshold_mv})
    table = trials.groupby("isi_ms").agg(trials=("response", "count"), responses=("response", "sum"))
    table["share"] = table["responses"] / table["trials"]
    return table


def response_threshold_mv(alone_mv: ArrayLike, false_share: float = 0.05) -> float:
    """A person's own threshold [mV]: their least MEP of TMS alone that at most a small share of these exceed."""
    mep = np.asarray(alone_mv, dtype=np.float64)
    false_share = number("the share of false responses", false_share, least=0, below=1)
    if mep.ndim != 1 or not mep.size or not np.isfinite(mep).all() or mep.min() < 0:
        raise InvalidValueError(
            "a threshold needs MEPs of TMS alone",
            got=mep.tolist() if mep.size < 10 else mep.shape,
            expected="finite amplitudes that are not negative",
            remedy="Deliver trials of TMS alone before the sweep, or give a threshold.",
        )
    return float(np.quantile(mep, 1 - false_share, method="inverted_cdf"))


def effective_window(
    counts: pd.DataFrame, share: float = EFFECTIVE_SHARE, *, segments: Segments = "all"
) -> Window | None:
    """The ISIs at which more than a share of the trials respond; None if there are none."""
    choice("segments", segments, get_args(Segments))
    share = number("the share of responses", share, least=0, below=1)
    isi_ms, shares = counts.index.to_numpy(), counts["share"].to_numpy()
    window = Window.from_mask(isi_ms, shares > share)
    if window is None or segments == "all":
        return window
    peak_ms = isi_ms[shares.argmax()]
    low, high = next(segment for segment in window.segments if segment[0] <= peak_ms <= segment[1])
    return Window(low, high)
