"""Does the engine read or write beyond an array? Random sessions with a library that checks itself.

    python -m benchmarks.bounds > benchmarks/results/bounds.md

Each session has another space, number of particles and length, and is a random mix of all that a session of a lab's
own loop may have: amplitudes, censored ones, intervals, uncertain ISIs, TMS alone, taps alone, lost trials, notes of
changes, and trials that are excluded. The engine is compiled with the sanitizers for addresses and for undefined
behaviour; whatever they find ends the process. `--part` plays the sessions of one process.
"""

from __future__ import annotations

import argparse
import collections
import json
import tempfile
import warnings
from pathlib import Path

import numpy as np
import torch

import isiw
from benchmarks import sanitized
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

STRATEGIES = ("default", "default", "default", "particles-window", "supra-threshold")
MOST_STEPS = 18
TOGETHER = 250
"""So many sessions have a process."""

KINDS = ("amplitude", "censored", "interval", "uncertain ISI", "TMS alone", "tap alone", "lost", "change", "excluded")
WEIGHTS = (8, 2, 2, 1, 2, 2, 1, 2, 1)


def space_of(rng: np.random.Generator) -> isiw.DesignSpace:
    """A random design space: a grid, fine or coarse, or a list of ISIs."""
    reference = ("impact", "valve")[rng.integers(2)]
    first_ms = 0 if reference == "impact" else -50  # before the impact there is no pair
    if rng.random() < 0.2:
        isis_ms = rng.choice(np.arange(float(first_ms), 500.0), size=rng.integers(2, 70), replace=False).tolist()
        return isiw.DesignSpace.of(isis_ms, reference=reference)
    step_ms = float(rng.choice([0.5, 1.0, 2.0, 5.0, 10.0]))
    low_ms = float(rng.integers(first_ms, 150))
    return isiw.DesignSpace(low_ms, low_ms + step_ms * int(rng.integers(1, 120)), step_ms, reference=reference)


def played(seed: int, folder: Path) -> collections.Counter[str]:
    """Play one random session; how many there were of each of `KINDS`.

    Args:
        seed: of everything in it.
        folder: where its log is put.
    """
    rng, counts = np.random.default_rng(seed), collections.Counter[str]()
    space, particles = space_of(rng), int(rng.integers(2, 70))
    name = STRATEGIES[rng.integers(len(STRATEGIES))]
    strategy = isiw.make_strategy(name, space=space, seed=seed, particles=particles, thinned=int(rng.integers(1, 70)))
    with isiw.open_session(strategy, folder / f"{seed}.mcap") as session:
        for _ in range(rng.integers(1, MOST_STEPS)):
            kind = str(rng.choice(KINDS, p=np.divide(WEIGHTS, sum(WEIGHTS))))
            counts[kind] += 1
            _step(session, kind, rng)
        session.estimate()
    return counts


def _step(session: isiw.Recorder, kind: str, rng: np.random.Generator) -> None:
    mep_mv = round(float(np.exp(rng.normal(-2.5, 1.2))), int(rng.integers(2, 6))) + 0.001
    if kind == "change":
        session.note_change("the coil moved")
    elif kind == "excluded":
        if counting := [trial.index for trial in session.trials if trial.counts]:
            session.exclude(int(rng.choice(counting)))
    elif kind == "TMS alone":
        session.tell(None, mep_mv)
    elif kind == "tap alone":
        session.tell(float(rng.choice(session.strategy.space.grid_ms)), mep_mv, pulse=False)
    else:
        isi_ms = session.ask() + float(rng.normal(0.0, 1.0))
        if session.strategy.space.reference == "impact":  # before it there is no pair
            isi_ms = max(isi_ms, 0.0)
        if kind == "lost":
            session.mistrial("background activity")
        elif kind == "interval":
            session.tell(isi_ms, mep_interval_mv=(mep_mv, float(rng.choice([2.0 * mep_mv, np.inf]))))
        else:
            session.tell(isi_ms, 0.0 if kind == "censored" else mep_mv, isi_sd_ms=3.0 * (kind == "uncertain ISI"))


def part(first: int, sessions: int) -> None:
    """Play sessions with the library that checks itself, and print how many there were of each of `KINDS`."""
    sanitized.take()
    torch.set_num_threads(1)
    warnings.simplefilter("ignore")
    counts, wrong = collections.Counter[str](), dict[int, str]()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + sessions):
            try:
                counts += played(seed, Path(folder))
            except Exception as error:  # noqa: BLE001 - which is what is looked for
                wrong[seed] = f"{type(error).__name__}: {error}"
    print(json.dumps([counts, wrong]))


def main() -> None:
    """Play many random sessions, and say what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0, help="of the first one")
    parser.add_argument("--part", action="store_true", help="in this process")
    options = parser.parse_args()
    if options.part:
        part(options.seed, options.sessions)
        return
    counts, wrong = collections.Counter[str](), dict[str, str]()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.seed, options.seed + options.sessions, TOGETHER):
            some = min(TOGETHER, options.seed + options.sessions - seed)
            arguments = ["-m", "benchmarks.bounds", "--part", "--seed", str(seed), "--sessions", str(some)]
            ended = sanitized.run(arguments, Path(folder))
            if ended.returncode:
                wrong[f"{seed} to {seed + some - 1}"] = ended.stderr[-2000:]
                continue
            played_by_kind, refused = json.loads(ended.stdout.splitlines()[-1])
            counts += collections.Counter(played_by_kind)
            wrong |= refused
    print(f"- command: `{command_of('bounds')}`")
    print(f"- {made_with('numpy', 'torch')}, seeds {options.seed} to {options.seed + options.sessions - 1}\n")
    print(f"{options.sessions:,} random sessions with a library that checks itself:\n")
    print("| of which | number |\n|---|---|")
    for kind in KINDS:
        print(f"| {kind} | {counts[kind]:,} |")
    print(f"| **sessions, or sets of them, that an error ended** | **{len(wrong):,}** |")
    for which, error in list(wrong.items())[:20]:
        print(f"\nSeed {which}: {error}")
    raise SystemExit(bool(wrong))


if __name__ == "__main__":
    understood("bounds", prints=True)
    main()
