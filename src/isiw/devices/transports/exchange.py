"""Requests to the software that drives the hardware, and its answers, whatever carries them.

Both have a number and the device object's token; the newest request replaces all before it. Nothing counts as armed,
delivered or disarmed without an answer that says so.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import secrets
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Protocol, TypeVar, Unpack

from isiw.checks import Bounds, number
from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import require_staged
from isiw.errors import DeviceError, InvalidValueError, NotDelivered
from isiw.sweeps import Channel, Sweep
from isiw.text.sanitize import plain
from isiw.trials import Stimulus

_T = TypeVar("_T")

SET_TOLERANCE_MS: Final = 0.5
"""How far the ISI that the hardware was set to may be from the one that was asked for: what a coarse timer rounds."""

_GLANCE_S: Final = 0.05  # how long an answer is awaited before looking whether the request is still the newest
_RESERVE_S: Final = 0.2  # of a delivery's time, kept for what follows the answer

LONGEST_REPLY: Final = 65_536
"""The longest answer that is read [bytes]; waveforms are not part of it."""

_LONGEST_SHOWN: Final = 200
_POINT: Final = "Write numbers with a decimal point, as in 0.25, and without a unit."


@dataclass(frozen=True)
class Reply:
    """An answer of other software: its values, as text or as numbers, and where it is from, such as a file's name."""

    values: Mapping[str, object]
    source: str

    def broken(self, what: str, *, got: object = None, expected: str | None = None, remedy: str = "") -> DeviceError:
        """The error of an answer that cannot be used; whether the pulse was given is not known then."""
        shown = plain(got) if isinstance(got, str) else got
        return DeviceError(f"{self.source}: {what}", got=shown, expected=expected, remedy=remedy or None)

    def require_known(self, keys: Iterable[str]) -> None:
        """Raise if there is a key that nobody asked for, such as one that was misspelt."""
        known = sorted(keys)
        for key in self.values:
            if key not in known:
                raise self.broken("unknown key", got=str(key), expected=f"one of {', '.join(known)}")

    def has(self, key: str) -> bool:
        """True if there is a value of this key."""
        return self.values.get(key) is not None

    def text(self, key: str) -> str:
        """The text of a key, without anything that a terminal would obey; empty if there is none."""
        return plain(str(self.values.get(key, "")))[:_LONGEST_SHOWN]

    def number(self, key: str, **bounds: Unpack[Bounds]) -> float:
        """The number of a key."""
        value = self.values.get(key)
        if value is None:
            raise self.broken(f"{key} is missing", remedy="Every answer of this kind must have it.")
        if isinstance(value, str):
            try:
                value = read_number(value)
            except ValueError as error:
                raise self.broken(f"{key} is not a number", got=value, remedy=_POINT) from error
        try:
            return number(key, value, **bounds)
        except InvalidValueError as error:
            raise self.broken(error.what, got=error.got) from error

    def optional_number(self, key: str, **bounds: Unpack[Bounds]) -> float | None:
        """The number of a key; None if there is none."""
        return self.number(key, **bounds) if self.has(key) else None

    def whole(self, key: str) -> int:
        """The whole number of a key, at least 0."""
        value = self.number(key, least=0)
        if value != int(value):
            raise self.broken(f"{key} is not a whole number", got=self.values[key])
        return int(value)


class Verb(StrEnum):
    """The three kinds of request."""

    ARM = "arm"
    DELIVER = "deliver"
    DISARM = "disarm"


_WANTED: Final[Mapping[Verb, str]] = {Verb.ARM: "armed", Verb.DELIVER: "delivered", Verb.DISARM: "disarmed"}
_KEYS: Final = frozenset({"token", "number", "said", "reason", "trial", "set_isi_ms"})


@dataclass(frozen=True)
class Request:
    """One request of a device object, which has the token; what is read after `timeout_s` must not be obeyed."""

    token: str
    number: int
    verb: Verb
    timeout_s: float
    stimulus: Stimulus | None = None

    def values(self) -> dict[str, str | int | float]:
        """The values that are sent, in the order in which they are written; TMS alone has no `isi_ms`."""
        values: dict[str, str | int | float] = {"token": self.token, "number": self.number, "verb": self.verb.value}
        if self.stimulus is not None:
            values |= {"trial": self.stimulus.trial, "kind": "tms_alone" if self.stimulus.isi_ms is None else "pair"}
            values |= {} if self.stimulus.isi_ms is None else {"isi_ms": self.stimulus.isi_ms}
        return values | {"timeout_s": self.timeout_s}


