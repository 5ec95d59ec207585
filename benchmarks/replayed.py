"""Does a replay of recorded trials say what a session would have said? F1 against the truth, on the same people.

    python -m benchmarks.replayed --people 200 --first 10000

Each person is swept once, 20 trials every 5 ms in a random order, and the default asks for these trials. Beside it the
default examines the person anew, at the same ISIs. The table says by how much mean F1 differs.
"""

from __future__ import annotations

import argparse

import numpy as np

import isiw
from benchmarks.quick import understood
from isiw.existing import Delivered, replay

SPACE = isiw.DesignSpace(0, 320, 5, reference="impact")
TRIALS_PER_ISI = 20
AT = (10, 20, 40)


def swept(person: isiw.subjects.SimulatedSubject, seed: int) -> Delivered:
    """All trials of a person's sweep."""
    responder = person.begin(seed)
    isis_ms = np.random.default_rng(seed).permutation(np.repeat(SPACE.grid_ms, TRIALS_PER_ISI)).tolist()
    trials = []
    for number, isi_ms in enumerate(isis_ms):
        mep_mv = responder.respond(isi_ms, "impact").mep_mv
        trials.append(isiw.Trial(number, "accepted", isi_ms, isi_ms=isi_ms, mep_mv=mep_mv))
    return Delivered(isiw.TrialTable(tuple(trials)), "impact", simulated=True)


def examined(person: isiw.subjects.SimulatedSubject, seed: int, trials: int) -> list[float]:
    """F1 by trial of a session with the person."""
    strategy, responder, truth = (
        isiw.make_strategy(space=SPACE, seed=seed),
        person.begin(seed + 1),
        person.window(SPACE),
    )
    scores = []
    for _ in range(trials):
        asked_ms = strategy.ask()
        strategy.learn(asked_ms, responder.respond(asked_ms, "impact").mep_mv)
        scores.append(isiw.metrics.f1(strategy.estimate(), truth, SPACE))
    return scores


def main() -> None:
    """Print the table."""
    understood("replayed")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=200)
    parser.add_argument("--first", type=int, default=10_000)
    parser.add_argument("--cohort", default="recruitment")
    given = parser.parse_args()
    people = isiw.subjects.cohort(given.cohort, given.people, given.first)
    runs, replays = [], []
    for number, person in enumerate(people):
        seed = given.first + number
        answered = replay(swept(person, seed), space=SPACE, seeds=1, trials=max(AT), first_seed=seed)
        replays.append(answered.f1_by_trial("default", person.window(SPACE))[0])
        runs.append(examined(person, seed, max(AT)))
        if number % 20 == 19 or number + 1 == len(people):
            table(np.array(runs), np.array(replays))


def table(runs: np.ndarray, replays: np.ndarray) -> None:
    """Mean F1 of both, and the difference with its standard error."""
    print(f"{len(runs)} people: stimuli, session, replay, difference ± standard error")
    for n in AT:
        gain = replays[:, n - 1] - runs[:, n - 1]
        error = gain.std(ddof=1) / np.sqrt(len(gain))
        print(
            f"{n:3}  {runs[:, n - 1].mean():.3f}  {replays[:, n - 1].mean():.3f}  {gain.mean():+.3f} ± {error:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
