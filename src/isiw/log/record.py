"""The record of a session: what its log holds, how much that says, and its trials as a table."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from pathlib import Path

from isiw.decision import StopDecision
from isiw.errors import InvalidValueError, LogError
from isiw.lazy import pd
from isiw.log import reader
from isiw.log.frames import trial_frame
from isiw.log.kinds import LogKind, of_another_kind
from isiw.log.reader import LoggedSession, ThresholdRecord, topics_of
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import EstimateRecord, Event
from isiw.log.verdicts import VERDICTS, doubted_by
from isiw.signals.plausible import is_silent
from isiw.summary import JUDGED_SINCE, lacking, summary
from isiw.text.sanitize import command


class SessionRecord(LoggedSession):
    """A session as its log has it, which prints itself in a few lines."""

    def __str__(self) -> str:
        header, last = self.header, self.estimates[-1] if self.estimates else None
        if self.conceals:
            return f"An intervention with {header.subject or 'an unnamed subject'}, its arm concealed\nLog: {self.path}"
        kind = "Imported trials" if header.imported else "Session"
        strategy = header.strategy.name or "of a user's own objects"
        lines = [
            f"{kind} of {header.subject or 'an unnamed subject'}, {self.begun or 'without a date'}",
            f"Strategy: {strategy}, seed {header.strategy.seed}, {header.space.in_words(header.stimulus)}",
            f"Trials: {self.table.counted(header.stimulus)}"
            + (f", {len(self.unknown)} of unknown outcome" if self.unknown else ""),
        ]
        if last is not None:
            lines += [self.too_little or summary(last), f"{'Ended' if last.stop else 'Not over'}: {last.reason}"]
            if self.is_judged_since:
                lines.append(JUDGED_SINCE)
        return "\n".join([*lines, *self.unread_said, *(f"Lost: {loss}" for loss in self.losses), f"Log: {self.path}"])

    @property
    def trials(self) -> pd.DataFrame:
        """All trials as a DataFrame, a row a trial, indexed by their number: onset, outcome, and the estimate after it.

        The columns are those of `isiw.log.frames.TRIAL_COLUMNS`.
        """
        return trial_frame(self)

    def require_open(self) -> None:
        """Raise if what is made of it would show a concealed arm."""
        if self.conceals:
            raise LogError(
                "the arm of this intervention is concealed, and this would show it",
                got=str(self.path),
                remedy="When nobody has to be blind any more, open it; that is logged: "
                f"{command('pair', '--open', self.path)}",
            )

    @property
    def unread_said(self) -> tuple[str, ...]:
        """A sentence for each part of the header that this version cannot read."""
        said = "The log's {} cannot be read by this version of isiw: {}"
        return tuple(said.format(part, why) for part, why in self.unread.items())

    @property
    def begun(self) -> str:
        """When it began, as ISO 8601 in UTC; empty of imported trials whose file does not say."""
        return "" if self.header.imported and not self.header.given_by else self.header.created

    @property
    def rests_on_data(self) -> bool:
        """True if enough pairs of stimuli count to speak of a window, and any trial showed an MEP."""
        return self.too_little is None

    @property
    def too_little(self) -> str | None:
        """A sentence if too little was measured, or too doubtful, to report a window; None if enough was."""
        found = lacking(self.pairs, silent=self.is_silent, in_doubt=self.in_doubt)
        return None if found is None else f"{found}"

    @property
    def in_doubt(self) -> bool:
        """True if realised ISIs are in doubt, which nobody has confirmed or judged."""
        return bool(doubted_by(self.events))

    @property
    def pairs(self) -> int:
        """The number of pairs of stimuli that count, those learnt first among them; trials with TMS alone do not."""
        return sum(trial.isi_ms is not None for trial in (*self.header.earlier, *self.table.told))

    @property
    def is_silent(self) -> bool:
        """True if enough trials count, those learnt first too, and each is 0, where the detection limit is too low."""
        return is_silent((*self.header.earlier, *self.table.told), self.header.detection_limit_mv)

    @property
    def is_judged_since(self) -> bool:
        """True if trials were judged after the last estimate, which is then outdated."""
        since = itertools.takewhile(lambda entry: not isinstance(entry, EstimateRecord), reversed(self.history))
        return any(isinstance(entry, Event) and entry.kind in VERDICTS for entry in since)

    @property
    def found(self) -> EstimateRecord | None:
        """The last estimate; None if there is none, or it rests on too little to speak of a window."""
        return self.estimates[-1] if self.estimates and self.rests_on_data else None

    @property
    def decision(self) -> StopDecision | None:
        """The last decision; None before the first trial."""
        return self.estimates[-1].decision if self.estimates else None


def read_session(path: str | Path, *, channels: Iterable[str] | None = None) -> SessionRecord:
    """Read a log, finished or not, whole or damaged; `losses` says what is missing.

    Args:
        path: the log, with or without `.part`.
        channels: the channels whose samples are wanted, such as `["emg"]`; waveforms of others have none. All by
            default; with fewer a log is read faster, and in less memory.

    Raises:
        LogError: no such file, not a log, or one from a newer version.
        DamagedLogError: a log of which not even the header can be read.
    """
    return read_salvaged(salvage(path, topics_of(channels)))


def read_salvaged(salvaged: Salvage) -> SessionRecord:
    """The session in what was salvaged from a log."""
    record = read_any(salvaged)
    if isinstance(record, ThresholdRecord):
        raise of_another_kind(record.path, LogKind.THRESHOLD, LogKind.SEARCH)
    return record


def read_any(salvaged: Salvage, wanted: LogKind = LogKind.SEARCH) -> SessionRecord | ThresholdRecord:
    """The record of a salvaged log in which a person is stimulated."""
    return reader.read_any(salvaged, wanted, SessionRecord)


def require_records(records: Iterable[object]) -> None:
    """Raise if these are no records of sessions, but the paths of their logs, say."""
    for record in records:
        if not isinstance(record, SessionRecord):
            raise InvalidValueError(
                "this is not a session record", got=record, remedy="Read the log first: isiw.read_session(path)."
            )