class Carrier(Protocol):
    """Takes requests to the other software, and brings its answers."""

    def send(self, request: Request) -> None:
        """Send a request; NotDelivered if nobody can have seen it, another DeviceError if it cannot be sent."""

    def reply(self, request: Request, wait_s: float) -> Reply | None:
        """The answer to a request, for which it waits so long [s] at most; None if there is none yet."""

    def silence(self, request: Request) -> DeviceError:
        """The error to raise if no answer came in time."""


class Exchange:
    """Arms, delivers and disarms by requests, one at a time; `disarm` may come from any thread."""

    def __init__(self, name: str, carrier: Carrier, keys: Iterable[str], stop_timeout_s: float) -> None:
        self._name, self._carrier = name, carrier
        self._keys = {Verb.ARM: _KEYS, Verb.DELIVER: _KEYS | frozenset(keys), Verb.DISARM: _KEYS}
        self._stop_timeout_s = number("stop_timeout_s", stop_timeout_s, above=0)
        self._token = secrets.token_hex(4)
        self._sending = threading.RLock()
        self._newest: Request | None = None
        self._numbers = 0
        self._arming = self._disarmed = 0  # the last request to arm, and the last to disarm that was obeyed
        self._staged = False

    @property
    def may_be_armed(self) -> bool:
        """True if arming was asked for since the last time that something was known to be disarmed."""
        return self._arming > self._disarmed

    def arm(self, timeout_s: float) -> None:
        """Have it disarmed, which shows that somebody is there and undoes what an earlier run left, and then armed."""
        end_s = time.monotonic() + timeout_s
        disarming = self._sent(Verb.DISARM, timeout_s)
        self._confirmed(disarming)
        with self._sending:
            self._require_newest(disarming)
            arming = self._sent(Verb.ARM, max(0.0, end_s - time.monotonic()))
        with self._disarmed_after_failure(arming):
            self._confirmed(arming)
        with self._sending:
            self._require_newest(arming)
            self._staged = True

    def _require_newest(self, request: Request) -> None:
        if self._newest is not request:
            raise DeviceError(f"{self._name} was stopped while it was being armed")

    def require_staged(self) -> None:
        """Raise if it is not known to be armed."""
        require_staged(self._name, staged=self._staged)

    def deliver(self, stimulus: Stimulus, timeout_s: float, read: Callable[[Reply], _T]) -> _T:
        """Have a pair of stimuli, or TMS alone, delivered."""
        if stimulus.tap_alone:
            raise NotDelivered(f"{self._name} cannot deliver a tap alone")
        with self._sending:
            self.require_staged()
            request = self._next(Verb.DELIVER, timeout_s - min(_RESERVE_S, 0.1 * timeout_s), stimulus)
            with self._disarmed_after_failure(request):
                self._carrier.send(request)
        with self._disarmed_after_failure(request):
            reply = self._confirmed(request)
            _require_answer_to(stimulus, reply)
            try:
                return read(reply)
            except InvalidValueError as error:
                raise reply.broken(error.what, got=error.got) from error

    def disarm(self) -> None:
        """Have it disarmed. Where nobody answers, that is an error only if it may be armed."""
        try:
            self._confirmed(self._sent(Verb.DISARM, self._stop_timeout_s))
        except DeviceError:
            if self.may_be_armed:
                raise

    def _next(self, verb: Verb, timeout_s: float, stimulus: Stimulus | None = None) -> Request:
        self._numbers += 1
        self._newest = Request(self._token, self._numbers, verb, timeout_s, stimulus)
        return self._newest

    def _sent(self, verb: Verb, timeout_s: float) -> Request:
        """A new request to arm or to disarm, sent."""
        with self._sending:
            self._staged = False
            request = self._next(verb, timeout_s)
            if verb is Verb.ARM:
                self._arming = request.number
            self._carrier.send(request)
        return request

    @contextmanager
    def _disarmed_after_failure(self, request: Request) -> Iterator[None]:
        """Within, whatever fails but a refusal has it disarmed, unless something newer was asked for meanwhile."""
        try:
            yield
        except NotDelivered:
            raise
        except BaseException:
            with self._sending, suppress(DeviceError):  # who calls `stop` after the failure gets the error
                if self._newest is request:
                    self._sent(Verb.DISARM, self._stop_timeout_s)
            raise

    def _confirmed(self, request: Request) -> Reply:
        """The answer to a request, which says that what was asked for was done."""
        reply = self._awaited(request)
        reply.require_known(self._keys[request.verb])
        said = reply.text("said")
        if said in {"refused", "failed"}:
            kind = NotDelivered if (said, request.verb) == ("refused", Verb.DELIVER) else DeviceError
            raise kind(f"{self._name} {said} to {request.verb}: {reply.text('reason') or 'it does not say why'}")
        if said != _WANTED[request.verb]:
            raise reply.broken(
                f"the answer does not match the request to {request.verb}", got=said, expected=_WANTED[request.verb]
            )
        if request.verb is Verb.DISARM:
            self._disarmed = max(self._disarmed, request.number)
        return reply

    def _awaited(self, request: Request) -> Reply:
        end_s = time.monotonic() + request.timeout_s
        while True:
            left_s = end_s - time.monotonic()
            disarmed = self._disarmed > request.number
            reply = self._carrier.reply(request, max(0.0, min(left_s, _GLANCE_S)))
            if reply is not None:
                return reply
            if disarmed:
                raise DeviceError(
                    f"{self._name} was disarmed before it answered to {request.verb}",
                    remedy="Whether the pulse was given is not known.",
                )
            if left_s <= 0:
                raise self._carrier.silence(request)


