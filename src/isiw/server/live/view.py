"""The contents of a session's live page: gathered while it runs, and put into words when somebody looks."""

from __future__ import annotations

import itertools
import json
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

from isiw.devices.protocol import unprotected
from isiw.log.reader import SessionRecord
from isiw.log.schema import EstimateRecord, Event, Intent, Record, Waveform
from isiw.report.drawn import drawn
from isiw.report.tables import first_facts
from isiw.session.loop import Session
from isiw.session.sink import SessionUpdate
from isiw.session.steps import Pause
from isiw.text import plain
from isiw.trials import Trial

MOST_EVENTS: Final = 100
"""Events that the page lists; the log has all."""

UPDATE_S: Final = 0.1
"""The shortest time between two updates [s]."""

SHARE: Final = 0.01
"""Of the time that goes into making updates: a session that is faster than they are is not slowed down by them."""

AWAY_S: Final = 60.0
"""Who was there a shorter time ago is taken to come back, as after loading the page again [s]."""


class Shown(NamedTuple):
    """The contents of a page, and the state of the session that they are of."""

    state: object
    json: str


class View:
    """Keeps one session's last sweep, estimate and events; its threads call the follower's methods."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._estimate: EstimateRecord | None = None
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._coming: dict[tuple[int, str], Waveform] = {}
        self._sweep: dict[tuple[int, str], Waveform] = {}
        self._update: SessionUpdate | None = None
        self._numbers = itertools.count(1)
        self._news = self._viewers = 0
        self._has_begun = False
        self._seen_s: float | None = None
        self._shown, self._next_s = Shown(None, ""), 0.0
        self._facts = [(fact.name, plain(fact.value)) for fact in first_facts(self._record())]
        self.over = False

    def logged(self, record: Record, channel_name: str | None) -> None:
        """Keep what was logged."""
        self._has_begun = True
        if isinstance(record, Waveform):
            self._coming[record.trial, channel_name or ""] = record
            return
        if isinstance(record, Trial):
            self._sweep, self._coming = self._coming, {}
        elif isinstance(record, EstimateRecord):
            self._estimate = record
        elif isinstance(record, Event):
            self._events.append(record)
        if not isinstance(record, Intent):
            self._news = next(self._numbers)

    def updated(self, update: SessionUpdate) -> None:
        """Keep what is left of the session."""
        self._update = update
        self._news = next(self._numbers)

    def ended(self) -> None:
        """Nothing more comes."""
        self.over = True

    def is_attended(self) -> bool:
        """True if somebody has the page open, or had it a moment ago."""
        seen_s = self._seen_s
        return self._viewers > 0 or (seen_s is not None and time.monotonic() - seen_s < AWAY_S)

    @contextmanager
    def attended(self) -> Iterator[None]:
        """Within, somebody has the page open."""
        self._viewers += 1
        try:
            yield
        finally:
            self.seen()
            self._viewers -= 1

    def seen(self) -> None:
        """Somebody was there just now."""
        self._seen_s = time.monotonic()

    def shown(self) -> Shown:
        """The contents of the page now; put together once for all who look, and not too often."""
        state = (self._news, self._session.pause_waiting, self._session.running, self.over)
        if state != self._shown.state and (self.over or time.monotonic() >= self._next_s):
            begun_s = time.thread_time()
            self._shown = Shown(state, json.dumps(self._contents(), allow_nan=False, separators=(",", ":")))
            self._next_s = time.monotonic() + max(UPDATE_S, (time.thread_time() - begun_s) / SHARE)
        return self._shown

    @property
    def wait_s(self) -> float:
        """The time in which nothing new is put together [s]."""
        return self._next_s - time.monotonic()

    def _contents(self) -> dict[str, Any]:
        record, update, pause = self._record(), self._update, self._session.pause_waiting
        return {
            "phase": self._phase(pause),
            "pause": None if pause is None else {"number": pause.number, "reason": plain(pause.reason)},
            "subject": plain(record.header.subject) or "an unnamed subject",
            "facts": self._facts,
            "unprotected": plain(unprotected(record.header.device) or ""),
            "drawn": drawn(record),
            "delivered": len(record.table),
            "most": max(0, record.header.limits.max_pulses - record.header.given_before),
            "left": None if update is None else update.stimuli_left,
            "leftS": None if update is None else update.left_s,
            "events": [[event.trial, event.kind, plain(event.text)] for event in tuple(self._events)],
        }

    def _phase(self, pause: Pause | None) -> str:
        if self.over:
            return "over"
        if pause is not None:
            return "paused"
        if self._session.running:
            return "running"
        return "ending" if self._has_begun else "waiting"

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
