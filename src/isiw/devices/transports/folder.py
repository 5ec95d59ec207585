"""A device behind software that can only read and write files: a shared folder with requests and answers.

The newest request replaces the one before in one step, so that a delivery that nobody has read is gone once it is
stopped; it names the file of its answer. Both are lines of `key=value` and then a line `end`.
"""

from __future__ import annotations

import io
import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.checks import number
from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import Answer
from isiw.devices.transports.exchange import LONGEST_REPLY, Exchange, Reply, Request, Verb, described, sweep_of
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, os_errors
from isiw.files import written_beside
from isiw.opening import opened
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Stimulus
from isiw.types import FloatArray

REQUEST: Final = "request.txt"
_END: Final = "end"
_LARGEST_WAVEFORMS: Final = 50_000_000  # bytes
_TIMES: Final = ("t_valve_ms", "t_hit_ms", "t_tms_ms")
_OF_MEASUREMENT: Final = ("mep_mv", "isi_ms", "isi_sd_ms", "background_rms_uv", *_TIMES)
_OF_SWEEP: Final = ("samples", "rate_hz", "t0_ms", "isi_sd_ms", *_TIMES)


class FolderDevice:
    """Arms, fires and reads back through files in a folder. The other software must have the hardware time the ISI.

    Args:
        folder: the folder that both sides reach; it must exist.
        info: what the device is, as a `DeviceInfo` or a table of its fields. Without channels the other software
            measures the MEP itself; with channels it writes the waveforms, a column a channel in their order.
        rate_hz: sampling rate of the waveforms [Hz]; needed if there are channels.
        stage_timeout_s: how long arming may take [s].
        stop_timeout_s: how long each attempt to disarm may take [s]; below the session's 5 s.
        poll_s: how often the folder is looked at [s].

    Raises:
        InvalidValueError: a time that is not positive, or channels without their rate.
    """

    def __init__(
        self,
        folder: str | Path,
        info: DeviceInfo | Mapping[str, Any],
        *,
        rate_hz: float | None = None,
        stage_timeout_s: float = 10.0,
        stop_timeout_s: float = 4.0,
        poll_s: float = 0.01,
    ) -> None:
        place = Path(folder).absolute()
        self._info = described(info, address=os.path.realpath(place), tap_alone=False)
        if (rate_hz is not None) is not bool(self._info.channels):
            raise InvalidValueError(
                "channels and their rate belong together",
                got=f"rate_hz {rate_hz}, channels {dict(self._info.channels)}",
                remedy='For waveforms: rate_hz = 5000 and info.channels = { emg = "mV" }. Else leave both out.',
            )
        self._rate_hz = 0.0 if rate_hz is None else number("rate_hz", rate_hz, above=0)
        self._stage_timeout_s = number("stage_timeout_s", stage_timeout_s, above=0)
        self._folder = _Folder(place, number("poll_s", poll_s, above=0), waveforms=bool(self._info.channels))
        keys = _OF_SWEEP if self._info.channels else _OF_MEASUREMENT
        self._exchange = Exchange(self._info.name, self._folder, keys, stop_timeout_s)

    def describe(self) -> DeviceInfo:
        """The device's description."""
        return self._info

    def stage(self) -> None:
        """Have the other software arm, and wait for its word."""
        self._exchange.arm(self._stage_timeout_s)

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Have the other software deliver, and read what came of it."""
        read: Callable[[Reply], Answer] = self._sweep if self._info.channels else partial(_measurement, stimulus)
        return self._exchange.deliver(stimulus, timeout_s, read)

    def stop(self) -> None:
        """Have the other software disarm, and wait for its word."""
        self._exchange.disarm()

    def unstage(self) -> None:
        """Disarm, if that is not known to be done."""
        if self._exchange.may_be_armed:
            self._exchange.disarm()

    def _sweep(self, reply: Reply) -> Sweep:
        rate_hz = reply.number("rate_hz")
        if rate_hz != self._rate_hz:
            raise reply.broken("another sampling rate", got=rate_hz, expected=f"{self._rate_hz:g} Hz")
        path = self._folder.waveforms_for(reply.text("token"), reply.whole("number"))
        values = _waveforms(path, len(self._info.channels))
        if len(values) != (samples := reply.whole("samples")):
            raise reply.broken("the waveforms are not whole", got=len(values), expected=f"{samples} samples")
        _remove(path)
        t0_ms = reply.number("t0_ms")
        channels = {
            name: Channel(values[:, column], self._rate_hz, unit, t0_ms)
            for column, (name, unit) in enumerate(self._info.channels.items())
        }
        return sweep_of(channels, reply.number("t_tms_ms"), reply)


def _measurement(stimulus: Stimulus, reply: Reply) -> Measurement:
    if stimulus.isi_ms is None and reply.has("isi_ms"):
        raise reply.broken("a realised ISI for a request of TMS alone", got=reply.number("isi_ms"))
    isi_ms = None if stimulus.isi_ms is None else reply.number("isi_ms")
    others = [key for key in _OF_MEASUREMENT if key not in {"mep_mv", "isi_ms"} and reply.has(key)]
    return Measurement(reply.number("mep_mv"), isi_ms, **{key: reply.number(key) for key in others})


def _waveforms(path: Path, columns: int) -> FloatArray:
    """The samples of a file, shape (w, columns)."""
    source = Reply({}, path.name)
    text = _text(path, _LARGEST_WAVEFORMS)
    if text is None or not text.strip():
        raise source.broken("the waveforms are missing", remedy="Write them before the answer.")
    try:
        values = np.loadtxt(io.StringIO(text.replace(";", "\t")), ndmin=2, comments=None)
    except ValueError as error:
        remedy = "Write a line a sample, columns apart by tabs, semicolons or spaces, with decimal points."
        raise source.broken(f"not numbers: {error}", remedy=remedy) from error
    if values.shape[1] != columns:
        raise source.broken("another number of channels", got=values.shape[1], expected=f"{columns}")
    return values


def _text(path: Path, largest: int) -> str | None:
    """The text of a file; None if there is none, or if it is just being written."""
    try:
        with opened(path, links=False) as file:
            content = file.read(largest + 1)
    except (FileNotFoundError, PermissionError):  # Windows denies access to a file that is being renamed or written
        return None
    except OSError as error:
        raise DeviceError(f"{path.name} cannot be read: {error.strerror}", got=str(path)) from error
    if len(content) > largest:
        raise DeviceError(f"{path.name} is too large", got=f"more than {largest} bytes")
    return content.decode("utf-8-sig", errors="replace")


def _remove(path: Path) -> None:
    """Remove a file that was read; if the other side still has it open, it stays."""
    with suppress(PermissionError):
        path.unlink(missing_ok=True)


class _Folder:
    def __init__(self, place: Path, poll_s: float, *, waveforms: bool) -> None:
        self._place, self._poll_s, self._waveforms = place, poll_s, waveforms

    def send(self, request: Request) -> None:
        """Put a request in the place of the one before."""
        values: dict[str, object] = {**request.values(), "answer": self._answer(request).name}
        if self._waveforms and request.verb is Verb.DELIVER:
            values["waveforms"] = self.waveforms_for(request.token, request.number).name
        lines = [f"{key}={value}\n" for key, value in values.items()]
        ask = "Is the folder there, and may both sides write to it?"
        with os_errors(DeviceError, "the request cannot be written", self._place, ask):
            _remove(self._answer(request))  # no answer can be there before its request
            self._put("".join([*lines, f"{_END}\n"]), until_s=time.monotonic() + min(1.0, request.timeout_s))

    def _put(self, text: str, until_s: float) -> None:
        beside = written_beside(self._place / REQUEST, text.encode())
        try:
            while True:
                try:
                    beside.replace(self._place / REQUEST)
                except PermissionError:  # on Windows, while the other side has it open
                    if time.monotonic() > until_s:
                        raise
                    time.sleep(self._poll_s)
                else:
                    return
        except OSError:
            _remove(beside)
            raise

    def reply(self, request: Request, wait_s: float) -> Reply | None:
        """The answer to a request, if it is there and whole; else None, after a moment."""
        path = self._answer(request)
        text = _text(path, LONGEST_REPLY)
        if text is None or (reply := _parsed(text, path.name)) is None:
            time.sleep(min(self._poll_s, wait_s))
            return None
        given = (reply.text("token"), reply.text("number"))
        if given != (request.token, str(request.number)):
            raise reply.broken(
                "the answer is to another request",
                got=f"token {given[0]}, number {given[1]}",
                expected=f"token {request.token}, number {request.number}",
                remedy="Copy token and number from the request that is being answered.",
            )
        _remove(path)
        return reply

    def silence(self, request: Request) -> DeviceError:
        path = self._answer(request)
        if path.exists():
            return DeviceError(
                f"{path.name} is half-written",
                expected=f"lines of key=value, and {_END} as the last line",
                remedy="Write it under another name and rename it, or write it in one go.",
            )
        return DeviceTimeoutError(
            f"no answer to {request.verb} came in the folder",
            got=str(self._place),
            expected=f"{path.name} within {request.timeout_s:.3g} s",
            remedy=f"Does the software run that reads {REQUEST} there?",
        )

    def waveforms_for(self, token: str, number: int) -> Path:
        return self._place / f"waveforms-{token}-{number}.txt"

    def _answer(self, request: Request) -> Path:
        return self._place / f"answer-{request.token}-{request.number}.txt"


def _parsed(text: str, source: str) -> Reply | None:
    """The values of a whole answer; None if its last line is still missing."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if not lines or lines[-1] != _END or not text.endswith(("\n", _END)):
        return None
    values: dict[str, str] = {}
    for line in lines[:-1]:
        key, equals, value = (part.strip() for part in line.partition("="))
        if not (key and equals) or key in values:
            raise Reply({}, source).broken("a line is not key=value, or its key is there twice", got=line)
        values[key] = value
    return Reply(values, source)
