"""The contents of a session's live page: gathered while it runs, and put into words when somebody looks."""

from __future__ import annotations

import itertools
import json
import math
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from isiw.devices.protocol import Readiness, unprotected
from isiw.log.continuing import continued_by
from isiw.log.record import SessionRecord
from isiw.log.schema import EstimateRecord, Event, Intent, Record, Waveform
from isiw.report.drawn import drawn
from isiw.report.tables import first_facts
from isiw.session.loop import Session
from isiw.session.sink import SessionUpdate
from isiw.session.state import SENTENCES, State
from isiw.text.sanitize import plain
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

    def __init__(self, session: Session, config: Path | None = None) -> None:
        self._session, self._config = session, config
        self._estimate: EstimateRecord | None = None
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._coming: dict[tuple[int, str], Waveform] = {}
        self._sweep: dict[tuple[int, str], Waveform] = {}
        self._update: SessionUpdate | None = None
        self._numbers = itertools.count(1)
        self._news = self._viewers = 0
        self._seen_s: float | None = None
        self._shown, self._rest, self._next_s = Shown(None, ""), Shown(None, ""), 0.0
        self._facts = [(fact.name, plain(fact.value)) for fact in first_facts(self._record())]
        self.over = False

    def logged(self, record: Record, channel_name: str | None) -> None:
        """Keep what was logged."""
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
        """The contents of the page now, put together once for all: the state at once, the rest not too often."""
        one = self._session
        state, rest = (
            (one.pause_waiting, one.state, one.armed, one.wait, self.over),
            (self._news, len(one.trials), self.over),
        )
        if rest != self._rest.state and (self.over or time.monotonic() >= self._next_s):
            begun_s = time.thread_time()
            self._rest = Shown(rest, _json(self._contents()))
            self._next_s = time.monotonic() + max(UPDATE_S, (time.thread_time() - begun_s) / SHARE)
        if (now := (state, self._rest.state)) != self._shown.state:
            self._shown = Shown(now, f"{_json(self._bar())[:-1]},{self._rest.json[1:]}")
        return self._shown

    @property
    def wait_s(self) -> float:
        """The time in which nothing new is put together [s]."""
        return self._next_s - time.monotonic()

    def _bar(self) -> dict[str, Any]:
        """The state of the session, which nobody waits for."""
        one = self._session
        state, pause, wait = one.state, one.pause_waiting, one.wait
        if state is State.PAUSED and pause is None:  # it was decided just now
            state = State.RUNS
        return {
            "state": state,
            "sentence": SENTENCES[state],
            "over": self.over,
            "armed": one.armed,
            "pause": None if pause is None else {"number": pause.number, "reason": plain(pause.reason)},
            "fault": self._fault(),
            "waitS": None if wait is None else round(max(0.0, wait.until_s - time.monotonic()), 1),
        }

    def _contents(self) -> dict[str, Any]:
        record, update = self._record(), self._update
        last = record.table[-1] if len(record.table) else None
        limit_uv = record.header.signals.most_background_uv
        readiness = self._session.readiness or Readiness()
        delivered, intervention = len(self._session.trials), record.header.intervention
        hides, unseen = intervention is not None and intervention.hides(delivered), 0
        if update is not None and intervention is not None:
            unseen = delivered - 1 - update.trial.index  # trials that would show a concealed arm
        return {
            "backgroundUv": None if last is None else last.background_rms_uv,
            "limitUv": limit_uv if math.isfinite(limit_uv) else None,
            "coilC": readiness.coil_c,
            "intensityPct": readiness.intensity_pct_mso,
            "subject": plain(record.header.subject) or "an unnamed subject",
            "facts": self._facts,
            "unprotected": plain(unprotected(record.header.device) or ""),
            "drawn": drawn(record),
            "delivered": delivered,
            "most": max(0, record.header.limits.max_pulses - record.header.given_before),
            "left": None if update is None else update.stimuli_left - unseen,
            "leftS": None if update is None or unseen else update.left_s,
            "hides": hides,
            "events": [[event.trial, event.kind, plain(event.text)] for event in tuple(self._events)],
        }

    def _fault(self) -> dict[str, str] | None:
        """What ended the session, if a fault did: what is to be done first."""
        if (fault := self._session.fault) is None:
            return None
        way_on = continued_by(self._session.log_path, self._session.header, self._config)
        do = f"See that the stimulator is disarmed. Then resume with: {way_on}"
        what = f"{fault.what[:1].upper()}{fault.what[1:]}. {fault.about_the_trial}".strip()
        return {"do": plain(do), "what": plain(what)}

    def _record(self) -> SessionRecord:
        """The session as a log would tell it that had the last estimate and the last sweep alone."""
        estimate = self._estimate
        return SessionRecord(
            path=self._session.log_path,
            header=self._session.header,
            history=(*self._session.shown_trials, *(() if estimate is None else (estimate,))),
            waveforms={key: waveform.channel() for key, waveform in self._sweep.items()},
            losses=(),
            finished=False,
        )


def _json(contents: dict[str, Any]) -> str:
    return json.dumps(contents, allow_nan=False, separators=(",", ":"))
