"""Response counts of simulated people, among them one with both kinds of peripheral stimulation (3.3.4, Fig. 3.12)."""

from __future__ import annotations

from typing import Final

import numpy as np

from isiw.dissertation.response_counts import CountStudy, effective_window, response_counts, response_threshold_mv
from isiw.subjects import EmgFloor, PeakProfile, RecruitmentResponse, SimulatedSubject
from isiw.types import ArrayLike


def _person(start_ms: float, width_ms: float) -> SimulatedSubject:
    response = RecruitmentResponse(
        EmgFloor(0.008, 0.2),
        amplitude_mv=0.16,
        slope_per_pct=0.30,
        x50_pct_rmt=104.0,
        boost_pct_rmt=14.0,
        sigma_x_pct_rmt=7.0,
        sigma_y=0.4,
    )
    return SimulatedSubject(PeakProfile(start_ms, width_ms), response, hit_delay_ms=180.0, hit_delay_sd_ms=0.0)


# An electric shock excites all afferents at once; a tap's spindles fire one after the other (3.3.4).
STIMULATION: Final = {"electrical": _person(10.0, 30.0), "mechanical": _person(20.0, 78.0)}
"""One person with both kinds of peripheral stimulation, as in Fig. 3.12: about 20 ms effective against about 50 ms."""


def study_counts(
    subject: SimulatedSubject,
    isi_ms: ArrayLike,
    *,
    trials: int = 12,
    threshold_mv: float | None = 0.03,
    alone: int = 0,
    seed: int = 0,
) -> CountStudy:
    """Sweep a simulated person over ISIs and count; without a threshold by that of so many trials of TMS alone."""
    person = subject.begin(seed)
    alone_mv = np.array([person.respond(None, "impact").mep_mv for _ in range(alone)])
    threshold_mv = response_threshold_mv(alone_mv) if threshold_mv is None else threshold_mv
    isi = np.repeat(np.asarray(isi_ms, dtype=np.float64), trials)
    mep = [person.respond(each, "impact").mep_mv for each in isi.tolist()]
    counts = response_counts(isi, mep, threshold_mv)
    alone_share = float((alone_mv > threshold_mv).mean()) if alone else float("nan")
    return CountStudy(counts, effective_window(counts, segments="peak"), threshold_mv, alone_share)
