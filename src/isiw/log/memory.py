"""What a session still knows of its log when the file is shortened behind its back: all but waveforms and estimates."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from isiw.errors import LogError
from isiw.log.salvage import Message, salvage_file
from isiw.log.topics import is_of_isiw

_LAST_ONLY: Final = frozenset({"/estimate", "/threshold/belief"})
"""Topics of large records, which follow from the others."""


class Memory:
    """The records of a log that is being written, without waveforms, and of estimates the last."""

    def __init__(self) -> None:
        self._messages: dict[int, Message] = {}
        self._last: dict[str, int] = {}

    def keep(self, message: Message) -> None:
        """Keep a record, if it is one to be kept."""
        if not is_of_isiw(message.topic):
            return
        if message.topic in _LAST_ONLY:
            self._messages.pop(self._last.get(message.topic, -1), None)
            self._last[message.topic] = message.sequence
        self._messages[message.sequence] = message

    def completing(self, found: Iterable[Message]) -> list[Message] | None:
        """What was found and what is known beside it, in order; None where everything that is known was found."""
        there = {message.sequence: message for message in found if is_of_isiw(message.topic)}
        if all(there.get(number, message).data == message.data for number, message in self._messages.items()) and (
            there.keys() >= self._messages.keys()
        ):
            return None
        records = {message.sequence: message for message in found} | self._messages
        return [records[number] for number in sorted(records)]


def found_in(file: Path) -> list[Message]:
    """The records that can still be read in a file; none where it is no log any more."""
    try:
        return salvage_file(file).messages
    except LogError:
        return []
