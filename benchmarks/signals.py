"""How long the signals take: one sweep of 1 s with five channels at 5 kHz, and 1,000 of them in a batch, on one core.

    OMP_NUM_THREADS=1 python -m benchmarks.signals > benchmarks/results/signals.txt

One sweep: all its events, and its judgement. A batch: all events, MEP amplitudes, onsets, and background EMG.
"""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import isiw
from benchmarks.provenance import made_with
from benchmarks.quick import understood

SWEEPS, REPEATS = 1000, 7
RATE_HZ, ISI_MS = 5000.0, 60.0
SWEEP_LIMIT_S, BATCH_LIMIT_S = 0.005, 1.0


@dataclass(frozen=True)
class Answer:
    """The same MEP each time."""

    mep_mv: float = 0.1


def seconds(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Median and largest duration of some runs [s], after one to warm up."""
    work()
    taken = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken), max(taken)


def main() -> None:
    """Measure and print."""
    device, space = isiw.SimulatedDevice(isiw.Tapper(lambda _: Answer(), "bench")), isiw.IMPACT_SPACE
    device.stage()
    stimuli = [isiw.Stimulus(trial, ISI_MS) for trial in range(SWEEPS)]
    sweeps = [device.deliver(stimulus, 1.0) for stimulus in stimuli]
    waves = {name: np.stack([sweep.channels[name].values for sweep in sweeps]) for name in sweeps[0].channels}
    pulses = np.array([sweep.t_tms_ms for sweep in sweeps])

    def one_sweep() -> None:
        isiw.signals.sweep_events(sweeps[5])
        isiw.signals.judge(sweeps[5], stimuli[5], space)

    def batch() -> None:
        events = isiw.signals.detect_events(
            waves["acceleration"], RATE_HZ, pressure=waves["pressure"], emg=waves["emg"], t_tms_ms=pulses
        )
        isiw.signals.mep_amplitudes(waves["emg"], RATE_HZ, pulses)
        isiw.signals.mep_onsets(waves["emg"], RATE_HZ, pulses)
        isiw.signals.background_rms(waves["emg"], RATE_HZ, pulses, events.hit_ms)

    print(f"{made_with('numpy', 'scipy')}; {platform.machine()}, one thread")
    print(f"channels: {', '.join(waves)}; {waves['emg'].shape[1]} samples at {RATE_HZ:g} Hz")
    for what, work, repeats, limit_s in (
        ("one sweep", one_sweep, 200, SWEEP_LIMIT_S),
        (f"{SWEEPS} sweeps", batch, REPEATS, BATCH_LIMIT_S),
    ):
        median_s, worst_s = seconds(work, repeats)
        kept = "kept" if median_s < limit_s else "MISSED"
        print(f"{what:12} median {1e3 * median_s:7.2f} ms, worst {1e3 * worst_s:7.2f} ms of {repeats} runs; "
              f"limit {1e3 * limit_s:g} ms {kept}")  # fmt: skip


if __name__ == "__main__":
    understood("signals", prints=True)
    main()
