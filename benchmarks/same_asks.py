"""Do strategies ask what they asked before? A hash of what each named strategy asks, to be compared between versions.

    python -m benchmarks.same_asks > asks.txt

Each strategy examines simulated people in `isiw.Session`, on a virtual clock, by default 20 people with at most 40
stimuli each. Hashed are the ISIs that were asked and all amplitudes, bit for bit. The same machine, versions and single
thread give the same hashes; a change of the shell around the strategies must change none of them.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import tempfile
import time
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch
from rich.console import Console

import isiw
from benchmarks.quick import understood
from isiw.subjects.cohorts import cohort

SPACE = isiw.VALVE_SPACE


def asked(name: str, log: Path, seed: int, stimuli: int) -> Sequence[tuple[float | None, float | None]]:
    """The ISI [ms] and the amplitude [mV] of each trial of one session.

    Args:
        name: the strategy's.
        log: where its log is put.
        seed: of the person, the noise and the strategy.
        stimuli: how many are given at most.
    """
    person = cohort("recruitment", 1, seed)[0]
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(partial(person.begin(seed).respond, reference="valve"), "valve"))
    strategy = isiw.make_strategy(name, space=SPACE, seed=seed)
    limits = isiw.Limits.of_space(SPACE, max_pulses=stimuli)
    result = isiw.Session(device, strategy, log=log, limits=limits).run(progress=False)
    return [(trial.commanded_isi_ms, trial.mep_mv) for trial in result.trials]


def hash_of(name: str, sessions: int, stimuli: int) -> tuple[str, int]:
    """The hash of all sessions of a strategy, and how many trials they had.

    Args:
        name: the strategy's.
        sessions: how many.
        stimuli: how many each has at most.
    """
    digest, trials = hashlib.sha256(), 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(sessions):
            for values in asked(name, Path(folder, f"{seed}.mcap"), seed, stimuli):
                digest.update(" ".join("-" if value is None else value.hex() for value in values).encode())
                trials += 1
    return digest.hexdigest()[:32], trials


def main() -> None:
    """Print a line a strategy: its name, its hash, how many trials, and to the screen how long it took."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--sessions", type=int, default=20)
    parser.add_argument("--stimuli", type=int, default=40)
    parser.add_argument("--strategies", nargs="*", default=list(isiw.list_strategies()))
    options = parser.parse_args()
    torch.set_num_threads(1)
    warnings.simplefilter("ignore")
    screen = Console(stderr=True)
    for name in options.strategies:
        began_s = time.perf_counter()
        hashed, trials = hash_of(name, options.sessions, options.stimuli)
        print(f"{name:24} {hashed} {trials} trials", flush=True)
        screen.print(f"{name}: {time.perf_counter() - began_s:.0f} s")


if __name__ == "__main__":
    understood("same_asks", prints=True)
    main()
