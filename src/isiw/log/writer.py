"""Writing a log: every record is appended, and durable once `sync` has returned."""

from __future__ import annotations

import datetime as dt
import json
import threading
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import IO, Final, Self, cast

import tomli_w
from mcap.writer import Writer
from pydantic_core import PydanticSerializationError

from isiw.checks import MOST_TRIALS
from isiw.errors import InvalidValueError, LogError, error_text, os_errors
from isiw.files import beside
from isiw.log.codes import require_one_spelling
from isiw.log.durable import DurableFile, begun, claimed, keep_damaged
from isiw.log.headers import AnyHeader, ThresholdHeader
from isiw.log.moments import boot_id
from isiw.log.names import COPYING, own_file, require_free, require_unchanged
from isiw.log.places import Fingerprint, log_of, part_of
from isiw.log.records import MOST_LOSSES, Records
from isiw.log.salvage import Salvage, salvage_file
from isiw.log.schema import (
    ANNOUNCEMENT,
    CHANNEL_IDS,
    CONFIGURATION,
    KINDS,
    Event,
    EventKind,
    Message,
    Record,
    Waveform,
    adapter,
    is_of_isiw,
    waveform_topic,
)

_FROM_MEMORY = "Header, trials and events are written from memory; waveforms and estimates may be lost."


_TOPIC_OF_KIND = {kind: topic for topic, kind in KINDS.items()} | {ThresholdHeader: "/header"}


def topic_of(record: Record, channel_name: str | None = None) -> str:
    """The topic of a record."""
    return waveform_topic(channel_name or "") if isinstance(record, Waveform) else _TOPIC_OF_KIND[type(record)]


def encode(topic: str, record: Record) -> bytes:
    """A record as JSON."""
    try:
        return adapter(topic).dump_json(record)
    except (PydanticSerializationError, UnicodeEncodeError) as error:
        raise InvalidValueError(
            f"a record of {topic} cannot be written as JSON",
            got=error_text(error),
            remedy="Look at the names, units and texts that the device gives.",
        ) from error


@cache
def json_schema(topic: str) -> tuple[str, bytes]:
    """Name and JSON schema of a topic's records; the root is an object."""
    kind = KINDS.get(topic, Waveform)
    schema = {"type": "object"} | adapter(topic).json_schema(mode="serialization")
    return f"isiw.{schema.get('title', kind.__name__)}", json.dumps(schema).encode()


_END_NS: Final = 2**64


def clock_ns() -> int:
    """The time by the computer's clock [ns since 1970]."""
    now_ns = time.time_ns()
    if not 0 <= now_ns < _END_NS:
        raise LogError(
            "the computer's clock is wrong: no log can hold its time",
            got=f"{now_ns // 10**9} s from the beginning of 1970",
            expected="a time from 1970 to 2554",
            remedy="Set the clock, then begin again.",
        )
    return now_ns


def log_time_ns() -> int:
    """The same for a record; 0 if the clock of a running session has been set to a time that no log can hold."""
    return now_ns if 0 <= (now_ns := time.time_ns()) < _END_NS else 0


