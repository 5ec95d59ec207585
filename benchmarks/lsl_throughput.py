"""Whether samples are lost on their way from another process over the Lab Streaming Layer into sweeps.

    python -m benchmarks.lsl_throughput > benchmarks/results/lsl_throughput.md

Another process streams 8 channels at 5,000 Hz in real time, in chunks of 10 ms, and answers to the markers of
`isiw.LslDevice`. The first channel is the number of the sample. Sweeps are longer than the time between them, so that
together they hold every sample; one that is missing would show as a number that is missing. Needs the extra lsl.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pylsl

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

CHUNK_S = 0.01
UNITS = {"emg": "mV"} | {f"channel{number}": "V" for number in range(2, 9)}


def stream(outlet: pylsl.StreamOutlet, rate_hz: float, columns: int) -> None:
    """Send numbered samples in real time, for ever; a column a channel."""
    start_s, sent = pylsl.local_clock(), 0
    ahead = np.arange(columns, dtype=np.float64)
    while True:
        time.sleep(CHUNK_S)
        due = int((pylsl.local_clock() - start_s) * rate_hz)
        numbers = np.arange(sent, due, dtype=np.float64)
        outlet.push_chunk(numbers[:, None] + ahead, start_s + (due - 1) / rate_hz)
        sent = due


def rig(name: str, rate_hz: float, columns: int) -> None:
    """The process at the other end."""
    emg = pylsl.StreamInfo(f"{name}-emg", "EMG", columns, rate_hz, "double64", f"{name}-emg")
    threading.Thread(target=stream, args=(pylsl.StreamOutlet(emg), rate_hz, columns), daemon=True).start()
    echo = pylsl.StreamOutlet(pylsl.StreamInfo(f"{name}-echo", "Markers", 1, 0, "string", f"{name}-echo"))
    markers = pylsl.StreamInlet(pylsl.resolve_byprop("name", f"{name}-markers", 1, 30)[0])
    said = {"arm": "armed", "deliver": "delivered", "disarm": "disarmed"}
    while True:
        request = json.loads(markers.pull_sample()[0][0])
        answer = {key: request[key] for key in ("token", "number")} | {"said": said[request["verb"]]}
        if request["verb"] == "deliver":
            answer |= {"trial": request["trial"], "t_fired": pylsl.local_clock()}
        echo.push_sample([json.dumps(answer)])


@contextmanager
def staged(rate_hz: float, sweep_s: float) -> Iterator[isiw.LslDevice]:
    """A device with a rig of its own."""
    name = f"throughput-{uuid.uuid4().hex[:8]}"
    process = multiprocessing.get_context("spawn").Process(target=rig, args=(name, rate_hz, len(UNITS)), daemon=True)
    process.start()
    channels = {
        channel: isiw.LslChannel(f"{name}-emg", unit, rate_hz, column)
        for column, (channel, unit) in enumerate(UNITS.items())
    }
    device = isiw.LslDevice(
        channels=channels,
        info=isiw.DeviceInfo("throughput", "impact", simulated=True),
        markers=f"{name}-markers",
        echo=f"{name}-echo",
        before_ms=1e3 * sweep_s,
        after_ms=20.0,
    )
    device.stage()
    try:
        yield device
    finally:
        device.unstage()
        process.terminate()


def measure(device: isiw.LslDevice, duration_s: float) -> tuple[np.ndarray, np.ndarray, int]:
    """The numbers of the samples of all sweeps, how long each delivery took [s], and how many samples were mixed up."""
    numbers, took_s, mixed = [], [], 0
    end_s, trial = time.monotonic() + duration_s, 0
    while time.monotonic() < end_s:
        began_s = time.monotonic()
        sweep = device.deliver(isiw.Stimulus(trial, None), 10.0)
        took_s.append(time.monotonic() - began_s)
        columns = [sweep.channels[name].values for name in UNITS]
        mixed += sum(int((column != columns[0] + ahead).sum()) for ahead, column in enumerate(columns))
        numbers.append(columns[0])
        trial += 1
        time.sleep(0.5)
    return np.unique(np.concatenate(numbers)), np.array(took_s), mixed


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate-hz", type=float, default=5000.0)
    arguments = parser.parse_args()
    with staged(arguments.rate_hz, sweep_s=2.0) as device:
        spent_s = time.process_time()
        numbers, took_s, mixed = measure(device, arguments.seconds)
        spent_s = time.process_time() - spent_s
    span = int(numbers[-1] - numbers[0]) + 1
    print(f"- command: `{command_of('lsl_throughput')}`")
    print(f"- {made_with('pylsl')}, liblsl {pylsl.library_version() / 100:g},")
    print(
        f"  {len(UNITS)} channels at {arguments.rate_hz:g} Hz, two processes on one machine over its loopback network\n"
    )
    rows = {
        "samples sent from the first sweep to the last": f"{span:,}",
        "of these in the sweeps": f"{len(numbers):,}",
        "lost": f"{span - len(numbers):,}",
        "values in another channel's place": f"{mixed:,}",
        "sweeps of 2.02 s": f"{len(took_s):,}",
        "time of a delivery, the 20 ms after its pulse included, median": f"{1e3 * np.median(took_s[1:]):.0f} ms",
        "the longest": f"{1e3 * took_s[1:].max():.0f} ms",
        "time of the processor a second": f"{1e3 * spent_s / arguments.seconds:.0f} ms",
    }
    print("| | |\n|---|---|")
    print("\n".join(f"| {what} | {found} |" for what, found in rows.items()))


if __name__ == "__main__":
    understood("lsl_throughput", prints=True)
    main()
