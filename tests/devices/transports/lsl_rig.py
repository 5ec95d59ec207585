"""A process that answers on the Lab Streaming Layer: `python -m devices.transports.lsl_rig NAME FAULTS RATE_HZ …`.

FAULTS is JSON: what is wrong with each trial, by its number; "arm" and "disarm" may be there, too. A second rate is
that of an accelerometer.
"""

from __future__ import annotations

import json
import math
import random
import sys
import threading
import time

import pylsl

from devices.transports.lies import Values, answer

LATENCY_S = 0.025  # from the pulse to the peak of the MEP
_TICK_S = 0.01


class Amplifier(threading.Thread):
    """Streams EMG and the number of each sample, in real time and stamped by a steady clock."""

    def __init__(self, name: str, rate_hz: float) -> None:
        super().__init__(daemon=True)
        info = pylsl.StreamInfo(name, "EMG", 2, rate_hz, "float32", name)
        self.outlet: pylsl.StreamOutlet | None = pylsl.StreamOutlet(info)
        self.rate_hz, self.random = rate_hz, random.Random(1)  # noqa: S311 - noise
        self.start_s, self.sent, self.fired_s, self.fault = pylsl.local_clock(), 0, -math.inf, ""
        self.stamp_s = self.start_s

    def run(self) -> None:
        while self.outlet is not None:
            due = int((pylsl.local_clock() - self.start_s) * self.rate_hz)
            self.fail(due)
            if self.outlet is not None and due > self.sent and self.fault != "silent":
                last = self.sent + 2 if self.fault == "late" else due
                samples = [self.sample(number) for number in range(self.sent, last)]
                step_s = (1.05 if self.fault == "rate" else 1.0) / self.rate_hz
                stamps = [self.stamp_s + step_s * ahead for ahead in range(last - self.sent)]
                self.stamp_s += step_s * (last - self.sent)
                self.outlet.push_chunk(samples, stamps)
                self.sent = last
            time.sleep(_TICK_S)

    def fail(self, due: int) -> None:
        """Begin what goes wrong, 30 ms after the pulse."""
        if pylsl.local_clock() - self.fired_s < 0.03:
            return
        if self.fault == "dropped":
            self.stamp_s += (due - self.sent) / self.rate_hz
            self.sent, self.fault = due, ""
        if self.fault == "lost":
            self.outlet = None

    def sample(self, number: int) -> list[float]:
        since_s = self.start_s + number / self.rate_hz - self.fired_s
        mep = math.exp(-0.5 * ((since_s - LATENCY_S) / 0.002) ** 2) if 0 < since_s < 0.1 else 0.0
        return [0.4 * mep + self.random.gauss(0, 0.0015), float(number)]


def main() -> None:
    """Answer until nobody cares."""
    name, faults, rate_hz = sys.argv[1], json.loads(sys.argv[2]), float(sys.argv[3])
    amplifier = Amplifier(f"{name}-emg", rate_hz)
    amplifier.start()
    for accelerometer_hz in map(float, sys.argv[4:]):
        Amplifier(f"{name}-accelerometer", accelerometer_hz).start()
    echo = pylsl.StreamOutlet(pylsl.StreamInfo(f"{name}-echo", "Markers", 1, 0, "string", f"{name}-echo"))
    found = pylsl.resolve_byprop("name", f"{name}-markers", 1, 30)
    markers = pylsl.StreamInlet(found[0])
    while True:
        sample, _ = markers.pull_sample(1.0)
        if sample is not None:
            request = json.loads(sample[0])
            fault = faults.get(str(request["trial"]) if request["verb"] == "deliver" else request["verb"], "")
            obey(request, fault, amplifier, echo)


def obey(request: Values, fault: str, amplifier: Amplifier, echo: pylsl.StreamOutlet) -> None:
    """Answer one request."""
    values = answer(request, fault)
    if request["verb"] == "deliver":
        amplifier.fault = fault
        amplifier.fired_s = pylsl.local_clock() + 1e-3 * request.get("isi_ms", 0.0)
        time.sleep(max(0.0, amplifier.fired_s - pylsl.local_clock()))
        values |= {"t_fired": amplifier.fired_s - (5.0 if fault == "an old pulse" else 0.0)}
        values |= {"t_hit_ms": -request["isi_ms"]} if "isi_ms" in request else {}
    if fault != "no echo":
        texts = {"not JSON": "fired!", "a list": "[1, 2]", "too long": "x" * 70_000}
        echo.push_sample([texts.get(fault, json.dumps(values))])


if __name__ == "__main__":
    main()
