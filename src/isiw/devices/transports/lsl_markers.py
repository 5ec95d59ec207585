"""Requests as markers of the Lab Streaming Layer, and answers as echoes, both as JSON texts."""

from __future__ import annotations

import json
import threading
import time
from typing import Any, Final

from isiw.devices.transports.exchange import Request, Verb
from isiw.devices.transports.reply import LONGEST_REPLY, Reply
from isiw.errors import DeviceError, DeviceTimeoutError, NotDelivered
from isiw.text.json_texts import read_json

_GLANCE_S: Final = 0.02
_MOST_KEPT: Final = 8


class Markers:
    """Carries requests as markers, and answers as echoes.

    Args:
        lsl: the library.
        name: of the stream of markers.
        echo: the name of the stream of echoes.
    """

    def __init__(self, lsl: Any, name: str, echo: str) -> None:
        self._lsl, self._name, self.echo = lsl, name, echo
        self._outlet: Any = None
        self._inlet: Any = None
        self._pulling = threading.Lock()
        self._replies: dict[int, Reply] = {}
        self._newest: Request | None = None
        self._others = 0

    @property
    def connected(self) -> bool:
        """Whether there is somebody to ask."""
        return self._inlet is not None

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
            self._inlet = inlet

    def await_listener(self, timeout_s: float) -> None:
        """Wait until somebody listens, since markers are lost that nobody listens to.

        Raises:
            DeviceTimeoutError: nobody does.
        """
        if not self._outlet.wait_for_consumers(timeout_s):
            raise DeviceTimeoutError(
                "nobody listens to the markers",
                got=f"the stream {self._name}",
                remedy="Let the software that drives the hardware open an inlet to it.",
            )

    def correction_s(self, timeout_s: float) -> float:
        """What has to be added to times of an echo to be on the local clock [s].

        Raises:
            DeviceError: it is not known.
        """
        try:
            return float(self._inlet.time_correction(timeout_s))
        except (self._lsl.util.TimeoutError, self._lsl.util.LostError) as error:
            raise DeviceError(f"the clock of {self.echo} is not known", got=str(error)) from error

    def send(self, request: Request) -> None:
        """Push a marker."""
        if not self._outlet.have_consumers():
            kind = NotDelivered if request.verb is Verb.DELIVER else DeviceError
            raise kind("nobody listens to the markers any more", got=f"the stream {self._name}")
        self._newest = request
        self._outlet.push_sample([json.dumps(request.values())])

    def reply(self, request: Request, wait_s: float) -> Reply | None:
        """The echo of a request; several threads may wait for one each."""
        end_s = time.monotonic() + wait_s
        while (reply := self._replies.pop(request.number, None)) is None and (left_s := end_s - time.monotonic()) >= 0:
            if self._pulling.acquire(timeout=_GLANCE_S):
                try:
                    self._pull(min(_GLANCE_S, left_s))
                finally:
                    self._pulling.release()
        return reply

    def silence(self, request: Request) -> DeviceError:
        """The error to raise where no echo came in time."""
        others = f", and {self._others} echoes of other requests" if self._others else ""
        return DeviceTimeoutError(
            f"no echo of the request to {request.verb}",
            got=f"silence on {self.echo}{others}",
            expected=f"one within {request.timeout_s:.3g} s",
            remedy="Does the software run that listens to the markers, and does it copy token and number?",
        )

    def _pull(self, wait_s: float) -> None:
        try:
            sample, _ = self._inlet.pull_sample(wait_s)
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
    """The values of an echo."""
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
