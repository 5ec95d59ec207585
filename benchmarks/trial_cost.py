"""What a trial of a session costs besides the strategy and the device: limits, deadlines, log and signals.

    python -m benchmarks.trial_cost --folder /dev/shm > benchmarks/results/trial_cost.md

The strategy is that of `benchmarks/remembering.py`, which costs next to nothing, and the device answers at once. On a
folder in memory a sync costs nothing, so that what is left is the loop. To compare with another version, run the same
file with that version's `src` in PYTHONPATH.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
import torch

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.remembering import SPACE, answer, strategy


def trial_s(folder: Path, trials: int) -> np.ndarray:
    """How long each trial took [s], but the first: by the clock, and of the processor; shape (trials - 1, 2)."""
    ended_s: list[tuple[float, float]] = []
    info = isiw.DeviceInfo("at once", "valve", simulated=True)
    limits = isiw.Limits.of_space(SPACE, max_pulses=trials)
    isiw.Session(
        isiw.CallbackDevice(answer, info),
        strategy(trials, 1),
        log=folder / "s.mcap",
        limits=limits,
        on_trial=lambda _: ended_s.append((time.perf_counter(), time.process_time())),
    ).run()
    return np.diff(np.array(ended_s), axis=0)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--folder", type=Path, default=None, help="where to log; by default the usual temporary one")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
        spent_ms = 1e3 * trial_s(Path(folder), arguments.trials)
    print(f"- command: `{command_of('trial_cost')}`")
    print(f"- {made_with()}, one thread\n")
    print("| trials | median, by the clock [ms] | median, of the processor [ms] |\n|---|---|---|")
    for part in np.array_split(np.arange(len(spent_ms)), 5):
        clock_ms, processor_ms = np.median(spent_ms[part], axis=0)
        print(f"| {part[0] + 1} to {part[-1] + 1} | {clock_ms:.2f} | {processor_ms:.2f} |")


if __name__ == "__main__":
    understood("trial_cost", prints=True)
    main()