def _require_answer_to(stimulus: Stimulus, reply: Reply) -> None:
    """Raise if an answer is not about the stimulus that was asked for."""
    if (trial := reply.whole("trial")) != stimulus.trial:
        raise reply.broken("the answer is about another trial", got=trial, expected=f"trial {stimulus.trial}")
    if stimulus.isi_ms is None:
        if reply.has("set_isi_ms"):
            raise reply.broken("an ISI was set for a request of TMS alone", got=reply.number("set_isi_ms"))
        return
    set_ms = reply.number("set_isi_ms")
    if abs(set_ms - stimulus.isi_ms) > SET_TOLERANCE_MS:
        raise reply.broken(
            "the hardware was set to another ISI",
            got=set_ms,
            expected=f"{stimulus.isi_ms:g} ms",
            remedy="set_isi_ms is what was read back from the hardware. Does the software read isi_ms as ms?",
        )


def sweep_of(channels: Mapping[str, Channel], t_tms_ms: float, reply: Reply) -> Sweep:
    """The sweep of an answer that says when the first stimulus came, as far as is known."""
    t_valve_ms, t_hit_ms = reply.optional_number("t_valve_ms"), reply.optional_number("t_hit_ms")
    return Sweep(channels, t_valve_ms, t_tms_ms, t_hit_ms, reply.optional_number("isi_sd_ms") or 0.0)


def described(info: DeviceInfo | Mapping[str, Any], **known: Any) -> DeviceInfo:
    """A device's description, from a table of a configuration or from the object."""
    stated = from_table(DeviceInfo, info, "info")
    if stated.sets_intensity:
        raise InvalidValueError(
            "no intensity can be sent to this device, so that each pulse has that of the stimulator",
            got="sets_intensity in info",
            remedy="Leave it out, and have one intensity; only a device of your own can set several.",
        )
    return dataclasses.replace(stated, **known)


def from_table(kind: type[_T], table: _T | Mapping[str, Any], what: str) -> _T:
    """An instance of a dataclass."""
    if isinstance(table, kind):
        return table
    parameters = inspect.signature(kind)
    remedy = f"Its keys are {', '.join(parameters.parameters)}."
    if not isinstance(table, Mapping):
        raise InvalidValueError(f"{what} must be a table", got=table, remedy=remedy)
    try:
        given = parameters.bind(**table)
    except TypeError as error:
        raise InvalidValueError(f"the table {what}: {error}", got=dict(table), remedy=remedy) from error
    return kind(*given.args, **given.kwargs)


_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


def read_number(text: str) -> float:
    """The number that a text is, in ASCII digits with a decimal point; Python itself would take 1_0_0 and ١٢, too."""
    if not _NUMBER.fullmatch(text):
        raise ValueError("no number with a decimal point")
    return float(text)