def now() -> dt.datetime:
    """The same as date and time, in UTC."""
    return dt.datetime.fromtimestamp(clock_ns() // 10**9, dt.UTC)


def as_toml(header: AnyHeader) -> bytes:
    """A header as a log has it once more, as TOML."""
    try:
        return tomli_w.dumps(header.model_dump(mode="json", exclude_none=True)).encode()
    except (TypeError, ValueError) as error:
        raise LogError(
            f"the header cannot be written: {error}",
            remedy="Give subject, config and the strategy's settings as TOML values, and leave out what is None.",
        ) from error


class LogWriter:
    """One session's log: `FILE.part` while it is written, `FILE` once it is closed.

    Use `LogWriter.create` or `LogWriter.continuing`; as a context manager it closes itself.
    """

    def __init__(self, path: Path, file: DurableFile) -> None:
        self.path = path
        self._file = file
        self._lock = threading.RLock()
        # Its annotation asks for a whole file; write, tell and flush are what it uses.
        self._writer = Writer(cast("IO[bytes]", file), enable_data_crcs=True)
        self._channels: dict[str, int] = {}
        self._records = 0
        self._memory = Memory()
        self._log_time_ns = 0
        self._replaces: Fingerprint | None = None
        self._writer.start(profile="isiw", library="isiw")
        for topic in CHANNEL_IDS:
            self._register(topic)

    @classmethod
    def create(cls, path: str | Path, header: AnyHeader) -> Self:
        """Start a new log; it has its name once its header is on the disk, so that every log says whose it is."""
        target = Path(path)
        with os_errors(LogError, "the log cannot be created", target, "Make room, or choose another path."):
            require_free(target)
            require_one_spelling(target.parent, header)
            with begun(beside(target), target) as file:
                log = cls(target, file)
                log.begin(header)
                log.append(header)
                log._writer.flush()
                try:
                    file.move_to(part_of(target), replacing=False)
                except BaseException as error:
                    if file.path == part_of(target):  # nothing is in it yet, and it would be in the way of the next try
                        file.path.unlink()
                    if isinstance(error, FileExistsError):  # another session was faster, which has a way on of its own
                        require_free(target)
                    raise
        return log

    @classmethod
    def continuing(
        cls, path: str | Path, salvage: Salvage, header: AnyHeader, as_resumed: AnyHeader | None = None
    ) -> Self:
        """Continue a salvaged log; the old file stays until the copy is durable, and for good if it is damaged."""
        target = log_of(Path(path))
        in_words = os_errors(LogError, "the log cannot be continued", target, "It stays as it was.")
        with claimed(salvage.path) as source, in_words:
            require_unchanged(source, salvage)
            replaces = own_file(target, salvage)
            require_unchanged(source, salvage)  # again, for a session that went on with it and ended just now
            copy = target.with_name(f"{target.name}{COPYING}")
            copy.unlink(missing_ok=True)  # of an earlier attempt that was killed; its source is still whole
            with begun(copy) as file:
                log = cls(target, file)
                log._replaces = replaces
                log._copy_all(salvage, header, as_resumed)
                if salvage.losses:
                    keep_damaged(salvage.path, target)
                file.move_to(part_of(target), replacing=True, source=source)
        return log

    def _copy_all(self, salvage: Salvage, header: AnyHeader, as_resumed: AnyHeader | None) -> None:
        self.begin(as_resumed or header, None if as_resumed else salvage.attachments.get(CONFIGURATION))
        if not any(message.topic == topic_of(header) for message in salvage.messages):
            self.append(header)
        for message in salvage.messages:
            self._copy(message)
            if is_of_isiw(message.topic):  # what a damaged byte costs is then a trial, as in a log that a session wrote
                self._writer.flush()
        if salvage.losses:
            self.append(_damage(salvage))
        if as_resumed is not None:
            self.append(as_resumed)
        self.sync()

    def begin(self, header: AnyHeader, configuration: bytes | None = None) -> None:
        """Write what is not a message: metadata for tools that list files, and the header as TOML."""
        self._header = header
        facts = {
            "isiw_version": header.isiw_version,
            "schema_version": str(header.schema_version),
            "subject": header.subject,
            "seed": str(header.seed),
            "created": header.created,
            "boot_id": boot_id(),  # by which the logs of this start of the computer are found, whatever its clock shows
        }
        configuration = configuration or as_toml(header)
        now_ns = clock_ns()
        self._writer.add_metadata("session", facts)
        self._writer.add_attachment(now_ns, now_ns, CONFIGURATION, "application/toml", configuration)

    @property
    def is_open(self) -> bool:
        """True if anything can still be added."""
        return not self._file.closed

    def append(self, record: Record, channel_name: str | None = None) -> None:
        """Append a record; it is durable after the next `sync`."""
        topic = topic_of(record, channel_name)
        data = encode(topic, record)
        with self._lock:
            self._copy(Message(topic, data, log_time_ns()))

    def sync(self) -> None:
        """Return when everything appended is on the disk."""
        with self._lock:
            if not self.is_open:
                raise LogError(
                    "the log is closed, so nothing can be added to it",
                    got=str(self.path),
                    remedy="Resume it to continue.",
                )
            self._writer.flush()
            self._file.sync()

    def require_in_place(self) -> None:
        """Raise if what was synced is no longer at the log's path; to be called after `sync`."""
        with self._lock:
            displacement = self._file.displacement()
        if displacement is not None:
            raise LogError(
                f"the log is no longer as it was written: {displacement}",
                got=str(self._file.path),
                remedy="Nothing more is delivered. What can be saved of it is saved when the session ends.",
            )

    def discard(self) -> None:
        """Remove a log in which there is nothing to keep."""
        with self._lock:
            in_place = self._file.displacement() is None
            self._file.close()
            if in_place:
                self._file.path.unlink()

    def abandon(self, source: Path) -> bool:
        """Let go of a copy; True if it was of a closed log that is still there, and is removed."""
        is_spare = source == self.path and self.path.exists() and Fingerprint.of(self.path) == self._replaces
        self._file.abandon()
        if is_spare:
            self._file.path.unlink()
        return is_spare

    def close(self) -> None:
        """Finish the log and give it its name; what it went on from is the only file that it replaces.

        Nothing happens if it is closed already.
        """
        with self._lock:
            if not self.is_open:
                return
            try:
                self._writer.finish()
                self._file.flush()
                self._save_if_displaced()
                complete = f"It is complete, at {self._file.path}."
                with os_errors(LogError, "the finished log cannot be renamed", self._file.path, complete):
                    self._take_its_name()
            finally:
                self._file.close()

    def _take_its_name(self) -> None:
        own = self.path.exists() and Fingerprint.of(self.path) == self._replaces
        try:
            try:
                self._file.move_to(self.path, replacing=own)
            except FileExistsError:
                if not own:
                    raise
                self.path.unlink()  # a disk that renames over no file: the log is whole under its other name
                self._file.move_to(self.path, replacing=False)
        except FileExistsError as error:
            raise LogError(
                "another file has taken the log's place",
                got=str(self.path),
                remedy=f"The log is complete and stays at {self._file.path}; give it another name.",
            ) from error

    def _save_if_displaced(self) -> None:
        displacement = self._file.displacement()
        if displacement is None:
            return
        copy = self._file.rescued(self.path)
        held = f"What the session still held of it is in {copy}."
        found: list[Message] = []
        with suppress(LogError):  # of a file that is no log any more
            found = salvage_file(copy).messages
        if (records := self._memory.completing(found)) is not None:
            self._write_from_memory(copy, records, displacement)
            held = f"{held} {_FROM_MEMORY}"
        raise LogError(f"the log is no longer as it was written: {displacement}", got=str(self._file.path), remedy=held)

    def _write_from_memory(self, copy: Path, records: Sequence[Message], displacement: str) -> None:
        """Put a log of what is known in the place of a copy that lacks some of it; gaps in its numbers are losses."""
        with begun(copy.with_name(f"{copy.name}{COPYING}")) as file:
            log = LogWriter(copy, file)
            log.begin(self._header)
            for record in records:
                log._records = record.sequence
                log._copy(record)
            log.append(Event(kind="fault", text=f"While the log was written {displacement}. {_FROM_MEMORY}"))
            log._writer.finish()
            file.move_to(copy, replacing=True)
            file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _copy(self, message: Message) -> None:
        self._log_time_ns = max(self._log_time_ns, message.log_time_ns)
        channel = self._register(message.topic)
        self._writer.add_message(channel, self._log_time_ns, message.data, self._log_time_ns, self._records)
        self._memory.keep(Message(message.topic, message.data, self._log_time_ns, self._records))
        self._records += 1

    def _register(self, topic: str) -> int:
        if topic not in self._channels:
            name, schema = json_schema(topic)
            schema_number = self._writer.register_schema(name, "jsonschema", schema)
            number = self._writer.register_channel(topic, "json", schema_number)
            if topic not in CHANNEL_IDS:
                self._writer.add_metadata(f"{ANNOUNCEMENT}{number}", {"id": str(number), "topic": topic})
            self._channels[topic] = number
        return self._channels[topic]


def _damage(salvage: Salvage) -> Event:
    """What a continued log had lost, as an event: its copy has no gap by which that would show."""
    last = min(Records.of(salvage).delivered, MOST_TRIALS) - 1
    kind: EventKind = "loss" if salvage.lost_records else "note"
    return Event(kind=kind, trial=None if last < 0 else last, text=" ".join(salvage.losses[:MOST_LOSSES]))


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
        """The records that were found and those known beside them, in order; None if all that are known were found."""
        there = {message.sequence: message for message in found if is_of_isiw(message.topic)}
        if all(there.get(number, message).data == message.data for number, message in self._messages.items()) and (
            there.keys() >= self._messages.keys()
        ):
            return None
        records = {message.sequence: message for message in found} | self._messages
        return [records[number] for number in sorted(records)]
