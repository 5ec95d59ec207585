"""The impact found as its samples arrive, against that in the whole sweep: do they agree, and how late is it known?

    python -m benchmarks.impact_stream > benchmarks/results/impact_stream.md

Sweeps are the tapping robot's, at 5 kHz, in pieces of 1 ms; every preset has its share.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

PRESETS = ("bench", "subject1", "subject2", "subject3", "subject4", "cushion")
SWEEPS, PIECE = 2500, 5
SEED = 10_000


@dataclass(frozen=True)
class Answer:
    """The same MEP each time."""

    mep_mv: float = 0.1


def streamed(acceleration: np.ndarray, rate_hz: float, valve: int) -> tuple[float, float, float]:
    """The impact [ms from the first sample], its delay [ms], and what a piece took on average [ms]; NaN where none."""
    detector = isiw.signals.ImpactDetector(rate_hz)
    detector.add(acceleration[:valve])
    detector.valve()
    begin_s, firsts = time.process_time(), range(valve, len(acceleration), PIECE)
    found = [detector.add(acceleration[first : first + PIECE]) for first in firsts]
    piece_ms = 1000 * (time.process_time() - begin_s) / len(firsts)
    impact = next((impact for impact in found if impact is not None), None)
    if impact is None:
        return np.nan, np.nan, piece_ms
    return impact.hit_ms + 1000 * valve / rate_hz, impact.known_ms - impact.hit_ms, piece_ms


def compared(preset: str, sweeps: int) -> tuple[int, np.ndarray, np.ndarray]:
    """In how many sweeps both say the same, the delays, and what a piece took in each [ms]."""
    device = isiw.SimulatedDevice(isiw.Tapper(lambda _: Answer(), preset, seed=SEED))
    device.stage()
    same, delays_ms, pieces_ms = 0, [], []
    for trial in range(sweeps):
        sweep = device.deliver(isiw.Stimulus(trial, 60.0), 1.0)
        channel = sweep.channels["acceleration"]
        whole = isiw.signals.impact_time(channel.values, channel.rate_hz, sweep.t_valve_ms)
        hit_ms, delay_ms, piece_ms = streamed(
            channel.values, channel.rate_hz, round(sweep.t_valve_ms * channel.rate_hz / 1000)
        )
        same += np.isnan(hit_ms) if whole is None else abs(hit_ms - whole) < 1e-6
        delays_ms.append(delay_ms)
        pieces_ms.append(piece_ms)
    return same, np.array(delays_ms), np.array(pieces_ms)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweeps", type=int, default=SWEEPS)
    sweeps = parser.parse_args().sweeps
    print(f"- command: `{command_of('impact_stream')}`")
    print(f"- {made_with('numpy')}, seed {SEED}\n")
    print(
        "| preset | sweeps | same as in the whole sweep | delay [ms]: median | largest | 1 ms of samples takes [ms] |"
    )
    print("|---|---|---|---|---|---|")
    for number, preset in enumerate(PRESETS):
        share = len(range(number, sweeps, len(PRESETS)))
        same, delays_ms, pieces_ms = compared(preset, share)
        late = f"{np.nanmedian(delays_ms):.2f} | {np.nanmax(delays_ms):.2f}"
        print(f"| {preset} | {share} | {same} | {late} | {np.median(pieces_ms):.3f} |")


if __name__ == "__main__":
    understood("impact_stream", prints=True)
    main()
