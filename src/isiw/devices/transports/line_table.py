r"""The table of an instrument's commands: what is sent, and what the answer must look like.

    set = { send = "{sequence} SET {isi_us}", reply = '(?P<sequence>\d+) OK' }

`send` may hold the fields {sequence}, {trial}, and the ISI as {isi_ms}, {isi_us} or {isi_s}, with a format if one is
needed: {isi_ms:.1f}. `reply` is a regular expression that the whole line must match; named groups hold what it says.
"""

from __future__ import annotations

import re
import socket
from binascii import crc_hqx
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from string import Formatter
from typing import Annotated, Any, Final, TypeAlias
from urllib.parse import urlsplit

from isiw.checks import Checked, Positive, Text, number
from isiw.devices.transports.exchange import from_table, read_number
from isiw.devices.watchdog import SUPPORTED
from isiw.errors import InvalidValueError
from isiw.text.named_code import library

_TCP = "socket://"
_MOST_BYTES = 4096
_GLANCE_S = 0.05

_MS: Final = {"isi_ms": 1.0, "isi_us": 1e-3, "isi_s": 1e3}
_MV: Final = {"mep_mv": 1.0, "mep_uv": 1e-3}
_ISI, _MEP = frozenset(_MS), frozenset(_MV)
_OUTCOME = _MEP | {"background_rms_uv"}
_STATE = frozenset({"coil_c", "intensity_pct_mso"})
_NONE: frozenset[str] = frozenset()


def open_connection(address: str, baud: int, timeout_s: float) -> Connection:
    """Open a connection."""
    return _Tcp(address, timeout_s) if address.startswith(_TCP) else _Serial(address, baud, timeout_s)


def require_address(address: str) -> None:
    """Raise if an address cannot be one."""
    if not address or (address.startswith(_TCP) and None in _host_and_port(address)):
        raise InvalidValueError(
            "the address of an instrument is incomplete",
            got=address,
            expected='"COM3", "/dev/ttyUSB0" or "socket://192.168.0.20:5000"',
        )


def _host_and_port(address: str) -> tuple[str | None, int | None]:
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError:
        return None, None
    return host, port


def has_handle(address: str) -> bool:
    """True if another process can inherit a connection to an address."""
    return SUPPORTED and (address.startswith(_TCP) or "://" not in address)


