"""Several clients of one session, which repeat, hang up, end and take over, of a server that is killed."""

from __future__ import annotations

import itertools
import os
import random
import signal
import sys
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import httpx

import isiw
from benchmarks.server_tries import Served

MIN_ITI_S: Final = 0.05
TRIALS: Final = 8
MOST_S: Final = 20.0
"""A round that takes longer has hung."""

PLAN: Final[dict[str, Any]] = {
    "space": {"low_ms": 0, "high_ms": 200, "reference": "impact"},
    "limits": {"min_iti_s": MIN_ITI_S, "max_pulses": 1000},
    "strategy": {"name": "nr"},
}
KINDS: Final = ("keys", "keys", "no keys", "one key")
"""Who states a key in a round: everybody, nobody, or whoever begins it alone."""


class Round:
    """One session, and what its clients did."""

    def __init__(self, served: Served, number: int) -> None:
        self.served, self.name, self.kind = served, f"r{number}", KINDS[number % len(KINDS)]
        self.chance = random.Random(number)  # noqa: S311 - no secret
        self.clients, self.killed = self.chance.randint(2, 6), number % 3 == 0
        self.delivered: dict[int, list[float]] = {}
        self.did = Counter[str]()
        self._lock, self._keys = threading.Lock(), itertools.count()
        self.end_s = time.monotonic() + MOST_S

    def run(self) -> None:
        """Run all clients until the session has its trials."""
        first = self.new_key() if self.kind != "no keys" else None
        self.post("", {"id": self.name, **PLAN} | ({} if first is None else {"client": first}))
        keys = [first, *(self.new_key() if self.kind == "keys" else None for _ in range(self.clients - 1))]
        loops = [_Client(self, key, random.Random(self.chance.random())) for key in keys]  # noqa: S311 - no secret
        threads = [threading.Thread(target=loop.run) for loop in loops]
        for thread in threads:
            thread.start()
        if self.killed:
            time.sleep(self.chance.uniform(0.0, 0.4))
            os.kill(self.served.child, signal.SIGKILL)
            self.served.next_child()
            self.served.kills += 1
        for thread in threads:
            thread.join()
        if time.monotonic() > self.end_s:
            sys.exit(f"{self.name}: not over after {MOST_S:.0f} s")
        self.post(f"/{self.name}/close", {})

    def new_key(self) -> str:
        """A key that no other client has."""
        return f"k{next(self._keys)}"

    def post(self, path: str, body: dict[str, Any]) -> dict[str, Any]:
        """Send until it is answered."""
        while True:
            try:
                with self.served.client() as client:
                    answer: dict[str, Any] = client.post(f"/sessions{path}", json=body).json()
                    return answer
            except httpx.HTTPError:
                if time.monotonic() > self.end_s:
                    sys.exit(f"{self.name}: {path} is not answered")
                time.sleep(0.02)

    def deliver(self, trial: int) -> None:
        """A client delivers a trial."""
        with self._lock:
            self.delivered.setdefault(trial, []).append(time.time())

    def count(self, what: str) -> None:
        """Something happened."""
        with self._lock:
            self.did[what] += 1

    def checked(self, folder: Path) -> float:
        """Compare what was delivered with the log; the shortest interval between two ISIs that were given out [s]."""
        record = isiw.read_session(folder / f"{self.name}.mcap")
        twice = [trial for trial, times_s in self.delivered.items() if len(times_s) > 1]
        missing = self.delivered.keys() - {trial.index for trial in record.table}
        given_ns = sorted(onset.at_ns for onset in record.onsets.values())
        shortest_s = min((after - before for before, after in itertools.pairwise(given_ns)), default=10**9) / 1e9
        if twice or missing or shortest_s < MIN_ITI_S - 0.001 or record.losses or not record.finished:
            sys.exit(f"{self.name} ({self.kind}): twice {twice}, missing {missing}, shortest interval {shortest_s} s")
        self.did["trials"] += len(record.table)
        self.did["delivered"] += len(self.delivered)
        return shortest_s


