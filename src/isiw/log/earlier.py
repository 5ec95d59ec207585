"""Logs without kinds of decisions and findings: earlier versions wrote sentences alone, which say what they were.

Nothing else reads meaning out of a text. The words are those of these versions, and are never to be changed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, TypeVar

from isiw.findings import Kind
from isiw.log.schema import EstimateRecord, Event, Record
from isiw.strategy.stopping import StopKind

_KindT = TypeVar("_KindT", Kind, StopKind)

_KEY_IN_TEXT: Final = re.compile(r" \(key ([A-Za-z0-9_-]{1,64})\)$")
"""Before notes had a key, their text ended with it."""

_DECISIONS: Final[Mapping[StopKind, tuple[str, ...]]] = {
    StopKind.PAUSED: ("The session is paused", "The session was ended before its time"),
    StopKind.ABSENT: ("There is no window", "There is probably no window", "The probability "),
    StopKind.KNOWN: ("The window is ", "The window as it is known so far", "The F1 to be expected is not known"),
    StopKind.SMALL_GAIN: ("to the expected F1",),
    StopKind.SETTLED: ("windows in a row yet", "The window has", "The particles have", "No generation of particles",
                       "The scan of ISIs has"),
    StopKind.TOO_LITTLE: ("too few to speak of a window", "so nothing is known about a window"),
    StopKind.BUDGET: ("stimuli is used up", "stimuli are left", "stimulus is left"),
    StopKind.LIMIT: ("pulses is reached",),
}  # fmt: skip

_FINDINGS: Final[Mapping[Kind, tuple[str, ...]]] = {
    Kind.STRAY_EDGE: ("the steepest edge of the EMG is at",),
    Kind.LOUD: ("RMS, more than any muscle's at rest",),
    Kind.QUIET: ("RMS, less than any amplifier's noise",),
    Kind.REPEATED: ("is that of the one before, sample by sample",),
    Kind.MISPLACED: ("after the pulse, outside the MEP window of",),
    Kind.ARTEFACT: ("the EMG is much larger just before the MEP window",),
    Kind.EQUAL: ("amplitudes are exactly equal", "amplitudes are almost equal"),
    Kind.SILENT: ("pulses evoked an MEP: every amplitude is 0",),
    Kind.STOPPED: ("pulses evoked an MEP, though earlier ones did",),
    Kind.SMALL: ("µV, less than EMG at rest has",),
    Kind.LARGE: ("more than most muscles give",),
    Kind.JUMP: ("times as large as those before",),
    Kind.ISI_FAR: ("ms is far from the",),
}


def with_kinds(record: Record) -> Record:
    """A record of a log with the kinds that an earlier version left to its sentences."""
    if isinstance(record, EstimateRecord) and "stop_kind" not in record.model_fields_set:
        return record.model_copy(update={"stop_kind": _kind(record.reason, _DECISIONS) or StopKind.OWN})
    if isinstance(record, Event) and record.kind in {"doubt", "pause"} and "finding" not in record.model_fields_set:
        return record.model_copy(update={"finding": _kind(record.text, _FINDINGS)})
    if isinstance(record, Event) and record.kind == "note" and "key" not in record.model_fields_set:
        return record.model_copy(update={"key": (found := _KEY_IN_TEXT.search(record.text)) and found[1]})
    return record


def _kind(text: str, table: Mapping[_KindT, tuple[str, ...]]) -> _KindT | None:
    return next((kind for kind, said in table.items() if any(words in text for words in said)), None)
