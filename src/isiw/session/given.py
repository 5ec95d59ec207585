"""Pulses of searches for the motor threshold, as what they are to a session: TMS alone over the recruitment curve."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.log.reader import ThresholdRecord
from isiw.log.schema import PulseOutcome
from isiw.session.threshold import search_of
from isiw.strategy.threshold.curve import CurvePulses
from isiw.trials import RESPONSE_MV, Status, Trial

_DIGITS: Final = 2
"""Of an intensity [% RMT]: no stimulator is set more finely."""


def given_pulses(records: Sequence[ThresholdRecord]) -> tuple[Trial, ...]:
    """All pulses of some searches, in their order, with their intensities in % of the threshold that was found.

    A response that was only seen is an amplitude above 50 µV, and one that was not seen an amplitude below. Lost pulses
    are mistrials, so that limits count them.

    Args:
        records: the searches, earliest first; pulses over a curve, and a search that found no threshold, take
            that of the one before.

    Raises:
        InvalidValueError: a search for the hot spot, one without a threshold, or two logs of one search.
    """
    _require_each_once(records)
    trials: list[Trial] = []
    threshold_pct_mso: float | None = None
    for record in records:
        if any(outcome.place_mm is not None for outcome in record.outcomes):
            raise InvalidValueError(
                "pulses of a search for the hot spot were given at many places, and show no recruitment curve",
                got=str(record.path),
                remedy="Leave this log out, and give that of the search for the threshold at the hot spot.",
            )
        search = search_of(record)
        own_pct_mso = search.estimate().threshold_pct_mso
        if threshold_pct_mso is None or not (own_pct_mso is None or isinstance(search.method, CurvePulses)):
            threshold_pct_mso = own_pct_mso
        if threshold_pct_mso is None:
            raise InvalidValueError(
                "the intensities of this search are shares of no known threshold",
                got=str(record.path),
                remedy="Continue it until it states a threshold, or give the log of one that does before it.",
            )
        trials += [_trial(len(trials) + n, pulse, threshold_pct_mso) for n, pulse in enumerate(record.outcomes)]
        first = len(trials)
        trials += [_lost(first + n) for n in range(len(record.unknown))]
    return tuple(trials)


def _require_each_once(records: Sequence[ThresholdRecord]) -> None:
    """Raise if two logs are of one search, such as a log and its copy: its pulses would count twice."""
    for first, second in itertools.combinations(records, 2):
        both = list(zip(first.intents, second.intents, strict=False))
        if first.header.created == second.header.created and both and all(one == other for one, other in both):
            raise InvalidValueError(
                "two logs are of the same search",
                got=f"{first.path} and {second.path}",
                expected="each search once",
                remedy="Leave one out.",
            )


def _trial(number: int, pulse: PulseOutcome, threshold_pct_mso: float) -> Trial:
    if pulse.reason or pulse.intensity_pct_mso is None:
        return _lost(number)
    seen: dict[str, Any] = {"mep_mv": pulse.mep_mv}
    if pulse.mep_mv is None:
        seen = {"mep_interval_mv": (RESPONSE_MV, math.inf) if pulse.response else (0.0, RESPONSE_MV)}
    pct_rmt = round(100.0 * pulse.intensity_pct_mso / threshold_pct_mso, _DIGITS)
    return Trial(number, Status.ACCEPTED, None, intensity_pct_rmt=pct_rmt, **seen)


def _lost(number: int) -> Trial:
    return Trial(number, Status.MISTRIAL, None, Kind.OUTCOME_UNKNOWN)