class _Client:
    """A loop that asks, delivers and tells, and does not always do it well."""

    def __init__(self, whole: Round, key: str | None, chance: random.Random) -> None:
        self.round, self.key, self.chance = whole, key, chance
        self.mine: set[int] = set()  # trials that it has delivered

    def run(self) -> None:
        refused = 0
        while time.monotonic() < self.round.end_s:
            trial = self._next()
            if trial >= TRIALS:
                return
            answer = self._asked(trial)
            if answer is None:
                continue
            if answer["ok"]:
                refused = 0
                self._given(answer)
                continue
            kind = answer["error"]["type"]
            self.round.count(kind)
            refused += 1
            if kind == "NotOpen":
                self._resume(takeover=False)
            elif refused > self.chance.randint(5, 30):  # the one that was given the trial seems to have ended
                refused = 0
                self._end_trial(kind, trial)
            time.sleep(self.chance.uniform(0, 0.03))

    def _own(self) -> dict[str, str]:
        return {} if self.key is None else {"client": self.key}

    def _next(self) -> int:
        """The trial that comes next, open or not."""
        while time.monotonic() < self.round.end_s:
            with suppress(httpx.HTTPError), self.round.served.client() as client:
                answer = client.get(f"/sessions/{self.round.name}").json()
                if answer["ok"]:
                    return int(answer["trials"])
            time.sleep(0.02)
        return TRIALS

    def _asked(self, trial: int) -> dict[str, Any] | None:
        """The answer to an ask; None if it hung up before."""
        hurried = self.chance.random() < 0.3
        try:
            with self.round.served.client() as client:
                path, body = f"/sessions/{self.round.name}/ask", {"trial": trial, **self._own()}
                if self.chance.random() < 0.2:  # an answer that is lost
                    client.post(path, json=body)
                    self.round.count("repeated")
                timeout_s = self.chance.uniform(0.001, 0.06) if hurried else 10.0
                answer: dict[str, Any] = client.post(path, json=body, timeout=timeout_s).json()
                return answer
        except httpx.HTTPError:
            self.round.count("hung up")
            return None

    def _given(self, answer: dict[str, Any]) -> None:
        trial = answer["trial"]
        if trial in self.mine:
            return
        if self.chance.random() < 0.1:  # it ends before it delivers, or after
            self._restart(trial if self.chance.random() < 0.5 else None)
            return
        self.mine.add(trial)
        self.round.deliver(trial)
        time.sleep(self.chance.uniform(0, 0.02))
        told = {"trial": trial, "isi_ms": answer["isi_ms"], "mep_mv": 0.1 + trial / 1e3, **self._own()}
        answer = self.round.post(f"/{self.round.name}/tell", told)
        self.round.count("told" if answer["ok"] else answer["error"]["type"])

    def _restart(self, trial: int | None) -> None:
        """End, with or without having delivered, and begin again as another client."""
        self.round.count("ended")
        if trial is not None:
            self.round.deliver(trial)
        self.mine = set()
        if self.key is not None:
            self.key = self.round.new_key()
            self._resume(takeover=True)

    def _resume(self, *, takeover: bool) -> None:
        answer = self.round.post(f"/{self.round.name}/resume", {**self._own(), "takeover": takeover})
        self.round.count("resumed" if answer["ok"] else f"not resumed: {answer['error']['type']}")

    def _end_trial(self, kind: str, trial: int) -> None:
        if kind == "OtherClient" and self.round.kind == "keys":
            self._resume(takeover=True)
        elif kind in {"TrialOpen", "OtherClient", "NotOpen"}:  # a person makes it a mistrial
            self.round.post(f"/{self.round.name}/mistrial", {"trial": trial})
            if self.round.kind == "one key" and kind == "OtherClient":
                self._resume(takeover=True)


def shared(folder: Path, rounds: int) -> str:
    """Run so many rounds; what came of them, in words.

    Args:
        folder: where the logs are.
        rounds: how many sessions.
    """
    did, shortest_s = Counter[str](), MOST_S
    with Served(folder) as served:
        for number in range(rounds):
            one = Round(served, number)
            one.run()
            shortest_s = min(shortest_s, one.checked(folder))
            did += one.did + Counter(clients=one.clients)
        kills = served.kills
    events = ", ".join(f"{count} × {what}" for what, count in sorted(did.items()) if what not in _OF_ALL)
    return (
        f"{rounds} sessions of {TRIALS} trials or more, seeds 0 to {rounds - 1}, {did['clients']} clients in all, two "
        "to six each: in half of the sessions each has a key, in a quarter none, and in a quarter one alone. Clients "
        "repeat asks, hang up, end, take over, and make trials of others mistrials; the server was killed "
        f"{kills} times. Of {did['trials']} trials in the logs {did['delivered']} were delivered, each once; none that "
        "was delivered is missing. The shortest interval between two ISIs that the server gave out is "
        f"{shortest_s:.4f} s, where {MIN_ITI_S:g} s are the limit.\n\n"
        f"What the clients did and were answered: {events}."
    )


_OF_ALL: Final = {"trials", "delivered", "clients"}
