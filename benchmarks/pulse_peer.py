"""An instrument at the other end of a line, over TCP or a pseudo-terminal, that lies and fails and keeps a ledger.

It speaks the words of the timer in `clients/arduino`, and a few more: SET, GET, ARM, FIRE, ALONE, TAP, RESULT, STATUS,
DISARM. It fires nobody; it is there to try what talks to instruments.
"""

from __future__ import annotations

import os
import select
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import StrEnum
from typing import Any, Protocol

import numpy as np

from benchmarks.faulty_device import Fired
from isiw.checks import number

_NUMBERED = r"(?P<sequence>\d+) "

PEER_COMMANDS: Mapping[str, Any] = {
    "disarm": {"send": "{sequence} DISARM", "reply": _NUMBERED + "DISARMED"},
    "set": {"send": "{sequence} SET {isi_us}", "reply": _NUMBERED + "OK"},
    "read_back": {"send": "{sequence} GET", "reply": _NUMBERED + r"ISI (?P<isi_us>\S+)"},
    "arm": {"send": "{sequence} ARM", "reply": _NUMBERED + "ARMED"},
    "fire": {"send": "{sequence} FIRE {trial}", "reply": _NUMBERED + r"FIRED (?P<isi_us>\S+)"},
    "alone": {"send": "{sequence} ALONE {trial}", "reply": _NUMBERED + "FIRED"},
    "tap_alone": {"send": "{sequence} TAP {trial}", "reply": _NUMBERED + "FIRED"},
    "result": {"send": "{sequence} RESULT", "reply": _NUMBERED + r"MEP (?P<mep_uv>\S+)"},
    "status": {"send": "{sequence} STATUS", "reply": _NUMBERED + r"READY (?P<coil_c>\S+)"},
    "refusal": _NUMBERED + "ERR (?P<reason>.*)",
}
"""The peer's words, as `isiw.LineDevice` takes them."""

_SHIFT_US = 40_000
_ENDLESS_BYTES = 100_000
_GARBAGE = b"\x00\xff\x1b[2J{}%s\xb5"
_GLANCE_S = 0.02
_PIECE_S = 0.001


class Lie(StrEnum):
    """What can be wrong with an answer, or with what was done."""

    SETS_ANOTHER = "sets another ISI"
    GIVES_ANOTHER = "gives another ISI than it holds"
    REPORTS_ANOTHER = "reports another ISI than it gave"
    NAN = "answers with NaN"
    SILENT_BEFORE = "does nothing, and does not answer"
    SILENT_AFTER = "does it, and does not answer"
    LATE = "does it, and answers when the next command comes"
    SPLITS = "answers in pieces"
    REPEATS = "gives the answer before once more, then its own"
    OTHER_NUMBER = "answers under another number"
    DROPS_BEFORE = "drops the connection"
    DROPS_AFTER = "does it, and drops the connection"
    GARBAGE = "sends garbage, then answers"
    CORRUPTS = "answers with garbage in the middle"
    ENDLESS = "answers with a line without end"
    REFUSES = "refuses"


_OF_VERB = {
    Lie.SETS_ANOTHER: {"SET"},
    Lie.GIVES_ANOTHER: {"FIRE"},
    Lie.REPORTS_ANOTHER: {"FIRE"},
    Lie.NAN: {"GET", "FIRE", "RESULT", "STATUS"},
}
_NOTHING_DONE = {Lie.SILENT_BEFORE, Lie.DROPS_BEFORE, Lie.REFUSES}


class _Wire(Protocol):
    """One end of a connection."""

    def read(self) -> bytes: ...
    def write(self, data: bytes) -> None: ...


