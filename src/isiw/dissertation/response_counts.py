"""The effective window from response counts: an earlier definition, which needs a threshold [Kim2020, 3.3.4].

A trial responds when its MEP exceeds a threshold, and an ISI is effective when more than 40 % of its trials respond.
Each person has a threshold of their own: the text chose it by looking at their responses (4.1.1), here it can come from
their trials of TMS alone. Chapter 4 gives all this up for amplitudes, because the window depends on the threshold
(4.1.1); it is here to compare.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from isiw.checks import choice, number, whole
from isiw.dissertation.profiles import paired
from isiw.errors import InvalidValueError
from isiw.findings import AMPLITUDE_MV
from isiw.lazy import pd
from isiw.signals.limits import require_amplitude
from isiw.subjects.responses import EmgFloor, PeakProfile, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import RESPONSE_MV, Trial
from isiw.types import ArrayLike, FloatArray
from isiw.window import Window

Segments: TypeAlias = Literal["all", "peak"]

EFFECTIVE_SHARE = 0.40
"""An ISI is effective when more than this share of its trials respond (3.3.4)."""

BIN_MS: Final = 5.0
"""Into such steps ISIs are put that hardly repeat; the dissertation's own step [Kim2020, 4.2.1]."""

_FLOOR = EmgFloor(0.008, 0.2)


def _person(start_ms: float, width_ms: float) -> SimulatedSubject:
    response = RecruitmentResponse(
        _FLOOR,
        amplitude_mv=0.16,
        slope_per_pct=0.30,
        x50_pct_rmt=104.0,
        boost_pct_rmt=14.0,
        sigma_x_pct_rmt=7.0,
        sigma_y=0.4,
    )
    return SimulatedSubject(PeakProfile(start_ms, width_ms), response, hit_delay_ms=180.0, hit_delay_sd_ms=0.0)


STIMULATION: Mapping[str, SimulatedSubject] = MappingProxyType(
    # An electric shock excites all afferents at once; a tap's spindles fire one after the other (3.3.4).
    {"electrical": _person(10.0, 30.0), "mechanical": _person(20.0, 78.0)}
)
"""One person with both kinds of peripheral stimulation, as in Fig. 3.12: about 20 ms effective against about 50 ms."""


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
    """The trials that count, with ISIs that hardly repeat put into steps."""
    measured = [trial for trial in trials if trial.told and trial.mep_mv is not None]
    pairs = [trial for trial in measured if trial.isi_ms is not None]
    commanded_ms = np.array([trial.commanded_isi_ms for trial in pairs], dtype=np.float64)
    if len(np.unique(commanded_ms)) > len(commanded_ms) / 2:
        commanded_ms = BIN_MS * np.round(commanded_ms / BIN_MS)
    alone_mv = np.array([trial.mep_mv for trial in measured if trial.isi_ms is None], dtype=np.float64)
    return TrialsByIsi(commanded_ms, np.array([trial.mep_mv for trial in pairs], dtype=np.float64), alone_mv)


def count_trials(trials: TrialsByIsi) -> CountStudy:
    """The response counts of a session, by its own trials of TMS alone if it has any, else by the usual 50 µV."""
    known = len(trials.alone_mv) > 0
    threshold_mv = max(response_threshold_mv(trials.alone_mv), 1e-6) if known else RESPONSE_MV
    counts = response_counts(trials.isi_ms, trials.mep_mv, threshold_mv)
    share = float((trials.alone_mv > threshold_mv).mean()) if known else float("nan")
    return CountStudy(counts, effective_window(counts, segments="peak"), threshold_mv, share)


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


def study_counts(
    subject: SimulatedSubject,
    isi_ms: ArrayLike,
    *,
    trials: int = 12,
    threshold_mv: float | None = 0.03,
    alone: int = 0,
    seed: int = 0,
) -> CountStudy:
    """Sweep a simulated person over ISIs and count."""
    person = subject.begin(seed)
    alone, trials = whole("alone", alone, least=0), whole("trials", trials, least=1)
    alone_mv = np.array([person.respond(None, "impact").mep_mv for _ in range(alone)])
    threshold_mv = response_threshold_mv(alone_mv) if threshold_mv is None else threshold_mv
    isi = np.repeat(np.asarray(isi_ms, dtype=np.float64), trials)
    mep = [person.respond(each, "impact").mep_mv for each in isi.tolist()]
    counts = response_counts(isi, mep, threshold_mv)
    alone_share = float((alone_mv > threshold_mv).mean()) if alone else float("nan")
    return CountStudy(counts, effective_window(counts, segments="peak"), threshold_mv, alone_share)