class _Tcp:
    """Bytes to and from an instrument; whatever fails is an OSError."""

    def __init__(self, address: str, timeout_s: float) -> None:
        host, port = _host_and_port(address)
        self._timeout_s = timeout_s
        self._socket = socket.create_connection((host or "", port or 0), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Send all of it, or fail within the time that the connection was opened with."""
        self._socket.settimeout(self._timeout_s)
        self._socket.sendall(data)

    def receive(self, *, wait: bool = True) -> bytes:
        """The bytes that have come, a few thousand at most; none if nothing came within 50 ms."""
        self._socket.settimeout(_GLANCE_S if wait else 0.0)
        try:
            data = self._socket.recv(_MOST_BYTES)
        except (TimeoutError, BlockingIOError):
            return b""
        if not data:
            raise ConnectionResetError("the instrument closed the connection")
        return data

    def close(self) -> None:
        """Close it; calling it again is harmless."""
        self._socket.close()

    @property
    def handle(self) -> int:
        """Its number in this process, which a process that is started can inherit."""
        return self._socket.fileno()


class _Serial:
    """The same over a serial port, which no other program can open meanwhile."""

    def __init__(self, address: str, baud: int, timeout_s: float) -> None:
        serial = library("serial", "serial")
        try:
            self._port = serial.serial_for_url(
                address, baudrate=baud, timeout=_GLANCE_S, write_timeout=timeout_s, exclusive=True
            )
        except ValueError as error:  # a rate or an address that pyserial does not know
            raise OSError(str(error)) from error

    def send(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except TypeError as error:  # another thread closed it
            raise OSError("the port is closed") from error

    def receive(self, *, wait: bool = True) -> bytes:
        try:
            size = self._port.in_waiting
            return bytes(self._port.read(max(1, min(size, _MOST_BYTES)))) if size or wait else b""
        except TypeError as error:  # another thread closed it
            raise OSError("the port is closed") from error

    def close(self) -> None:
        self._port.close()

    @property
    def handle(self) -> int:
        return int(self._port.fileno())


Connection: TypeAlias = _Tcp | _Serial


@dataclass(frozen=True)
class LineExchange(Checked):
    r"""A command and the answer that it must get.

    Args:
        send: what is sent, without the end of the line: ASCII, with fields such as {sequence} and {isi_ms}.
        reply: the regular expression that the whole answer must match, with groups such as (?P<sequence>\d+).
        timeout_s: how long the answer may take [s]; None if the whole line's time holds, and for what fires and
            measures, all the time that a delivery has.
    """

    send: Text
    reply: Text
    timeout_s: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.send.isascii() or not self.send.isprintable() or not self.send:
            raise InvalidValueError("a command must be one line of ASCII", got=self.send)
        try:
            re.compile(self.reply)
        except re.error as error:
            raise InvalidValueError(f"an answer's pattern is invalid: {error}", got=self.reply) from error
        try:
            self.command(command_values(1, 0, 1.5))
        except (ValueError, KeyError, IndexError, AttributeError) as error:
            raise InvalidValueError(
                f"a command cannot be filled in: {error}",
                got=self.send,
                expected=f"fields among {', '.join('{' + name + '}' for name in command_values(1, 0, 1.5))}",
                remedy="Write {{ and }} for braces that are sent as they are.",
            ) from error
        if ("sequence" in self.fields) != self.numbered:
            raise InvalidValueError(
                "a sequence number must be sent and answered, or neither",
                got=f"{self.send} with the answer {self.reply}",
                expected=r"{sequence} in the command and (?P<sequence>\d+) in the answer",
            )

    @property
    def fields(self) -> frozenset[str]:
        """The names of the values that are filled into the command."""
        return frozenset(name for _, name, _, _ in Formatter().parse(self.send) if name is not None)

    @property
    def groups(self) -> frozenset[str]:
        """The names of the values in the answer."""
        return frozenset(re.compile(self.reply).groupindex)

    @property
    def numbered(self) -> bool:
        """True if the answer says which command it answers."""
        return "sequence" in self.groups

    def command(self, values: Mapping[str, float]) -> str:
        """The command with its fields filled in."""
        return self.send.format_map(values)

    def match(self, line: str) -> dict[str, str] | None:
        """The values in an answer by group; None if the line is no answer to this command."""
        found = re.fullmatch(self.reply, line)
        return None if found is None else {name: said for name, said in found.groupdict().items() if said is not None}


_FIELDS: Final = {
    "set": _ISI | {"trial"},
    "fire": _ISI | {"trial"},
    "alone": frozenset({"trial"}),
    "tap_alone": frozenset({"trial"}),
    "result": frozenset({"trial"}),
}
"""What a command may hold besides its sequence number."""

_GROUPS: Final = {
    "read_back": _ISI,
    "fire": _ISI | _OUTCOME,
    "alone": _OUTCOME,
    "tap_alone": _OUTCOME,
    "result": _ISI | _OUTCOME,
    "status": _STATE,
    "hello": frozenset({"version", "shortest_iti_ms", "most_pulses"}),
}
"""What an answer may say besides its sequence number."""


def _command(what: str, value: LineExchange | Mapping[str, Any]) -> LineExchange:
    """A command of the table, which holds nothing, and whose answer says nothing, that has no meaning there."""
    name = what.rpartition(".")[2]
    exchange = from_table(LineExchange, value, f"commands.{name}")
    rules = (
        ("command", exchange.fields, _FIELDS.get(name, _NONE)),
        ("answer", exchange.groups, _GROUPS.get(name, _NONE)),
    )
    for part, there, known in rules:
        unknown = there - known - {"sequence"}
        if unknown:
            raise InvalidValueError(
                f"the {part} of {name} has something unknown",
                got=", ".join(sorted(unknown)),
                expected=f"among {', '.join(sorted(known | {'sequence'}))}",
            )
    return exchange


Command: TypeAlias = Annotated[LineExchange, _command]


@dataclass(frozen=True)
class LineHeartbeat(Checked):
    """A sign of life, which is not answered.

    Args:
        send: what is sent, as in `LineExchange`; it may hold {sequence}.
        every_s: how often [s]; a third of what the instrument waits, or less.
    """

    send: Text
    every_s: Positive

    def __post_init__(self) -> None:
        super().__post_init__()
        LineExchange(self.send.replace("{sequence}", "1"), "")


def _heartbeat(what: str, value: LineHeartbeat | Mapping[str, Any]) -> LineHeartbeat:
    return from_table(LineHeartbeat, value, what)


Beat: TypeAlias = Annotated[LineHeartbeat, _heartbeat]


@dataclass(frozen=True)
class LineCommands(Checked):
    r"""The commands of an instrument, each a `LineExchange` or a table with its arguments.

    Args:
        disarm: it cannot fire from here on; must work in any state.
        set: sets the ISI, which the command must hold.
        read_back: asks which ISI is set, which the answer must say.
        arm: it may fire from here on.
        fire: gives a pair of stimuli.
        alone: gives the magnetic pulse without a tap, whatever ISI is set.
        tap_alone: gives the tap without the pulse; None if it cannot.
        result: asks what came of it: the realised ISI, if the answer to `fire` does not say it, and the MEP.
        status: asks whether it is ready; the answer may say coil_c [°C] and intensity_pct_mso [% MSO].
        hello: asks, whenever a connection is opened, what the instrument is; a pattern that holds its version refuses
            any other. The answer may say shortest_iti_ms [ms] and most_pulses, which must be those of `info`.
        acknowledge: acknowledges what made the instrument refuse, such as an interlock that was open; is sent by
            `stage`, that is when a session begins and when its operator continues it.
        heartbeat: a sign of life, sent while a stimulus is under way, without which the instrument ends it.
        refusal: what an answer looks like that refuses any command, with (?P<reason>.*) where it says why; empty if
            it does not refuse in words. It holds (?P<sequence>\d+) if the answers do.
    """

    disarm: Command
    set: Command
    read_back: Command
    arm: Command
    fire: Command
    alone: Command
    tap_alone: Command | None = None
    result: Command | None = None
    status: Command | None = None
    hello: Command | None = None
    acknowledge: Command | None = None
    heartbeat: Beat | None = None
    refusal: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_one(_ISI, self.set.fields, "the command set must hold the ISI", "{isi_ms}, {isi_us} or {isi_s}")
        _require_one(_ISI, self.read_back.groups, "the answer to read_back must say the ISI", r"(?P<isi_ms>[\d.]+)")
        groups = self.fire.groups | self._result_groups
        _require_one(_ISI, groups, "the answer to fire or result must say the realised ISI", r"(?P<isi_ms>[\d.]+)")
        try:
            said = re.compile(self.refusal).groupindex
        except (re.error, TypeError) as error:
            raise InvalidValueError(f"the pattern of a refusal is invalid: {error}", got=self.refusal) from error
        if not said.keys() <= {"sequence", "reason"}:
            raise InvalidValueError(
                "a refusal says something unknown", got=sorted(said), expected="the groups sequence and reason"
            )

    @property
    def _result_groups(self) -> frozenset[str]:
        return _NONE if self.result is None else self.result.groups

    @property
    def firing(self) -> tuple[LineExchange, ...]:
        """The commands that give a stimulus."""
        return tuple(each for each in (self.fire, self.alone, self.tap_alone) if each is not None)

    @property
    def measuring(self) -> list[bool]:
        """True for each kind of trial whose MEP an answer says."""
        return [bool((each.groups | self._result_groups) & _MEP) for each in self.firing]


def _require_one(names: frozenset[str], there: frozenset[str], what: str, expected: str) -> None:
    if len(names & there) != 1:
        raise InvalidValueError(f"{what}, in one unit", got=sorted(names & there) or "none", expected=expected)


def crc_of(text: str) -> str:
    """The CRC-16/XMODEM of a line, as four hexadecimal digits."""
    return f"{crc_hqx(text.encode('ascii', 'replace'), 0):04X}"


def command_values(sequence: int, trial: int, isi_ms: float | None) -> dict[str, float]:
    """The values that may be filled into a command."""
    isi = {} if isi_ms is None else {name: _plain(isi_ms / ms) for name, ms in _MS.items()}
    return {"sequence": sequence, "trial": trial, **isi}


def _plain(value: float) -> float:
    """A number without the digits that only binary fractions have, and whole if it is."""
    rounded = round(value, 9)
    return int(rounded) if rounded == int(rounded) else rounded


def _value(said: Mapping[str, str], units: Mapping[str, float]) -> float | None:
    """The ISI [ms] or the MEP [mV] that an answer says; None if it says none."""
    values = ((number_of(said, name), unit) for name, unit in units.items())
    return next((value * unit for value, unit in values if value is not None), None)


isi_ms_of, mep_mv_of = partial(_value, units=_MS), partial(_value, units=_MV)


def number_of(said: Mapping[str, str], name: str) -> float | None:
    """A number that an answer says; None if it does not."""
    if name not in said:
        return None
    try:
        return number(f"the instrument's {name}", read_number(said[name]))
    except ValueError as error:
        raise InvalidValueError(f"the instrument's {name} is no finite number", got=said[name]) from error