class PulsePeer:
    """An instrument that lies at random, and knows what it really gave.

    Firing uses up the arming. At most two answers to DISARM in a row are wrong by chance. A new connection ends the one
    before. Whether it is `armed`, the `ledger` of what it gave, the commands that it `heard` and the lies that
    `happened` may be looked at, and `wrong_isis`: what it gave [ms] in trials where it held another ISI.

    Args:
        seed: seed of the lies.
        rate: the share of commands that meet a lie.
        lies: which there may be.
        respond: the MEP [mV] after an ISI [ms]; None for a control trial.

    Raises:
        InvalidValueError: a rate that is no share.
    """

    def __init__(
        self,
        seed: int = 0,
        *,
        rate: float = 0.0,
        lies: Iterable[Lie] = tuple(Lie),
        respond: Callable[[float | None], float] = lambda isi_ms: 0.01 + (isi_ms or 0.0) / 1e4,
    ) -> None:
        self._rng = np.random.default_rng(seed)
        self._rate, self._lies, self._respond = number("rate", rate, least=0, most=1), tuple(lies), respond
        self._isi_us: int | None = None
        self._given_ms: float | None = None
        self._disarms_failed = 0
        self._ordered: dict[str, list[Lie]] = {}
        self._before, self._held = b"", b""
        self._ended = threading.Event()
        self.armed = False
        self.ledger: list[Fired] = []
        self.wrong_isis: dict[int, float] = {}
        self.happened: Counter[Lie] = Counter()
        self.heard: list[str] = []

    def lie(self, verb: str, lie: Lie, times: int = 1) -> None:
        """Let the next command meet a lie.

        Args:
            verb: the command, such as FIRE.
            lie: the lie.
            times: how many of these commands in a row.
        """
        self._ordered[verb] = [lie] * times

    @contextmanager
    def over_tcp(self) -> Iterator[str]:
        """Within, it listens on the loopback; the address."""
        with socket.create_server(("127.0.0.1", 0)) as server, self._served(lambda: self._serve_tcp(server)):
            yield f"socket://127.0.0.1:{server.getsockname()[1]}"

    @contextmanager
    def over_pty(self) -> Iterator[str]:
        """Within, it is at the other end of a pseudo-terminal, which POSIX has; the address."""
        import pty  # noqa: PLC0415 - not on Windows
        import tty  # noqa: PLC0415 - same

        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        try:
            with self._served(lambda: self._serve_wire(_Pty(ours), lambda: False)):
                yield os.ttyname(theirs)
        finally:
            os.close(ours)
            os.close(theirs)

    @contextmanager
    def _served(self, serve: Callable[[], None]) -> Iterator[None]:
        self._ended.clear()
        thread = threading.Thread(target=serve, name="pulse peer", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._ended.set()
            thread.join(5)

    def _serve_tcp(self, server: socket.socket) -> None:
        while not self._ended.is_set():
            if _readable(server):
                connection, _ = server.accept()
                with connection:
                    self._serve_wire(_Tcp(connection), lambda: _readable(server, 0.0))

    def _serve_wire(self, wire: _Wire, replaced: Callable[[], bool]) -> None:
        rest = b""
        with suppress(OSError):  # the other side is gone, or this one drops the connection
            while not (self._ended.is_set() or replaced()):
                *lines, rest = (rest + wire.read()).split(b"\n")
                for line in lines:
                    self._hear(line.decode("ascii", errors="replace").strip(), wire)

    def _hear(self, line: str, wire: _Wire) -> None:
        self.heard.append(line)
        prefix, verb, argument = _parsed(line)
        lie = self._drawn(verb)
        if lie is Lie.DROPS_BEFORE:
            raise ConnectionAbortedError
        said = "" if lie in _NOTHING_DONE else self._done(verb, argument, lie)
        if lie is Lie.DROPS_AFTER:
            raise ConnectionAbortedError
        if lie is Lie.REFUSES:
            said = "ERR it does not want to"
        if lie is Lie.OTHER_NUMBER and prefix:
            prefix = f"{int(prefix) + 1} "
        self._answer(f"{prefix}{said}\n".encode(), lie, wire)

    def _drawn(self, verb: str) -> Lie | None:
        """What goes wrong this time; None where nothing does."""
        lie = self._ordered[verb].pop() if self._ordered.get(verb) else self._drawn_at_random(verb)
        if lie is not None:
            self.happened[lie] += 1
        return lie

    def _drawn_at_random(self, verb: str) -> Lie | None:
        possible = [lie for lie in self._lies if verb in _OF_VERB.get(lie, {verb})]
        lies = bool(possible) and self._rng.random() < self._rate
        if verb == "DISARM":
            lies = lies and self._disarms_failed < 2
            self._disarms_failed = self._disarms_failed + 1 if lies else 0
        return possible[int(self._rng.integers(len(possible)))] if lies else None

    def _done(self, verb: str, argument: str, lie: Lie | None) -> str:
        """Do what was commanded; the answer."""
        if verb == "SET":
            return self._set(argument, lie)
        if verb in {"FIRE", "ALONE", "TAP"}:
            return self._fired(verb, int(argument) if argument.isdecimal() else -1, lie)
        if verb in {"ARM", "DISARM"}:
            self.armed = verb == "ARM"
            return f"{verb}ED"
        return self._said(verb, lie)

    def _set(self, argument: str, lie: Lie | None) -> str:
        try:
            self._isi_us = round(float(argument)) + (_SHIFT_US if lie is Lie.SETS_ANOTHER else 0)
        except ValueError:
            return "ERR that is no time"
        return "OK"

    def _said(self, verb: str, lie: Lie | None) -> str:
        value = {"GET": self._isi_us, "RESULT": f"{1e3 * self._respond(self._given_ms):.3f}", "STATUS": 25.0}.get(verb)
        if value is None:
            return "ERR what?"
        word = {"GET": "ISI", "RESULT": "MEP", "STATUS": "READY"}[verb]
        return f"{word} {'nan' if lie is Lie.NAN else value}"

    def _fired(self, verb: str, trial: int, lie: Lie | None) -> str:
        """Give a stimulus, if it is armed."""
        if not self.armed or (verb == "FIRE" and self._isi_us is None):
            return "ERR not armed"
        self.armed = False
        if verb != "FIRE" or self._isi_us is None:
            self._given_ms = None
            self.ledger.append(Fired(trial, None, time.monotonic()))
            return "FIRED"
        given_us = self._isi_us + (_SHIFT_US if lie is Lie.GIVES_ANOTHER else 0)
        self._given_ms = given_us / 1e3
        if lie is Lie.GIVES_ANOTHER:
            self.wrong_isis[trial] = self._given_ms
        self.ledger.append(Fired(trial, self._given_ms, time.monotonic()))
        return f"FIRED {'nan' if lie is Lie.NAN else given_us + (_SHIFT_US if lie is Lie.REPORTS_ANOTHER else 0)}"

    def _answer(self, answer: bytes, lie: Lie | None, wire: _Wire) -> None:
        late, self._held = self._held, answer if lie is Lie.LATE else b""
        if late:
            wire.write(late)
        for piece in _pieces(answer, self._before, lie):
            wire.write(piece)
            if lie is Lie.SPLITS:
                time.sleep(_PIECE_S)
        self._before = answer


def _pieces(answer: bytes, before: bytes, lie: Lie | None) -> Iterable[bytes]:
    """What is sent, piece by piece."""
    if lie in {Lie.SILENT_BEFORE, Lie.SILENT_AFTER, Lie.LATE}:
        return ()
    if lie is Lie.SPLITS:
        return [answer[at : at + 1] for at in range(len(answer))]
    if lie is Lie.REPEATS:
        return (before, answer)
    if lie is Lie.GARBAGE:
        return (_GARBAGE + b"\n", answer)
    if lie is Lie.CORRUPTS:
        return (answer[: len(answer) // 2] + _GARBAGE + answer[len(answer) // 2 :],)
    return (b"9" * _ENDLESS_BYTES,) if lie is Lie.ENDLESS else (answer,)


def _parsed(line: str) -> tuple[str, str, str]:
    """The sequence number with its blank, where there is one, the verb and the argument of a command."""
    words = line.split()
    prefix = f"{words.pop(0)} " if words and words[0].isdecimal() else ""
    verb, argument, *_ = (*words, "", "")
    return prefix, verb, argument


def _readable(thing: socket.socket | int, wait_s: float = _GLANCE_S) -> bool:
    return bool(select.select([thing], [], [], wait_s)[0])


class _Tcp:
    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        connection.settimeout(1.0)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self) -> bytes:
        if not _readable(self._connection):
            return b""
        data = self._connection.recv(4096)
        if not data:
            raise ConnectionResetError
        return data

    def write(self, data: bytes) -> None:
        self._connection.sendall(data)


class _Pty:
    def __init__(self, handle: int) -> None:
        self._handle = handle
        os.set_blocking(handle, False)

    def read(self) -> bytes:
        return os.read(self._handle, 4096) if _readable(self._handle) else b""

    def write(self, data: bytes) -> None:
        with suppress(BlockingIOError):  # nobody reads: what does not fit is lost
            os.write(self._handle, data)
