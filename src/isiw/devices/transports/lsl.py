"""A device on the Lab Streaming Layer: markers out, echoes in, and the sweep cut out of the streams by timestamps.

The hardware times the ISI: a marker may take tens of milliseconds, which is far too much for it.
"""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Mapping
from functools import partial
from typing import Any, Final

from isiw.checks import number, text
from isiw.devices.info import DeviceInfo
from isiw.devices.transports.exchange import (
    LONGEST_REPLY,
    Exchange,
    Reply,
    Request,
    Verb,
    described,
    from_table,
    sweep_of,
)
from isiw.devices.transports.lsl_samples import LATE_S, LslChannel, SampleStream
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, NotDelivered
from isiw.sweeps import Channel, Sweep
from isiw.text.named_code import library
from isiw.text.parsing import read_json
from isiw.trials import Stimulus

_GLANCE_S: Final = 0.02
_MOST_KEPT: Final = 8
_KEYS: Final = ("t_fired", "t_valve_ms", "t_hit_ms", "isi_sd_ms")
_SEARCH_S: Final = 1.0  # in half a second liblsl finds only some of the streams
_CLOCKS_S: Final = 0.05  # how far two clocks of the network may seem to be apart after their correction
_BUFFER_S: Final = 10.0


class Markers:
    """Carries requests as markers, and answers as echoes."""

    def __init__(self, lsl: Any, name: str, echo: str) -> None:
        self._lsl, self._name, self.echo = lsl, name, echo
        self._outlet: Any = None
        self.inlet: Any = None
        self._pulling = threading.Lock()
        self._replies: dict[int, Reply] = {}
        self._newest: Request | None = None
        self._others = 0

    def open(self) -> None:
        """Offer the markers; they are offered as long as the device lives, so that whoever listens may stay."""
        if self._outlet is None:
            source = f"isiw {self._name}"
            self._outlet = self._lsl.StreamOutlet(
                self._lsl.StreamInfo(self._name, "Markers", 1, self._lsl.IRREGULAR_RATE, "string", source)
            )

    def listen(self, inlet: Any) -> None:
        """Take the echoes from here."""
        with self._pulling:
            self.inlet = inlet

    def await_listener(self, timeout_s: float) -> None:
        """Wait until somebody listens, since markers are lost that nobody listens to."""
        if not self._outlet.wait_for_consumers(timeout_s):
            raise DeviceTimeoutError(
                "no program listens to the markers",
                got=f"the stream {self._name}",
                remedy="Let the software that drives the hardware open an inlet to it.",
            )

    def correction_s(self, timeout_s: float) -> float:
        """The correction of the times of an echo to the local clock [s]."""
        try:
            return float(self.inlet.time_correction(timeout_s))
        except (self._lsl.util.TimeoutError, self._lsl.util.LostError) as error:
            raise DeviceError(f"the clock of {self.echo} is not known", got=str(error)) from error

    def send(self, request: Request) -> None:
        """Push a marker."""
        if not self._outlet.have_consumers():
            kind = NotDelivered if request.verb is Verb.DELIVER else DeviceError
            raise kind("no program listens to the markers any more", got=f"the stream {self._name}")
        self._newest = request
        self._outlet.push_sample([json.dumps(request.values())])

    def reply(self, request: Request, wait_s: float) -> Reply | None:
        """The echo of a request, or None after a moment; several threads may wait for one each."""
        if request.number not in self._replies and self._pulling.acquire(timeout=_GLANCE_S):
            try:
                self._pull(min(_GLANCE_S, wait_s))
            finally:
                self._pulling.release()
        return self._replies.pop(request.number, None)

    def silence(self, request: Request) -> DeviceError:
        """The error to raise if no echo came in time."""
        others = f", and {self._others} echoes of other requests" if self._others else ""
        return DeviceTimeoutError(
            f"no echo of the request to {request.verb}",
            got=f"silence on {self.echo}{others}",
            expected=f"one within {request.timeout_s:.3g} s",
            remedy="Does the software run that listens to the markers, and does it copy token and number?",
        )

    def _pull(self, wait_s: float) -> None:
        try:
            sample, _ = self.inlet.pull_sample(wait_s)
        except self._lsl.util.LostError as error:
            raise DeviceError(f"the stream {self.echo} is lost", got=str(error)) from error
        except UnicodeDecodeError as error:
            raise DeviceError(f"an echo on {self.echo} is not UTF-8", got=str(error)) from error
        if sample is None:
            return
        reply = _parsed(str(sample[0]), f"an echo on {self.echo}")
        number = reply.whole("number")
        if self._newest is None or reply.text("token") != self._newest.token or number > self._newest.number:
            self._others += 1  # of an earlier run, or of a request that was never made
            return
        self._replies[number] = reply
        while len(self._replies) > _MOST_KEPT:
            self._replies.pop(next(iter(self._replies)))


