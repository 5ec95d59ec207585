"""One open connection to an instrument: a command out, the answer to it back, whatever else arrives."""

from __future__ import annotations

import itertools
import logging
import math
import re
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal, TypeVar

from isiw.checks import Checked, Count, Flag, NonNegative, Positive, choice
from isiw.devices.dying import armed_by_another
from isiw.devices.transports.line_table import Connection, LineExchange, LineHeartbeat, command_values, crc_of
from isiw.devices.watchdog import Watchdog
from isiw.errors import DeviceError, DeviceTimeoutError
from isiw.text.sanitize import counted, read_whole

_T = TypeVar("_T")

_LONGEST_LINE = 1000
_MOST_READS = 5
_MOST_LISTED = 5
_LONGEST_SHOWN = 80
_STARTING_S = 10.0
_REPEATING_S = 0.5  # for which a watchdog repeats itself

_log = logging.getLogger(__name__)

_sequence = itertools.count(secrets.randbelow(900_000) + 1)
"""Numbers of commands. They begin anywhere, so that an answer to an earlier process is no answer to this one."""


@dataclass(frozen=True)
class LineSettings(Checked):
    """Settings of the exchange of lines.

    Args:
        baud: symbols a second of a serial port [1/s].
        line_end: what ends a command. Answers may end by a line feed, a carriage return, or both.
        timeout_s: how long the instrument may take to answer if nothing else is said, and to take a command [s].
        connect_s: how long it may take from opening the connection until it says that it is disarmed [s]; boards that
            start again when their port is opened need a second or two. `stop` may need this and twice `timeout_s`.
        isi_tolerance_ms: how far the ISI that is read back may be from the one that was set [ms].
        checksum: "crc16" if each line ends with * and four hexadecimal digits, CRC-16/XMODEM of all before the *, in
            commands and in answers; a line with another one is thrown away. "none" if lines have none.
        watchdog: whether a process beside isiw disarms the instrument if isiw dies; there is none on Windows, nor where
            the address is that of a port's software, such as "rfc2217://…".
    """

    baud: Count = 115_200
    line_end: Annotated[str, partial(choice, known=("\n", "\r", "\r\n"))] = "\n"
    timeout_s: Positive = 1.0
    connect_s: Positive = 2.5
    isi_tolerance_ms: NonNegative = 0.001
    checksum: Literal["none", "crc16"] = "none"
    watchdog: Flag = True


