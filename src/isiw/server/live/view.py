"""What the live page shows of a session: gathered while it runs, and put into words when somebody looks."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from isiw.log.reader import SessionRecord
from isiw.log.schema import Estimate, Event, Record, Waveform
from isiw.report.drawn import drawn
from isiw.report.facts import first_facts
from isiw.session.loop import Session
from isiw.session.updates import SessionUpdate
from isiw.text import plain
from isiw.trials import Trial

__all__ = ["View"]

MOST_EVENTS: Final = 100
"""Events that the page lists; the log has all."""

AWAY_S: Final = 60.0
"""A page that was closed for less is taken to be loaded again [s]."""


class View:
    """Follows one session. It keeps the last sweep, the last estimate and the last events, and no others.

    The session's loop calls what a follower is told, the server's thread everything else.

    Args:
        session: the session.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._estimate: Estimate | None = None
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._coming: dict[tuple[int, str], Waveform] = {}
        self._sweep: dict[tuple[int, str], Waveform] = {}
        self._update: SessionUpdate | None = None
        self._records = self._viewers = 0
        self._left_s: float | None = None
        self._shown: tuple[object, str] = (None, "")
        self.over = False

    def logged(self, record: Record, channel_name: str | None) -> None:
        """Keep what was logged."""
        if isinstance(record, Waveform):
            self._coming[record.trial, channel_name or ""] = record
        elif isinstance(record, Trial):
            self._sweep, self._coming = self._coming, {}
        elif isinstance(record, Estimate):
            self._estimate = record
        elif isinstance(record, Event):
            self._events.append(record)
        self._records += 1

    def updated(self, update: SessionUpdate) -> None:
        """Keep what is left of the session."""
        self._update = update
        self._records += 1

    def ended(self) -> None:
        """Nothing more comes."""
        self.over = True

    def is_attended(self) -> bool:
        """Whether somebody has the page open, or had it a moment ago."""
        left_s = self._left_s
        return self._viewers > 0 or (left_s is not None and time.monotonic() - left_s < AWAY_S)

    @contextmanager
    def attended(self) -> Iterator[None]:
        """Within, somebody has the page open."""
        self._viewers += 1
        try:
            yield
        finally:
            self._left_s = time.monotonic()
            self._viewers -= 1

    @property
    def state(self) -> object:
        """Differs where the page has something new to show."""
        return self._records, self._session.paused, self._session.running, self.over

    def shown(self) -> str:
        """What the page shows now, as JSON; put together once for all who look."""
        state = self.state
        if self._shown[0] != state:
            self._shown = state, json.dumps(self._contents(), allow_nan=False, separators=(",", ":"))
        return self._shown[1]

    def _contents(self) -> dict[str, Any]:
        record, update = self._record(), self._update
        return {
            "phase": self._phase(),
            "pause": plain(self._session.paused or ""),
            "subject": plain(record.header.subject) or "an unnamed subject",
            "facts": [[fact.name, plain(fact.value)] for fact in first_facts(record)],
            "drawn": drawn(record),
            "delivered": len(record.table),
            "most": record.header.limits.max_pulses,
            "left": None if update is None else update.stimuli_left,
            "leftS": None if update is None else update.left_s,
            "events": [[event.trial, event.kind, plain(event.text)] for event in tuple(self._events)],
        }

    def _phase(self) -> str:
        if self.over:
            return "over"
        if self._session.paused is not None:
            return "paused"
        return "running" if self._session.running else "waiting"

    def _record(self) -> SessionRecord:
        """The session as a log would tell it that had the last estimate and the last sweep alone."""
        estimate = self._estimate
        return SessionRecord(
            path=self._session.log_path,
            header=self._session.header,
            history=(*self._session.trials, *(() if estimate is None else (estimate,))),
            waveforms={key: waveform.channel() for key, waveform in self._sweep.items()},
            losses=(),
            finished=False,
        )