def _parsed(content: str, source: str) -> Reply:
    broken = Reply({}, source).broken
    if len(content) > LONGEST_REPLY:
        raise broken("too long", got=len(content), expected=f"at most {LONGEST_REPLY} characters")
    try:
        values = read_json(content)
    except ValueError as error:
        raise broken("not JSON", got=content, remedy="Send an object such as those in docs/lab/lsl.md.") from error
    if not isinstance(values, dict):
        raise broken("not a JSON object", got=content)
    return Reply(values, source)


class LslDevice:
    """Arms and fires by markers, and cuts the sweep out of streams. The hardware at the other end must time the ISI.

    Args:
        channels: where each channel of a sweep comes from, as a `LslChannel` or a table of its fields; "emg" is needed.
        info: what the device is, as a `DeviceInfo` or a table of its fields; its channels are those above.
        markers: the name of the stream of markers, which isiw sends.
        echo: the name of the stream of echoes, which the other software sends.
        before_ms: how much of a sweep comes before the pulse [ms].
        after_ms: how much of it comes after the pulse [ms].
        max_jitter_ms: how far a timestamp may be from where the rate puts it [ms]; a longer gap is a fault.
        stage_timeout_s: how long connecting and arming may take [s].
        stop_timeout_s: how long each attempt to disarm may take [s]; below the session's 5 s.

    Raises:
        ConfigError: pylsl is not installed.
        InvalidValueError: no EMG, channels of one stream with different rates, or a time that is not positive.
    """

    def __init__(  # noqa: PLR0913 - the streams and the sweep, all keyword-only and most with a usual value
        self,
        *,
        channels: Mapping[str, LslChannel | Mapping[str, Any]],
        info: DeviceInfo | Mapping[str, Any],
        markers: str = "isiw-markers",
        echo: str = "isiw-echo",
        before_ms: float = 600.0,
        after_ms: float = 100.0,
        max_jitter_ms: float = 1.0,
        stage_timeout_s: float = 20.0,
        stop_timeout_s: float = 4.0,
    ) -> None:
        self._lsl = library("pylsl", "lsl")
        self._channels = {name: from_table(LslChannel, each, f"channels.{name}") for name, each in channels.items()}
        units = {name: channel.unit for name, channel in self._channels.items()}
        self._info = described(
            info, channels=units, address=f"the LSL stream {text('markers', markers)}", tap_alone=False
        )
        self._rates_hz = _rates_hz(self._channels)
        self._before_s = number("before_ms", before_ms, above=0) / 1e3
        self._after_s = number("after_ms", after_ms, above=0) / 1e3
        self._max_jitter_ms = number("max_jitter_ms", max_jitter_ms, above=0)
        self._stage_timeout_s = number("stage_timeout_s", stage_timeout_s, above=0)
        self._markers = Markers(self._lsl, markers, text("echo", echo))
        self._exchange = Exchange(self._info.name, self._markers, _KEYS, stop_timeout_s)
        self._streams: dict[str, SampleStream] = {}

    def describe(self) -> DeviceInfo:
        """The device's description."""
        return self._info

    def stage(self) -> None:
        """Find the streams, wait until somebody listens to the markers, and have it arm."""
        end_s = time.monotonic() + self._stage_timeout_s
        self._markers.open()
        found = self._found(end_s)
        self._streams = {name: self._opened(name, found[name], end_s) for name in self._rates_hz}
        self._markers.listen(self._inlet(found[self._markers.echo], end_s))
        self._markers.await_listener(_left_s(end_s))
        self._exchange.arm(_left_s(end_s))

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Sweep:
        """Have it fire by a marker, await its echo, and cut the sweep out of the streams."""
        end_s = time.monotonic() + timeout_s
        self._exchange.require_staged()
        for stream in self._streams.values():
            stream.require_live(self._lsl.local_clock, self._before_s)
        asked_s = self._lsl.local_clock()
        return self._exchange.deliver(stimulus, _left_s(end_s), partial(self._sweep, asked_s, end_s))

    def stop(self) -> None:
        """Have it disarm, and wait for its answer; without a connection nothing is sent."""
        if self._markers.inlet is not None:
            self._exchange.disarm()

    def unstage(self) -> None:
        """Disarm, if that is not known to be done, and let go of the streams of samples."""
        if self._exchange.may_be_armed:
            self._exchange.disarm()
        self._streams = {}

    def _sweep(self, asked_s: float, end_s: float, reply: Reply) -> Sweep:
        """The waveforms, with 0 at the pulse, which was after it was asked for, and before now."""
        fired_s = reply.number("t_fired") + self._markers.correction_s(_left_s(end_s))  # by the local LSL clock
        if not asked_s - _CLOCKS_S <= fired_s <= self._lsl.local_clock() + _CLOCKS_S:
            raise reply.broken(
                "the pulse is not of this trial",
                got=f"t_fired {fired_s - asked_s:+.3g} s after it was asked for",
                remedy="t_fired is the time of the pulse by lsl_local_clock of the computer that sends the echo.",
            )
        span_s = (fired_s - self._before_s, fired_s + self._after_s)
        until_s = min(end_s, time.monotonic() + self._after_s + LATE_S)
        cuts = {name: stream.cut(*span_s, until_s) for name, stream in self._streams.items()}
        channels = {}
        for name, channel in self._channels.items():
            begin_s, values = cuts[channel.stream]
            t0_ms = 1e3 * (begin_s - fired_s)
            channels[name] = Channel(values[:, channel.column], channel.rate_hz, channel.unit, t0_ms)
        return sweep_of(channels, 0.0, reply)

    def _found(self, end_s: float) -> dict[str, Any]:
        """The streams by name, each there once."""
        wanted = {*self._rates_hz, self._markers.echo}
        query = " or ".join(f"name='{name}'" for name in sorted(wanted))
        while True:
            there = self._lsl.resolve_bypred(query, minimum=len(wanted) + 1, timeout=_SEARCH_S)
            if wanted == {info.name() for info in there}:
                for name in wanted:
                    hosts = [info.hostname() for info in there if info.name() == name]
                    if len(hosts) > 1:
                        raise DeviceError(
                            f"the stream {name} is there {len(hosts)} times",
                            got=f"from {', '.join(hosts)}",
                            remedy="Close what is left of an earlier run, or give the streams names of their own.",
                        )
                return {info.name(): info for info in there}
            if not _left_s(end_s):
                missing = sorted(wanted - {info.name() for info in there})
                raise DeviceTimeoutError(
                    "streams are missing on the network",
                    got=", ".join(missing),
                    expected=f"each within {self._stage_timeout_s:g} s",
                    remedy="Start what sends them. Between computers, let UDP and TCP ports 16571 to 16604 through.",
                )

    def _opened(self, name: str, info: Any, end_s: float) -> SampleStream:
        """A stream of samples that is what it should be."""
        rate_hz = self._rates_hz[name]
        last = max(channel.column for channel in self._channels.values() if channel.stream == name)
        if info.nominal_srate() != rate_hz or info.channel_count() <= last:
            raise DeviceError(
                f"the stream {name} is another than expected",
                got=f"{info.channel_count()} channels at {info.nominal_srate():g} Hz",
                expected=f"at least {last + 1} at {rate_hz:g} Hz",
                remedy="Correct the channels of the configuration, or what the sender states.",
            )
        kept_s = self._before_s + self._after_s + _BUFFER_S
        inlet = self._inlet(info, end_s)
        return SampleStream(
            inlet, name, rate_hz, self._max_jitter_ms, kept_s, (self._lsl.util.LostError, self._lsl.util.TimeoutError)
        )

    def _inlet(self, info: Any, end_s: float) -> Any:
        """An open inlet that tells when its stream is lost, and knows how its clock differs."""
        buffered_s = math.ceil(self._before_s + self._after_s + _BUFFER_S)
        inlet = self._lsl.StreamInlet(info, max_buflen=buffered_s, recover=False)
        try:
            inlet.open_stream(_left_s(end_s))
            inlet.time_correction(_left_s(end_s))
        except (self._lsl.util.TimeoutError, self._lsl.util.LostError) as error:
            raise DeviceTimeoutError(f"the stream {info.name()} cannot be opened", got=str(error)) from error
        return inlet


def _left_s(end_s: float) -> float:
    """The time until then, by the monotonic clock [s]; at least 0."""
    return max(0.0, end_s - time.monotonic())


def _rates_hz(channels: Mapping[str, LslChannel]) -> dict[str, float]:
    if "emg" not in channels:
        raise InvalidValueError("a sweep needs its EMG", got=", ".join(channels), expected="a channel named emg")
    rates_hz: dict[str, float] = {}
    for channel in channels.values():
        if "'" in channel.stream:
            raise InvalidValueError("liblsl cannot look for a name with an apostrophe", got=channel.stream)
        if rates_hz.setdefault(channel.stream, channel.rate_hz) != channel.rate_hz:
            raise InvalidValueError(f"the stream {channel.stream} has two rates", got=channel.rate_hz)
    return rates_hz