class Line:
    """Commands and answers over one connection. Everything that fails is a `DeviceError`.

    Without sequence numbers, a connection whose last answer is missing is not `trusted` any more.
    """

    def __init__(self, connection: Connection, settings: LineSettings, refusal: str) -> None:
        self._connection, self._settings, self._refusal = connection, settings, refusal
        self._incoming = _Lines()
        self._watchdog: Watchdog | None = None
        self.trusted = True

    def ask(
        self,
        exchange: LineExchange,
        trial: int = 0,
        isi_ms: float | None = None,
        *,
        timeout_s: float,
        given_up: Callable[[], bool] = lambda: False,
        heartbeat: LineHeartbeat | None = None,
    ) -> dict[str, str]:
        """Send a command and wait for its answer; returns what the answer says by group."""
        number = next(_sequence)
        try:
            command = exchange.command(command_values(number, trial, isi_ms))
        except ValueError as error:
            raise DeviceError(f"the command cannot be written: {error}", got=isi_ms, expected=exchange.send) from error
        if not exchange.numbered:
            self.drain()
        self.trusted = False
        self._guarded(lambda: self._connection.send(self._written(command)))
        deadline_s = time.monotonic() + timeout_s
        said = self._answer(command, exchange, number, deadline_s, given_up, heartbeat)
        self.trusted = True
        return said

    def drain(self) -> None:
        """Throw away what has come so far, and say so; raises if the connection is broken."""
        for _ in range(_MOST_READS):  # an instrument that never stops sending must not hold this up
            data = self._guarded(lambda: self._connection.receive(wait=False))
            if not data:
                break
            self._incoming.add(data)
        others = _Others()
        while (line := self._incoming.next()) is not None:
            others.add(line)
        others.add(self._incoming.take_rest())
        others.say("before a command")

    def _written(self, command: str) -> bytes:
        seal = f"*{crc_of(command)}" if self._settings.checksum == "crc16" else ""
        return f"{command}{seal}{self._settings.line_end}".encode("ascii")

    def _unsealed(self, line: str) -> str:
        """A line without its checksum; empty if that is wrong, which is an answer to nothing."""
        if self._settings.checksum == "none":
            return line
        said, _, stated = line.rpartition("*")
        return said if stated == crc_of(said) else ""

    def watch(self, disarm: LineExchange) -> None:
        """See to it that the instrument is disarmed if isiw dies."""
        if self._watchdog is not None and not self._watchdog.watches:
            self._watchdog.end()
            self._watchdog = None
        if self._watchdog is None:
            self._watchdog = self._guarded(lambda: Watchdog(self._connection.handle, self._disarming(disarm)[1]))

    def _disarming(self, disarm: LineExchange) -> tuple[int, bytes]:
        """The number of a command to disarm, and its bytes, before which whatever was begun is ended."""
        number = next(_sequence)
        return number, self._settings.line_end.encode("ascii") + self._written(
            disarm.command(command_values(number, 0, None))
        )

    def die_armed(self, arm: LineExchange, disarm: LineExchange, timeout_s: float) -> float:
        """Have another process arm and kill it; the time until the instrument says that it is disarmed [s].

        The other process's watchdog disarms. Each answer may take `timeout_s` [s].
        """
        arming, (disarming, disarm_data) = next(_sequence), self._disarming(disarm)
        arm_data = self._written(arm.command(command_values(arming, 0, None)))
        self.trusted = False
        with self._guarded(lambda: armed_by_another(self._connection.handle, arm_data, disarm_data)) as process:
            try:
                until_s = time.monotonic() + _STARTING_S + timeout_s
                self._answer("arm", arm, arming, until_s, lambda: process.poll() is not None)
            finally:
                process.kill()
            died_s = time.monotonic()
            self._answer("disarm", disarm, disarming, died_s + timeout_s, lambda: False, may_refuse=False)
        took_s = time.monotonic() - died_s
        time.sleep(_REPEATING_S)
        self.drain()
        self.trusted = True
        return took_s

    def close(self) -> None:
        """Close the connection; calling it again is harmless."""
        self.trusted = False
        if self._watchdog is not None:
            self._watchdog.end()  # it would keep the port open
        try:
            self._connection.close()
        except OSError as error:
            _log.warning("closing the connection failed: %s", error)

    def _answer(
        self,
        command: str,
        exchange: LineExchange,
        number: int,
        deadline_s: float,
        given_up: Callable[[], bool],
        heartbeat: LineHeartbeat | None = None,
        *,
        may_refuse: bool = True,  # what refuses the empty line before a watchdog's command does not refuse that
    ) -> dict[str, str]:
        others = _Others()
        try:
            for line in self._lines_until(deadline_s, given_up, heartbeat):
                said = exchange.match(line)
                if said is not None and (not exchange.numbered or _is(number, said.get("sequence"))):
                    return said
                if may_refuse:
                    self._require_not_refused(line, number)
                others.add(line)
        finally:
            others.say(f"while {command!r} was to be answered")
        raise DeviceTimeoutError(
            f"the instrument does not answer {command!r}",
            got=list(others.last) or None,
            expected=f"an answer that matches {exchange.reply}",
        )

    def _require_not_refused(self, line: str, number: int) -> None:
        found = re.fullmatch(self._refusal, line) if self._refusal else None
        said = {} if found is None else found.groupdict()
        if found is not None and ("sequence" not in said or _is(number, said["sequence"])):
            self.trusted = True
            raise DeviceError("the instrument refuses", got=(said.get("reason") or line)[:_LONGEST_SHOWN])

    def _lines_until(
        self, deadline_s: float, given_up: Callable[[], bool], heartbeat: LineHeartbeat | None
    ) -> Iterator[str]:
        every_s = math.inf if heartbeat is None else heartbeat.every_s
        beat_s = time.monotonic() + every_s
        while time.monotonic() < deadline_s:
            while (line := self._incoming.next()) is not None:
                yield self._unsealed(line)
            if given_up():
                raise DeviceError("the device was stopped while the instrument was busy")
            if heartbeat is not None and time.monotonic() >= beat_s:
                beat = heartbeat.send.format_map(command_values(next(_sequence), 0, None))
                self._guarded(partial(self._connection.send, self._written(beat)))
                beat_s += every_s
            self._incoming.add(self._guarded(self._connection.receive))

    def _guarded(self, use: Callable[[], _T]) -> _T:
        """Use a connection; raises a `DeviceError` if it is broken."""
        try:
            return use()
        except OSError as error:
            self.close()
            raise DeviceError(f"the connection to the instrument broke: {error}") from error


def _is(number: int, stated: str | None) -> bool:
    """True if an answer states the number of its command."""
    return stated is not None and read_whole(stated) == number


class _Others:
    """Lines that answer nothing: how many, and the last few of them."""

    def __init__(self) -> None:
        self.last: deque[str] = deque(maxlen=_MOST_LISTED)
        self._count = 0

    def add(self, line: str) -> None:
        if line:
            self._count += 1
            self.last.append(line[:_LONGEST_SHOWN])

    def say(self, when: str) -> None:
        if self._count:
            _log.warning("thrown away %s: %s, last %s", when, counted(self._count, "line"), list(self.last))


class _Lines:
    """Bytes in, lines out; what is longer than a line can be is cut, so that memory is bounded."""

    def __init__(self) -> None:
        self._rest = b""
        self._lines: deque[str] = deque()

    def add(self, data: bytes) -> None:
        *lines, rest = re.split(rb"[\r\n]", self._rest + data)
        self._rest = rest[-_LONGEST_LINE:]
        self._lines.extend(text for line in lines if (text := _text(line)))

    def next(self) -> str | None:
        return self._lines.popleft() if self._lines else None

    def take_rest(self) -> str:
        rest, self._rest = _text(self._rest), b""
        return rest


def _text(line: bytes) -> str:
    return line[-_LONGEST_LINE:].decode("ascii", errors="backslashreplace").strip()
