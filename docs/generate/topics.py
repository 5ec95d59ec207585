"""The topics of a log, with the fields of their records."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from docs.generate.meanings import MEANINGS
from docs.generate.schemas import fields
from docs.generate.tables import cell, sentence
from pydantic import TypeAdapter

from isiw.log import schema
from isiw.log.headers import ThresholdHeader
from isiw.log.schema import Waveform

_KINDS = (
    "Its header says of which kind it is: `session`, `imported` (trials that were delivered without isiw, "
    "[decision 28](../decisions/0028-trials-delivered-without-isiw.md)), `threshold`, or `production` (interval "
    "production, which has topics of its own). Older headers have no kind; their fields say which it is "
    "([decision 21](../decisions/0021-headers-say-their-kind.md))."
)


def pages() -> Iterator[tuple[str, str]]:
    """One page."""
    lines = (schema.__doc__ or "").splitlines()
    parts = [
        "# Topics of a log\n\nA log is an [MCAP](https://mcap.dev) file of JSON records, a topic for each kind. "
        f"[Decision 1](../decisions/0001-the-log.md) says why. {_KINDS}\n\n```text\n"
        + "\n".join(lines).strip()
        + "\n```\n"
    ]
    for title, kind in kinds().items():
        schema_of_kind = TypeAdapter(kind).json_schema(mode="serialization")
        known = MEANINGS.get(title.replace("`", ""))
        parts.append(f"\n## {title}\n\n{cell(sentence(kind))}\n\n{fields(schema_of_kind, kind, known=known)}")
    yield "log-topics.md", "".join(parts)


def kinds() -> dict[str, Any]:
    """The kind of record of each topic, by the title of its section."""
    own = {f"`{topic}`": kind for topic, kind in schema.KINDS.items()}
    return own | {"`/header` of a motor threshold": ThresholdHeader, "Any other topic: a channel's waveforms": Waveform}
