"""Does a replay of recorded trials say what a session would have said? F1 against the truth, on the same people.

    python -m benchmarks.replayed --people 200 --first 20000 --sessions 2

Each person is swept, 20 trials every 5 ms in a random order, and the default asks for these trials. Beside it the
default examines the person, at the same ISIs. Each is done several times with other noise, so that chance hides less.
The table says by how much mean F1 differs.
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
APART = 1_000_000
"""Between the seeds of one session with a person and the next."""


def swept(person: isiw.subjects.SimulatedSubject, seed: int) -> Delivered:
    """All trials of a person's sweep, each with the ISI that it came to."""
    responder = person.begin(seed)
    isis_ms = np.random.default_rng([seed, 1]).permutation(np.repeat(SPACE.grid_ms, TRIALS_PER_ISI)).tolist()
    trials = []
    for number, isi_ms in enumerate(isis_ms):
        answer = responder.respond(isi_ms, "impact")
        trials.append(isiw.Trial(number, "accepted", isi_ms, isi_ms=answer.isi_ms, mep_mv=answer.mep_mv))
    return Delivered(isiw.TrialTable(tuple(trials)), "impact", simulated=True)


def replayed(person: isiw.subjects.SimulatedSubject, seed: int) -> list[float]:
    """F1 of a replay of the person's sweep, after each number of stimuli in `AT`."""
    answered = replay(swept(person, seed), space=SPACE, seeds=1, trials=max(AT), first_seed=seed)
    scores = answered.f1_by_trial("default", person.window(SPACE))[0]
    return [scores[n - 1] for n in AT]


def examined(person: isiw.subjects.SimulatedSubject, seed: int) -> list[float]:
    """F1 of a session with the person, after each number of stimuli in `AT`."""
    strategy, responder, truth = isiw.make_strategy(space=SPACE, seed=seed), person.begin(seed), person.window(SPACE)
    scores = []
    for number in range(1, max(AT) + 1):
        asked_ms = strategy.ask()
        answer = responder.respond(asked_ms, "impact")
        while not SPACE.admits(answer.isi_ms):  # a mistrial, of which a replay has none either
            answer = responder.respond(asked_ms, "impact")
        strategy.learn(answer.isi_ms, answer.mep_mv)
        if number in AT:
            scores.append(isiw.metrics.f1(strategy.estimate(), truth, SPACE))
    return scores


def main() -> None:
    """Print the table."""
    understood("replayed", prints=True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=200)
    parser.add_argument("--first", type=int, default=20_000)
    parser.add_argument("--sessions", type=int, default=2, help="with each person")
    parser.add_argument("--cohort", default="recruitment")
    given = parser.parse_args()
    people = isiw.subjects.cohort(given.cohort, given.people, given.first)
    runs, replays = [], []
    for number, person in enumerate(people):
        seeds = [given.first + number + APART * session for session in range(given.sessions)]
        replays.append(np.mean([replayed(person, seed) for seed in seeds], axis=0))
        runs.append(np.mean([examined(person, seed + APART // 2) for seed in seeds], axis=0))
        if number % 20 == 19 or number + 1 == len(people):
            table(np.array(runs), np.array(replays))


def table(runs: np.ndarray, replays: np.ndarray) -> None:
    """Mean F1 of both, and the difference with its standard error."""
    print(f"{len(runs)} people: stimuli, session, replay, difference ± standard error")
    for at, session, answered in zip(AT, runs.T, replays.T, strict=True):
        gain = answered - session
        error = gain.std(ddof=1) / np.sqrt(len(gain))
        means = f"{session.mean():.3f}  {answered.mean():.3f}  {gain.mean():+.3f} ± {error:.3f}"
        print(f"{at:3}  {means}", flush=True)


if __name__ == "__main__":
    main()
