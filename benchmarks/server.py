"""The server: what HTTP adds to ask and tell, and what malformed requests, kills and unforeseen calls do to it.

    python -m benchmarks.server > benchmarks/results/server.md

Each part has a server in a process of its own, over a real socket; `--parts` chooses some. Needs the test extra.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.server_clients import shared
from benchmarks.server_strangers import operated_meanwhile, served_meanwhile
from benchmarks.server_tries import Served, fuzzed, killed, tried

SPACE: dict[str, Any] = {"low_ms": 0, "high_ms": 320, "reference": "impact"}
LIMITS: dict[str, Any] = {"min_iti_s": 0.0, "max_pulses": 600}  # as many as pf plans


def mep_mv(isi_ms: float, number: int) -> float:
    """An MEP by a formula, a little different in each trial."""
    return 0.02 + 0.3 * float(np.exp(-(((isi_ms - 90) / 25) ** 2))) + 1e-4 * (number % 7)


class InProcess:
    """A session of this process."""

    def __init__(self, session: isiw.Recorder) -> None:
        self.session = session

    def ask(self, number: int) -> float:
        """The next ISI [ms]."""
        del number
        return self.session.ask()

    def tell(self, number: int, isi_ms: float) -> None:
        """What came of it."""
        self.session.tell(isi_ms, mep_mv(isi_ms, number))


class ByHttp:
    """A session of a server; as MATLAB does, with a connection for each call, or with one for all."""

    def __init__(self, served: Served, session: str, strategy: str, *, kept: bool) -> None:
        self.session, self.kept, self.client = f"/sessions/{session}", kept, served.client()
        self.served = served
        plan = {"space": SPACE, "seed": 1, "limits": LIMITS, "strategy": {"name": strategy}}
        self.client.post("/sessions", json={"id": session, **plan}).raise_for_status()

    def post(self, verb: str, body: dict[str, float]) -> dict[str, float]:
        """One call."""
        if self.kept:
            answer = self.client.post(f"{self.session}/{verb}", json=body)
        else:
            with self.served.client() as client:
                answer = client.post(f"{self.session}/{verb}", json=body)
        answered: dict[str, float] = answer.raise_for_status().json()
        return answered

    def ask(self, number: int) -> float:
        """The next ISI [ms]."""
        return self.post("ask", {"trial": number})["isi_ms"]

    def tell(self, number: int, isi_ms: float) -> None:
        """What came of it."""
        self.post("tell", {"trial": number, "isi_ms": isi_ms, "mep_mv": mep_mv(isi_ms, number)})


WAYS = ("in process", "HTTP, one connection", "HTTP, a connection for each call")


def latency(folder: Path, trials: int) -> None:
    """The same session three times, trial by trial in turn; with the default, and with a strategy that costs little."""
    print(
        "## What HTTP adds\n\nThe same session three times, trial by trial in turn, each way being the first as often"
    )
    print(
        f"as the others; {trials} trials, for which all asked the same ISIs. Medians; what HTTP adds is the median of"
    )
    print("the differences between a trial and the same one in process.\n")
    print("| strategy | | ask [ms] | tell [ms] | added to ask [ms] | added to tell [ms] |\n|---|---|---|---|---|---|")
    with Served(folder) as served:
        for name in ("default", "pf"):
            spent_ms = _spent_ms(served, folder, name, trials)
            for way, parts in zip(WAYS, spent_ms, strict=True):
                figures = [*np.median(parts, axis=0), *np.median(parts - spent_ms[0], axis=0)]
                print(f"| {name} | {way} | {' | '.join(f'{figure:.1f}' for figure in figures)} |")
    print()


def _spent_ms(served: Served, folder: Path, name: str, trials: int) -> np.ndarray:
    """How long ask and tell of each trial took, by way; shape (3, trials, 2)."""
    space = isiw.DesignSpace(**SPACE)
    strategy, limits = isiw.make_strategy(name, space, seed=1), isiw.Limits.of_space(space, **LIMITS)
    spent_ms = np.zeros((len(WAYS), trials, 2))
    with isiw.open_session(strategy, folder / f"{name}.mcap", limits=limits) as own:
        ways = (
            InProcess(own),
            ByHttp(served, f"{name}-kept", name, kept=True),
            ByHttp(served, f"{name}-fresh", name, kept=False),
        )
        for number in range(trials):
            asked = set()
            for turn in range(len(ways)):
                place = (number + turn) % len(ways)
                begun_s = time.perf_counter()
                isi_ms = ways[place].ask(number)
                asked_s = time.perf_counter()
                ways[place].tell(number, isi_ms)
                spent_ms[place, number] = 1e3 * (asked_s - begun_s), 1e3 * (time.perf_counter() - asked_s)
                asked.add(isi_ms)
            if len(asked) > 1:
                sys.exit(f"trial {number}: HTTP asks something else: {asked}")
    return spent_ms


def fuzz(folder: Path, requests: int) -> None:
    """Malformed requests, while a session is open that must stay as it is."""
    with Served(folder) as served:
        before, after, answers = fuzzed(served, requests, random.Random(0))  # noqa: S311 - no secret
    print(
        f"## Malformed requests\n\n{requests} requests, seed 0: bytes that are no HTTP, wrong bodies, names, numbers,"
    )
    print("methods and tokens. The open session's log and state stayed as they were.")
    print("Those with status 200 ask for the list of sessions, and have a body that is not looked at.\n")
    print(f"- answers: {', '.join(f'{count} × {status}' for status, count in sorted(answers.items()))}")
    print(f"- resident memory: {before:.0f} MB after the first tenth, {after:.0f} MB at the end\n")


def kills(folder: Path, number: int) -> None:
    """A server that is killed again and again, and a client that repeats what is not answered."""
    print(f"## Killed {number} times\n\n{killed(folder, number, random.Random(0))}\n")  # noqa: S311 - no secret


def description(folder: Path, examples: int) -> None:
    """Calls made from the description, valid and invalid ones."""
    with Served(folder) as served:
        answers, wrong = tried(served.url, served.headers, examples)
    print(f"## Calls made from the description\n\nschemathesis, {examples} valid and {examples} invalid of each call:")
    print(f"{sum(answers.values())} answers, of which {len(wrong)} not as described or a failure of the server.\n")
    print(f"- answers: {', '.join(f'{count} × {status}' for status, count in sorted(answers.items()))}")
    for words in wrong[:10]:
        print(f"- wrong: {words}")
    print()


def outsiders(folder: Path, tries: int) -> None:
    """Connections without the token, and how soon whoever has it is answered."""
    served_s = served_meanwhile(folder, MOST_STRANGERS, tries)
    operated_s, reason = operated_meanwhile(folder, MOST_STRANGERS, tries // 10)
    print(
        f"## {MOST_STRANGERS} connections without the token\n\nA third say nothing, a third never finish their headers,"
    )
    print("a third send a byte of them every half second; whoever is hung up on is back after a second. The server may")
    print(
        "have 1,024 files open. Each request of the client with the token has a connection of its own. The load average"
    )
    print(f"was {os.getloadavg()[1]:.0f}: other programs were busy, too.\n")
    print("| | tries | answered within 1 s | median [ms] | slowest [ms] |\n|---|---|---|---|---|")
    for name, spent_s in (
        ("`isiw serve`, list of sessions", served_s),
        ("live page, Pause", operated_s[:-1]),
        ("live page, Stop", operated_s[-1:]),
    ):
        in_time, spent_ms = sum(each <= 1.0 for each in spent_s), 1e3 * np.array(spent_s)
        print(f"| {name} | {len(spent_s)} | {in_time} | {np.median(spent_ms):.0f} | {spent_ms.max():.0f} |")
    print(f"\nThe session's reason to end: {reason}\n")


def clients(folder: Path, rounds: int) -> None:
    """Several clients of one session at a time."""
    print(f"## Several clients of one session\n\n{shared(folder, rounds)}\n")


MOST_STRANGERS = 1000

PARTS: dict[str, tuple[Callable[[Path, int], None], int]] = {
    "latency": (latency, 40),
    "fuzz": (fuzz, 10_000),
    "kills": (kills, 100),
    "description": (description, 100),
    "outsiders": (outsiders, 200),
    "clients": (clients, 200),
}


def main() -> None:
    """Run the parts and print what came of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--number", type=int, default=None, help="of trials, requests, kills or examples")
    arguments = parser.parse_args()
    print("# The server\n")
    print(f"- command: `{command_of('server')}`")
    versions = made_with("fastapi", "uvicorn")
    print(f"- {versions}, one thread, {os.cpu_count()} cores that other programs shared\n")
    for name in arguments.parts:
        part, usual = PARTS[name]
        with tempfile.TemporaryDirectory() as folder:
            part(Path(folder), arguments.number or usual)
        sys.stdout.flush()


if __name__ == "__main__":
    understood("server", prints=True)
    main()
