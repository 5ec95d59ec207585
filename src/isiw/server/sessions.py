"""The sessions of a folder: each is a log, and those that are open can be driven."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, TypeVar

from isiw.devices.limits import USUAL_ITI_S
from isiw.errors import error_text
from isiw.files import made_folder, twin
from isiw.log.headers import SERVED_KEY
from isiw.log.places import log_exists, log_of, part_of
from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import Event
from isiw.server.answers import EstimateAnswer, Refusal, SessionAnswer, SessionEntry, TrialRow
from isiw.server.clients import logged_client, require_free
from isiw.server.driven import DrivenSession, not_open
from isiw.server.requests import NAME, CreateRequest, ResumeRequest
from isiw.session.replay import strategy_of
from isiw.session.resuming import open_session
from isiw.session.state import state_of
from isiw.session.terminal import alarm
from isiw.strategy.catalogue import known_settings, make_strategy

MOST_OPEN: Final = 20

ANYBODY: Final = ResumeRequest()
"""Resuming without a key."""

T = TypeVar("T")


class Sessions:
    """The sessions of a folder. Safe to use from several threads."""

    def __init__(self, folder: Path) -> None:
        self._folder = made_folder(folder).resolve()
        self._open: dict[str, DrivenSession] = {}
        self._opening: set[str] = set()
        self._lock = threading.Lock()

    def names(self) -> list[SessionEntry]:
        """All sessions of the folder."""
        found = {log_of(path).stem for pattern in ("*.mcap", "*.mcap.part") for path in self._folder.glob(pattern)}
        with self._lock:
            opened = set(self._open)
        return [SessionEntry(id=name, open=name in opened) for name in sorted(found) if re.fullmatch(NAME, name)]

    def opened(self, name: str) -> DrivenSession:
        """An open session."""
        with self._lock:
            session = self._open.get(name)
        if session is not None:
            return session
        self._existing(name)
        raise not_open(name)

    @contextmanager
    def driving(self, name: str) -> Iterator[DrivenSession]:
        """Within, nobody else drives an open session."""
        session = self.opened(name)
        try:
            with session.alone():
                yield session
        finally:
            if session.closed:
                with self._lock:
                    if self._open.get(name) is session:
                        del self._open[name]

    def create(self, request: CreateRequest) -> SessionAnswer:
        """Begin a session; the same request once more is answered as at first, as long as nothing was asked for."""
        path = self._path(request.id)
        if log_exists(path):
            record = self.record(request.id)
            if record.intents or record.header.config.get(SERVED_KEY) != _planned(request):
                raise Refusal(
                    409, "Exists", "there is a session with this id", got=request.id,
                    remedy="Choose another id, or resume it.", field="id",
                )  # fmt: skip
            return self.resume(request.id, ResumeRequest(client=request.client))
        if other := twin(path) or twin(part_of(path)):
            raise Refusal(
                409, "Exists", f"on other systems its log would be the same file as {other.name}", got=request.id,
                remedy="Choose an id that differs in more than capitals.", field="id",
            )  # fmt: skip
        with self._opened_as(request.id):
            return self._begin(request)

    def resume(self, name: str, request: ResumeRequest = ANYBODY) -> SessionAnswer:
        """Continue a session; a trial without an outcome becomes a mistrial, since it may have been delivered."""
        if self._is_open(name):
            with self.driving(name) as session:
                require_free(session.client, request.client, takeover=request.takeover)
                session.give_up()
                session.give_to(request.client)
                return session.stands()
        with self._opened_as(name):
            path, doubts = self._existing(name), list[str]()
            record = read_session(path)
            if not record.finished:  # a session that was closed is nobody's
                require_free(logged_client(record), request.client, takeover=request.takeover)
            strategy, lost = strategy_of(record.header), request.lost_pulses
            recorder = open_session(strategy, path, resume=True, lost_pulses=lost, on_doubt=doubts.append)
            return self._take(DrivenSession(name, record.header.subject, recorder, doubts, record), request.client)

    def close(self, name: str) -> SessionAnswer:
        """Close a session, if it is open; one that was open when its server was killed is resumed first."""
        if not self._is_open(name) and part_of(self._existing(name)).exists():
            self.resume(name, ResumeRequest(takeover=True))
        if self._is_open(name):
            with self.driving(name) as session:
                return session.close()
        return self.stands(name)

    def close_all(self) -> None:
        """Close all sessions, as the server ends; if one cannot be closed, the reason is shown."""
        for name in list(self._open):
            try:
                self.close(name)
            except Exception as error:  # noqa: BLE001 - the others are to be closed all the same
                with suppress(OSError, ValueError):  # the screen is gone
                    alarm(f"The session {name} was not closed ({error_text(error)}). It can be resumed.")

    def stands(self, name: str) -> SessionAnswer:
        """The state of a session, open or not."""
        return self._of(name, DrivenSession.stands, lambda record: _stood(name, record))

    def trials(self, name: str) -> list[TrialRow]:
        """The trials of a session, open or not."""
        trials = self._of(name, lambda session: session.recorder.trials, lambda record: record.table)
        return [TrialRow.of(trial) for trial in trials]

    def estimate(self, name: str) -> EstimateAnswer:
        """The estimate of the window, in a session that is open or not."""
        return self._of(name, DrivenSession.estimate, lambda record: _estimated(name, record))

    def record(self, name: str) -> SessionRecord:
        """The contents of a session's log by now."""
        record = read_session(self._existing(name))
        record.require_open()
        return record

    def _of(self, name: str, opened: Callable[[DrivenSession], T], logged: Callable[[SessionRecord], T]) -> T:
        """Something about a session: as it is open now, or else as its log has it."""
        if self._is_open(name):
            with self.driving(name) as session:
                return opened(session)
        return logged(self.record(name))

    def _is_open(self, name: str) -> bool:
        with self._lock:
            return name in self._open

    @contextmanager
    def _opened_as(self, name: str) -> Iterator[None]:
        """Within, nobody else opens a session of this name."""
        with self._lock:
            if name in self._opening or name in self._open:
                raise Refusal(409, "Busy", "the session is being opened", got=name, retry_s=1.0)
            if len(self._open) + len(self._opening) >= MOST_OPEN:
                raise Refusal(
                    409, "TooManyOpen", "too many sessions are open", expected=f"at most {MOST_OPEN}",
                    remedy="Close one that is over.",
                )  # fmt: skip
            self._opening.add(name)
        try:
            yield
        finally:
            with self._lock:
                self._opening.discard(name)

    def _begin(self, request: CreateRequest) -> SessionAnswer:
        space, doubts = request.space, list[str]()
        stated = {"intensity_pct_rmt": request.visit.intensity_pct_rmt}
        settings = known_settings(request.strategy.name, stated) | request.strategy.settings
        strategy = make_strategy(request.strategy.name, space=space, seed=request.seed, **settings)
        recorder = open_session(
            strategy,
            self._path(request.id),
            earlier=request.earlier.trials if request.earlier else (),
            limits=request.limits.within(space).stated(USUAL_ITI_S),
            subject=request.visit.subject,
            visit=request.visit.noted(),
            protocol=request.protocol,
            config={SERVED_KEY: _planned(request)},
            on_doubt=doubts.append,
        )
        return self._take(DrivenSession(request.id, request.visit.subject, recorder, doubts), request.client)

    def _take(self, session: DrivenSession, client: str | None) -> SessionAnswer:
        try:
            session.give_to(client)
            stands = session.stands()
        except BaseException:
            session.recorder.close()
            raise
        with self._lock:
            self._open[session.name] = session
        return stands

    def _path(self, name: str) -> Path:
        """Where the log of a session is, which is in the folder itself whatever its name."""
        if not re.fullmatch(NAME, name):
            raise Refusal(404, "NoSuchSession", "there is no such session", got=name)
        path = self._folder / f"{name}.mcap"
        if path.is_symlink() or part_of(path).is_symlink():
            raise Refusal(403, "SymbolicLink", "the log is a symbolic link, which is not followed", got=name)
        return path

    def _existing(self, name: str) -> Path:
        path = self._path(name)
        if not (path.is_file() or part_of(path).is_file()):
            raise Refusal(404, "NoSuchSession", "there is no such session", got=name, remedy="Create it first.")
        return path


def _planned(request: CreateRequest) -> str:
    """What a session is begun with, whoever begins it; a text, as in TOML there is no null."""
    return request.model_dump_json(exclude={"client"})


def _stood(name: str, record: SessionRecord) -> SessionAnswer:
    """The state in which a session is that is not open."""
    decision = record.decision
    return SessionAnswer.of(
        record.table,
        record.unknown[-1].stimulus if record.unknown else None,
        id=name,
        open=False,
        state=state_of(
            begun=bool(len(record.history)),
            running=False,
            paused=False,
            rests=False,
            fault=any(isinstance(last, Event) and last.kind == "fault" for last in record.history[-1:]),
        ),
        subject=record.header.subject,
        stop=decision is not None and decision.stop,
        reason=decision.reason if decision else "No trial has an outcome yet.",
        judged_since=decision is not None and record.is_judged_since,
    )


def _estimated(name: str, record: SessionRecord) -> EstimateAnswer:
    if not record.estimates:
        raise not_open(name)
    return EstimateAnswer.about(record.estimates[-1], record.too_little, judged_since=record.is_judged_since)
