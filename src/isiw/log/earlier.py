"""Logs without kinds of decisions and findings: earlier versions wrote sentences alone, which say what they were.

Nothing else reads meaning out of a text. The words are those of these versions, and are never to be changed.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, TypeVar

from isiw.findings import Kind
from isiw.log.schema import Estimate, Event, Record
from isiw.strategy.stopping import StopKind

__all__ = ["with_kinds"]

_KindT = TypeVar("_KindT", Kind, StopKind)

_DECISIONS: Final[Mapping[str, StopKind]] = MappingProxyType(
    {
        "The session is paused": StopKind.PAUSED,
        "There is no window": StopKind.ABSENT,
        "There is probably no window": StopKind.ABSENT,
        "The probability that there is no window is": StopKind.ABSENT,
        "The probability of a window is not known": StopKind.ABSENT,
        "The window is known": StopKind.KNOWN,
        "The window is not known well enough yet": StopKind.KNOWN,
        "The window as it is known so far": StopKind.KNOWN,
        "The F1 to be expected is not known": StopKind.KNOWN,
        "to the expected F1": StopKind.SMALL_GAIN,
        "windows in a row yet": StopKind.SETTLED,
        "The window has": StopKind.SETTLED,
        "The particles have": StopKind.SETTLED,
        "No generation of particles": StopKind.SETTLED,
        "The scan of ISIs has": StopKind.SETTLED,
        "too few to speak of a window": StopKind.TOO_LITTLE,
        "so nothing is known about a window": StopKind.TOO_LITTLE,
        "stimuli is used up": StopKind.BUDGET,
        "stimuli are left": StopKind.BUDGET,
        "stimulus is left": StopKind.BUDGET,
        "pulses is reached": StopKind.LIMIT,
    }
)

_FINDINGS: Final[Mapping[str, Kind]] = MappingProxyType(
    {
        "the steepest edge of the EMG is at": Kind.STRAY_EDGE,
        "RMS, more than any muscle's at rest": Kind.LOUD,
        "RMS, less than any amplifier's noise": Kind.QUIET,
        "is that of the one before, sample by sample": Kind.REPEATED,
        "after the pulse, outside the MEP window of": Kind.MISPLACED,
        "the EMG is much larger just before the MEP window": Kind.ARTEFACT,
        "amplitudes are exactly equal": Kind.EQUAL,
        "amplitudes are almost equal": Kind.EQUAL,
        "pulses evoked an MEP: every amplitude is 0": Kind.SILENT,
        "pulses evoked an MEP, though earlier ones did": Kind.STOPPED,
        "µV, less than EMG at rest has": Kind.SMALL,
        "more than most muscles give": Kind.LARGE,
        "times as large as those before": Kind.JUMP,
        "ms is far from the": Kind.ISI_FAR,
    }
)


def with_kinds(record: Record) -> Record:
    """A record of a log with the kinds that an earlier version left to its sentences.

    Args:
        record: as it was logged.
    """
    if isinstance(record, Estimate) and "stop_kind" not in record.model_fields_set:
        return record.model_copy(update={"stop_kind": _kind(record.reason, _DECISIONS) or StopKind.OWN})
    if isinstance(record, Event) and record.kind in {"doubt", "pause"} and "finding" not in record.model_fields_set:
        return record.model_copy(update={"finding": _kind(record.text, _FINDINGS)})
    return record


def _kind(text: str, table: Mapping[str, _KindT]) -> _KindT | None:
    return next((kind for words, kind in table.items() if words in text), None)
