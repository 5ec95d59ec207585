"""Topics: which record each carries, the number of its channel in the file, and its records as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, Final

from pydantic import TypeAdapter
from pydantic_core import PydanticSerializationError

from isiw.errors import InvalidValueError, told
from isiw.log.production import Production, ProductionHeader
from isiw.log.schema import (
    ANY_HEADER,
    MOST_TRIALS,
    EstimateRecord,
    Event,
    Header,
    Intent,
    PulseOutcome,
    Record,
    ThresholdBelief,
    ThresholdHeader,
    Waveform,
)
from isiw.text.json_texts import refuse_doubled
from isiw.trials import Trial

_KINDS: dict[str, type[Any]] = {
    "/header": Header,
    "/intent": Intent,
    "/trial": Trial,
    "/estimate": EstimateRecord,
    "/event": Event,
    "/threshold/pulse": PulseOutcome,
    "/threshold/belief": ThresholdBelief,
    "/production_header": ProductionHeader,
    "/production": Production,
}
_TOPIC_OF_KIND = {kind: topic for topic, kind in _KINDS.items()} | {ThresholdHeader: "/header"}

CHANNEL_IDS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "/header": 1,
        "/intent": 2,
        "/trial": 3,
        "/estimate": 4,
        "/event": 5,
        "/emg": 6,
        "/acceleration": 7,
        "/pressure": 8,
        "/force": 9,
        "/valve": 10,
    }
)
"""The channel numbers of the topics that every log has. They are frozen: a damaged log is read by them.

Any other topic takes the next free number in its file, and announces it there (`announcement`).
"""

ANNOUNCEMENT = "channel "


def announcement(number: int, topic: str) -> tuple[str, dict[str, str]]:
    """Name and content of the metadata that say which topic a further channel number has."""
    return f"{ANNOUNCEMENT}{number}", {"id": str(number), "topic": topic}


_ADAPTERS: dict[str, TypeAdapter[Any]] = {topic: TypeAdapter(kind) for topic, kind in _KINDS.items()} | {
    "/header": ANY_HEADER
}
_WAVEFORM: TypeAdapter[Any] = TypeAdapter(Waveform)


def adapter(topic: str) -> TypeAdapter[Any]:
    """What turns a topic's records into JSON and back; any topic that is not isiw's own holds waveforms."""
    return _ADAPTERS.get(topic, _WAVEFORM)


def is_of_isiw(topic: str) -> bool:
    """Whether a topic carries records of isiw's own, and not the waveforms of a channel."""
    return topic in _KINDS


def topic_of(record: Record, channel_name: str | None = None) -> str:
    """The topic of a record."""
    if not isinstance(record, Waveform):
        return _TOPIC_OF_KIND[type(record)]
    return waveform_topic(channel_name or "")


def waveform_topic(channel_name: str) -> str:
    """The topic of a channel's waveforms."""
    topic = f"/{channel_name}"
    if topic == "/" or topic in _KINDS or not channel_name.isprintable():  # half a surrogate pair is not printable
        raise InvalidValueError(
            "a waveform's channel cannot have this name", got=channel_name, remedy="Rename it in the device."
        )
    return topic


def encode(topic: str, record: Record) -> bytes:
    """A record as JSON."""
    try:
        return adapter(topic).dump_json(record)
    except (PydanticSerializationError, UnicodeEncodeError) as error:
        raise InvalidValueError(
            f"a record of {topic} cannot be written as JSON",
            got=told(error),
            remedy="Look at the names, units and texts that the device gives.",
        ) from error


def decode(topic: str, data: bytes) -> Record:
    """The record that was encoded."""
    record: Record = adapter(topic).validate_json(data)
    refuse_doubled(data)
    if isinstance(record, Trial) and record.index >= MOST_TRIALS:
        raise InvalidValueError("no session has so many trials", got=record.index, expected=f"below {MOST_TRIALS}")
    return record


def json_schema(topic: str) -> tuple[str, bytes]:
    """Name and JSON schema of a topic's records; the root is an object."""
    return _json_schema(topic if topic in _KINDS else "")


@cache
def _json_schema(topic: str) -> tuple[str, bytes]:
    kind = _KINDS.get(topic, Waveform)
    schema = {"type": "object"} | adapter(topic).json_schema(mode="serialization")
    return f"isiw.{schema.get('title', kind.__name__)}", json.dumps(schema).encode()
