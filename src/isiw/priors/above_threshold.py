"""The search above the motor threshold after one below it: where a person's window lay is where it is looked for.

The first of the two steps of [Kim2020, 8.1.3] finds the window by enhancement alone; the second looks there for
enhanced and depressed MEPs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from isiw.errors import InvalidValueError
from isiw.log.headers import FirstStep
from isiw.log.record import SessionRecord
from isiw.models.particles.places import Place
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import Width
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.shared.start import Span
from isiw.priors.days import DayToDay, after

SAME_VISIT: Final = DayToDay(
    p_stays=0.95, shift_sd_ms=3.0, amplitude_log_sd=0.1, x50_sd_pct=1.0, floor_log_sd=0.05, p_other=0.1
)
"""Between two sessions of one visit electrodes and threshold stay; the law is chosen, not measured."""

THRESHOLD_PCT_RMT: Final = 100.0
"""A session at or above this is no first step."""

AT_THE_WINDOW: Final = 0.3
ABOUT_IT: Final = 0.3
"""Shares of the starts, of either segment, that lie where the window starts, and anywhere about the window."""

AS_WIDE: Final = 0.5
"""Share of the enhanced segments that are as wide as the window."""

BEFORE_MS: Final = 60.0
"""So much earlier than the window an adjoining depressed segment may start [ms], which is a usual one's widest."""

_HALF_MS: Final = 0.5
"""A normal law of starts is a span that is hardly one [ms]."""


def above(*records: SessionRecord, prior: Prior | None = None, law: DayToDay | None = None) -> SupraPrior:
    """The prior of a search above the motor threshold after sessions below it, for the strategy `supra-threshold`.

    Args:
        *records: the person's sessions below the threshold, the first one first.
        prior: the prior before them; by default the built-in one.
        law: how the person differs from the last of them to the search; by default that of two sessions of one visit.

    Raises:
        LogError: a session without an accepted trial.
        DamagedLogError: a session's log is damaged.
        InvalidValueError: as for `isiw.priors.after`, a session at or above the motor threshold, or one whose ISIs
            count from the valve command and whose rig stated no hit delay.
    """
    require_below(records)
    learnt, usual = after(*records, prior=prior, law=law or SAME_VISIT), SupraPrior()
    places = learnt.profile.places
    known = learnt.profile.p_window * math.fsum(place.share for place in places)
    return replace(
        usual,
        start=replace(usual.start, spans=_starts(places, known, usual.start.spans)),
        enhanced=replace(usual.enhanced, widths=_widths(places, known, usual.enhanced.widths)),
        floors=learnt.floors,
    )


def profile_below(record: SessionRecord) -> FirstStep | None:
    """The profile of a session below the threshold, for the log of the search above it; None if it has none."""
    found, header = record.found, record.header
    if found is None or not found.profile_mv:
        return None
    return FirstStep(
        log=record.path.name,
        intensity_pct_rmt=header.visit.intensity_pct_rmt,
        reference=header.space.reference,
        grid_ms=tuple(found.grid_ms),
        profile_mv=tuple(found.profile_mv),
    )


def require_below(records: Sequence[SessionRecord]) -> None:
    """Raise if a session is no first step: it was at or above the motor threshold, or looked for depression."""
    for record in records:
        noted = record.header.visit.intensity_pct_rmt
        if record.header.strategy.name == "supra-threshold" or (noted is not None and noted >= THRESHOLD_PCT_RMT):
            raise InvalidValueError(
                "the first of the two steps is a session below the motor threshold",
                got=f"{record.header.strategy.name} at "
                f"{'an intensity that is not noted' if noted is None else f'{noted:g} % of RMT'} in {record.path}",
                expected=f"TMS below {THRESHOLD_PCT_RMT:g} % of RMT, and a strategy that finds the enhanced window",
                remedy="Leave this file out, or correct intensity_pct_rmt under [visit].",
            )


def _starts(places: Sequence[Place], known: float, usual: tuple[Span, ...]) -> tuple[Span, ...]:
    """Starts from the impact: where the window started, about it, and as usual."""
    spans, each = [], known / math.fsum(place.share for place in places) if places else 0.0
    for place in places:
        start_ms, sd_ms = _from_impact(place)
        share = each * place.share
        spans.append(Span(AT_THE_WINDOW * share, start_ms - _HALF_MS, start_ms + _HALF_MS, sd_ms))
        about_ms = start_ms - BEFORE_MS, start_ms + place.width_ms.median
        spans.append(Span(ABOUT_IT * share, *about_ms, sd_ms))
    left = 1.0 - math.fsum(span.share for span in spans)
    return (*(replace(span, share=left * span.share) for span in usual), *spans)


def _from_impact(place: Place) -> tuple[float, float]:
    """Mean and SD of a place's start, counted from the impact [ms]."""
    mean_ms, sd_ms = place.start_ms.law
    if place.reference == "impact":
        return mean_ms, sd_ms
    if place.hit_delay_ms is None:
        raise InvalidValueError(
            "where the window lies after the impact is not known",
            got="ISIs from the valve command, of a rig that stated no hit delay",
            remedy="Measure the hit delay (isiw timing), and state it as hit_delay_ms under [strategy.settings].",
        )
    return mean_ms - place.hit_delay_ms[0], sd_ms


def _widths(places: Sequence[Place], known: float, usual: tuple[Width, ...]) -> tuple[Width, ...]:
    learnt = [
        Width(AS_WIDE * known * place.share / math.fsum(p.share for p in places), place.width_ms) for place in places
    ]
    left = 1.0 - math.fsum(width.share for width in learnt)
    return (*(replace(width, share=left * width.share) for width in usual), *learnt)
