from __future__ import annotations

import json

import pytest

from isiw.decision import StopKind
from isiw.findings import Kind
from isiw.log.records import with_kinds
from isiw.log.schema import EstimateRecord, Event, EventKind, Record, decode
from isiw.log.writer import encode


def earlier(topic: str, record: Record, lacking: str) -> Record:
    """A record as a version wrote it that did not know a field."""
    written = json.loads(encode(topic, record))
    written.pop(lacking)
    return with_kinds(decode(topic, json.dumps(written).encode()))


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        ("12 stimuli are left. The window is not known well enough yet: the 90 % intervals span 9 ms.", StopKind.KNOWN),
        ("There is probably no window, with probability 0.91.", StopKind.ABSENT),
        ("Another 10 stimuli would add little: the last 10 stimuli added 0.01 to the expected F1, now 0.80.",
         StopKind.SMALL_GAIN),
        ("The particles have converged: they have an SD of 20 ms.", StopKind.SETTLED),
        ("No MEP was seen in any trial that counts, so nothing is known about a window.", StopKind.TOO_LITTLE),
        ("The budget of 20 stimuli is used up.", StopKind.BUDGET),
        ("The session is paused: There is no window, they say.", StopKind.PAUSED),
        ("The lab's time window is over.", StopKind.OWN),
    ],
)  # fmt: skip
def test_a_decision_that_was_logged_as_a_sentence_has_the_kind_that_it_said(reason: str, kind: StopKind) -> None:
    record = earlier("/estimate", EstimateRecord(trial=1, probability=0.5, reason=reason), "stop_kind")
    assert isinstance(record, EstimateRecord)
    assert record.decision.kind is kind


@pytest.mark.parametrize(
    ("event", "text", "finding"),
    [
        ("pause", "In 4 trials the EMG has a response at about 47 ms after the pulse, outside the MEP window of 15 ms",
         Kind.MISPLACED),
        ("doubt", "The last 4 amplitudes are exactly equal (0.12 mV). Is the EMG still recorded?", Kind.EQUAL),
        ("pause", "Paused by the operator.", None),
        ("note", "The last 4 amplitudes are exactly equal (0.12 mV).", None),
    ],
)  # fmt: skip
def test_a_doubt_or_a_pause_that_was_logged_as_a_sentence_has_the_kind_that_it_said(
    event: EventKind, text: str, finding: Kind | None
) -> None:
    record = earlier("/event", Event(kind=event, text=text), "finding")
    assert isinstance(record, Event)
    assert record.finding is finding


def test_of_a_log_with_kinds_no_sentence_is_read() -> None:
    decided = EstimateRecord(trial=1, probability=0.5, reason="The window is known.", stop_kind=StopKind.OWN)
    assert with_kinds(decode("/estimate", encode("/estimate", decided))) == decided
    paused = Event(kind="pause", text="The last 4 amplitudes are exactly equal (0.12 mV).")
    assert with_kinds(decode("/event", encode("/event", paused))) == paused
