"""How long a strategy takes between two stimuli: ask and tell at 50 trials, on one core, beside plain BoTorch.

    python -m benchmarks.latency > benchmarks/results/latency.md

Each strategy examines the same simulated people of the `recruitment` cohort in the valve space. Timed are the asks and
tells of trials 46 to 55, each ask with the tell before it; the other trials are run but not counted. Before that the
default is timed through whole long sessions, and the memory told that the process needs for them. Plain BoTorch is a
`SingleTaskGP` fitted to all trials after each, and `qNegIntegratedPosteriorVariance` over the same candidate ISIs.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Protocol

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from botorch.acquisition.active_learning import qNegIntegratedPosteriorVariance
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from gpytorch.mlls import ExactMarginalLogLikelihood
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.subjects.cohorts import cohort

TIMED_TRIALS = range(46, 56)
PLAIN = "plain BoTorch: SingleTaskGP + qNIPV"


class Asked(Protocol):
    """What is timed."""

    def ask(self) -> float:
        """The next ISI [ms]."""

    def tell(self, isi_ms: float, mep_mv: float) -> None:
        """Learn from one trial."""


class PlainBotorch:
    """The textbook loop, without anything that isiw adds."""

    def __init__(self, space: isiw.DesignSpace) -> None:
        self.span_ms = space.high_ms - space.low_ms
        self.candidates = torch.linspace(0.0, 1.0, 101, dtype=torch.double).view(-1, 1, 1)
        self.shares: list[float] = []
        self.meps_mv: list[float] = []

    def ask(self) -> float:
        """The next ISI [ms]: evenly spaced at first, then by qNIPV."""
        if len(self.shares) < 5:
            return len(self.shares) / 4 * self.span_ms
        meps_mv = torch.tensor(self.meps_mv, dtype=torch.double)
        targets = ((meps_mv - meps_mv.mean()) / meps_mv.std()).unsqueeze(-1)
        model = SingleTaskGP(torch.tensor(self.shares, dtype=torch.double).unsqueeze(-1), targets)
        fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
        scores = qNegIntegratedPosteriorVariance(model, mc_points=self.candidates.squeeze(1))(self.candidates)
        return float(self.candidates[scores.argmax()]) * self.span_ms

    def tell(self, isi_ms: float, mep_mv: float) -> None:
        """Remember one trial."""
        self.shares.append(isi_ms / self.span_ms)
        self.meps_mv.append(mep_mv)


def waits_s(make: Callable[[int], Asked], people: int, seed: int, timed: range) -> Iterator[tuple[float, float]]:
    """Durations of a tell, and of the ask that follows it [s], at some trials."""
    for number, person in enumerate(cohort("recruitment", people, seed)):
        player, responder = make(seed + number), person.begin(seed + number)
        isi_ms = player.ask()
        for trial in range(1, timed.stop):
            response = responder.respond(isi_ms, isiw.VALVE_SPACE.reference)
            began_s = time.perf_counter()
            player.tell(response.isi_ms, response.mep_mv)
            told_s = time.perf_counter()
            isi_ms = player.ask()
            if trial in timed:
                yield told_s - began_s, time.perf_counter() - told_s


def told(taken_s: np.ndarray) -> str:
    """Median, 99th percentile and maximum [ms], as cells of a table."""
    middle, late, largest = 1e3 * np.percentile(taken_s, (50, 99, 100))
    return f"{middle:.1f} | {late:.1f} | {largest:.1f}"


def makers() -> dict[str, Callable[[int], Asked]]:
    """Everything that is timed, by name."""
    named: dict[str, Callable[[int], Asked]] = {
        name: lambda seed, name=name: isiw.make_strategy(name, seed=seed) for name in isiw.list_strategies()
    }
    return named | {PLAIN: lambda _seed: PlainBotorch(isiw.VALVE_SPACE)}


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--seed", type=int, default=10_000)
    parser.add_argument("--through", type=int, default=200, help="trials of the long session")
    parser.add_argument("--long-people", type=int, default=2, help="long sessions")
    parser.add_argument("--strategies", default=",".join(makers()), help="comma-separated")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    # What BoTorch has to say about the scaling of its inputs is not what is measured here.
    warnings.filterwarnings("ignore", module="botorch|gpytorch|linear_operator")
    names = arguments.strategies.split(",")
    versions = made_with("torch", "botorch", "gpytorch", "pyro-ppl", "scikit-learn", "numpy")
    print(f"- command: `{command_of('latency')}`")
    print(f"- {versions}; {platform.machine()}, one thread\n")
    through = range(1, arguments.through + 1)
    print(f"The default, {arguments.long_people} people, trials 1 to {arguments.through} [ms]\n")
    print("| | median | 99th percentile | largest |\n|---|---|---|---|")
    taken_s = np.array(list(waits_s(makers()["default"], arguments.long_people, arguments.seed, through)))
    for verb, column in zip(("tell", "ask"), taken_s.T, strict=True):
        print(f"| {verb} | {told(column)} |")
    print(f"\nLargest resident memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB\n")
    print(f"{arguments.people} people of `recruitment`, seed {arguments.seed}; tell + ask at 46 to 55 trials [ms]\n")
    print("| strategy | median | 99th percentile | largest |\n|---|---|---|---|")
    for name in track(names, "timing", console=Console(stderr=True)):
        taken_s = np.array(list(waits_s(makers()[name], arguments.people, arguments.seed, TIMED_TRIALS)))
        print(f"| {name} | {told(taken_s.sum(1))} |", flush=True)


if __name__ == "__main__":
    understood("latency", prints=True)
    main()
