"""A comparison of windows that may differ: of one person on two days, or of two people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from isiw.errors import InvalidValueError
from isiw.log.codes import is_same_person
from isiw.log.record import SessionRecord, require_records
from isiw.models.particles.prior import Prior
from isiw.priors.days import moved, recalled, too_far_apart_ms
from isiw.summary import ENOUGH_PAIRS
from isiw.types import FloatArray

_Session: TypeAlias = tuple[SessionRecord, FloatArray | None]
"""A session, and samples of its window's edges [ms]."""


@dataclass(frozen=True, eq=False)
class Difference:
    """Difference of a session's window from that of another one.

    Args:
        first: the session that it is compared to.
        second: the other one.
        same_person: whether both have the same person's code.
        starts_later: probability that the second window starts later, given both; None if nothing can be said.
        ends_later: the same of its end.
        moved: probability that the same person's window moved by more than the usual shift; None if nobody can say.
        obstacle: why something cannot be said, or says less than it seems to.
    """

    first: SessionRecord
    second: SessionRecord
    same_person: bool
    starts_later: float | None = None
    ends_later: float | None = None
    moved: float | None = None
    obstacle: str = ""


def differences(records: Sequence[SessionRecord]) -> list[Difference]:
    """Differences of each session's window from the first one's, by the trials that count.

    The particle model with the built-in prior learns each session's trials, whatever strategy chose them,
    so that all are judged alike. Whether one person's window moved is judged in the order of the sessions' dates.
    Nothing is said of windows after different conditioning stimuli, or from the valve command on rigs that state hit
    delays further apart than one rig's. Edges are compared within the range of ISIs that the sessions have in common.

    Args:
        records: the sessions, at least two.

    Raises:
        InvalidValueError: no records of sessions, fewer than two, or some whose ISIs count from different events.
    """
    require_records(records)
    references = {record.header.space.reference for record in records}
    if len(records) < 2:
        raise InvalidValueError("a comparison needs sessions", got=len(records), expected="at least two")
    if len(references) > 1:
        raise InvalidValueError("ISIs that count from different events cannot be compared", got=sorted(references))
    edges = [_edges(record) for record in records]
    sessions = list(zip(records, edges, strict=True))
    return [_difference(sessions[0], session) for session in sessions[1:]]


def _edges(record: SessionRecord) -> FloatArray | None:
    """Samples of start and end, given a window [ms]; None if too few trials count, or there is probably none."""
    own = sum(trial.isi_ms is not None for trial in record.table.told)  # only these are learnt here
    if not record.rests_on_data or own < ENOUGH_PAIRS:
        return None
    estimate = recalled(record, Prior()).estimate()
    return estimate.edge_samples_ms if (estimate.probability or 0.0) >= 0.5 else None


def _difference(first: _Session, second: _Session) -> Difference:
    (one, one_ms), (other, other_ms) = first, second
    same = is_same_person(one.header.subject, other.header.subject)
    if one_ms is None or other_ms is None:
        which = " and ".join(record.path.name for record, edges_ms in (first, second) if edges_ms is None)
        nothing = f"There is probably no window, or too little was measured: {which}"
        return Difference(one, other, same, obstacle=nothing)
    if (incomparable := _incomparable(one, other)) is not None:
        return Difference(one, other, same, obstacle=f"{incomparable} cannot be compared")
    unlike = one.header.visit.unlike(other.header.visit)
    reason = "" if unlike is None else f"The sessions are of {unlike}, which may be the reason of a difference"
    probability, obstacle = _moved(one, other) if same else (None, reason)
    spaces = one.header.space, other.header.space
    low_ms, high_ms = max(space.low_ms for space in spaces), min(space.high_ms for space in spaces)
    # An edge beyond one session's range may lie within the other's: they are compared where both looked.
    seen_ms = one_ms.clip(low_ms, high_ms), other_ms.clip(low_ms, high_ms)
    starts, ends = (_later(*(edges_ms[:, edge] for edges_ms in seen_ms)) for edge in (0, 1))
    return Difference(one, other, same, starts, ends, probability, obstacle)


def _incomparable(one: SessionRecord, other: SessionRecord) -> str | None:
    """The windows of two sessions, and why they cannot be compared; None if they can."""
    if one.header.conditioning != other.header.conditioning:
        return "The sessions have different conditioning stimuli, so windows"
    if (apart_ms := too_far_apart_ms((one, other))) is not None:
        delays = f"The sessions were run on rigs with different hit delays, {apart_ms[0]:g} and {apart_ms[1]:g} ms"
        return f"{delays}, so their windows, which count from the valve command,"
    first, second = one.header.space, other.header.space
    if first.low_ms < second.high_ms and second.low_ms < first.high_ms:
        return None
    ranges = f"{first.low_ms:g}–{first.high_ms:g} and {second.low_ms:g}–{second.high_ms:g} ms"
    return f"The ranges of ISIs, {ranges}, have nothing in common, so windows"


def _moved(first: SessionRecord, second: SessionRecord) -> tuple[float | None, str]:
    earlier, later = sorted((first, second), key=lambda record: record.header.created)
    try:
        return moved(earlier, later), ""
    except InvalidValueError as error:  # of another muscle; or, with the first day known, probably without a window
        return None, f"{error.what[0].upper()}{error.what[1:]}"


def _later(first_ms: FloatArray, second_ms: FloatArray) -> float:
    """Probability that a draw of the second is larger; ties, such as two edges beyond the range, count half."""
    larger, equal = second_ms[:, None] > first_ms, second_ms[:, None] == first_ms
    return float(np.mean(larger + 0.5 * equal))
