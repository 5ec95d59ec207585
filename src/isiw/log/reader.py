"""Reading a log: a session as values, whatever state its file is in."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import pandas as pd

from isiw.errors import DamagedLogError, LogError
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import SCHEMA_VERSION, Estimate, Event, Header, Intent, Record, Waveform, decode
from isiw.log.writer import CONFIGURATION
from isiw.strategy.stopping import StopDecision
from isiw.trials import Channel, Trial, TrialTable
from isiw.window import ENOUGH_PAIRS

__all__ = ["SessionRecord", "read_salvaged", "read_session"]


@dataclass(frozen=True, eq=False)
class SessionRecord:
    """A session as its log tells it.

    Args:
        path: the file that was read.
        header: what the session is; of one that was resumed, what it went on with last.
        history: intents, trials, estimates and events, in the order in which they were logged.
        waveforms: the recorded channels, by trial and name.
        losses: what could not be read, a sentence each; empty where the log is whole.
        finished: whether the session closed its log.
    """

    path: Path
    header: Header
    history: tuple[Record, ...] = field(repr=False)
    waveforms: Mapping[tuple[int, str], Channel] = field(repr=False)
    losses: tuple[str, ...]
    finished: bool

    @cached_property
    def table(self) -> TrialTable:
        """All trials whose outcome was logged, excluded ones marked."""
        trials = sorted((r for r in self.history if isinstance(r, Trial)), key=lambda trial: trial.index)
        excluded = [e.trial for e in self.events if e.kind == "exclusion" and e.trial is not None]
        return TrialTable(tuple(trials)).excluding(excluded)

    @property
    def trials(self) -> pd.DataFrame:
        """All trials as a DataFrame, a row a trial, indexed by their number."""
        return self.table.to_frame()

    @property
    def rests_on_data(self) -> bool:
        """Whether enough pairs of stimuli count to speak of a window."""
        return sum(trial.isi_ms is not None for trial in self.table.told) >= ENOUGH_PAIRS

    @property
    def intents(self) -> tuple[Intent, ...]:
        """What was about to be delivered."""
        return tuple(r for r in self.history if isinstance(r, Intent))

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """What was believed, trial by trial."""
        return tuple(r for r in self.history if isinstance(r, Estimate))

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened to the session."""
        return tuple(r for r in self.history if isinstance(r, Event))

    @property
    def decision(self) -> StopDecision | None:
        """The last decision; None before the first trial."""
        return self.estimates[-1].decision if self.estimates else None

    @cached_property
    def unknown(self) -> tuple[Intent, ...]:
        """Stimuli that were delivered, or may have been, and whose outcome is not in the log."""
        known = {trial.index for trial in self.table}
        intents = {intent.trial: intent for intent in self.intents}
        last = max(itertools.chain(known, intents), default=-1)
        return tuple(
            intents.get(number, Intent(trial=number, isi_ms=None)) for number in range(last + 1) if number not in known
        )

    def sweep(self, trial: int) -> dict[str, Channel]:
        """The waveforms of one trial, by channel."""
        return {name: channel for (number, name), channel in self.waveforms.items() if number == trial}


def read_session(path: str | Path) -> SessionRecord:
    """Read a log, finished or not, whole or damaged; `losses` says what is missing.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one from a newer version.
        DamagedLogError: a log of which not even the header can be read.
    """
    return read_salvaged(salvage(path))


def read_salvaged(salvaged: Salvage) -> SessionRecord:
    """The session in what was salvaged from a log."""
    losses, waveforms, history = list(salvaged.losses), {}, []
    header: Header | None = None
    for message in salvaged.messages:
        try:
            record = decode(message.topic, message.data)
        except ValueError as error:
            losses.append(f"A record on {message.topic} makes no sense and is left out: {error}")
            continue
        if isinstance(record, Header):
            header = record
        elif isinstance(record, Waveform):
            waveforms[record.trial, message.topic.removeprefix("/")] = record.channel()
        else:
            history.append(record)
    if header is None or (losses and CONFIGURATION in salvaged.attachments):
        header = _header_from_attachment(salvaged)  # what is lost may have been the last header
    header = _checked_version(header, salvaged.path)
    return SessionRecord(salvaged.path, header, tuple(history), waveforms, tuple(losses), salvaged.finished)


def _header_from_attachment(salvaged: Salvage) -> Header:
    text = salvaged.attachments.get(CONFIGURATION, b"")
    try:
        return Header.model_validate(tomllib.loads(text.decode()))
    except ValueError as error:
        raise DamagedLogError(
            "the log's header is lost",
            got=str(salvaged.path),
            remedy="Its records may still be readable with any MCAP tool.",
        ) from error


def _checked_version(header: Header, path: Path) -> Header:
    if header.schema_version > SCHEMA_VERSION:
        raise LogError(
            "the log was written by a newer isiw",
            got=f"schema version {header.schema_version} in {path}",
            expected=f"{SCHEMA_VERSION} or older",
            remedy="Upgrade isiw.",
        )
    return header
