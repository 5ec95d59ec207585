"""Whether a closed loop on waveforms ends in windows as good as one on amplitudes.

    python -m benchmarks.waveform_loop --reference impact > benchmarks/results/waveform_loop_impact.txt
    python -m benchmarks.waveform_loop --reference valve > benchmarks/results/waveform_loop_valve.txt

The same people of the `recruitment` cohort are examined twice by the default strategy, with the same seeds: once by a
device that reports the amplitude itself, and once in a session on the simulated tapping robot, with waveforms, which
learns what the tap itself does to the EMG. Paired, for both trigger modes. Each session ends when the strategy says so.
The robot's hit delay and its variation are the person's, and so is the EMG at rest. Every person has several sessions,
which differ in trial noise; their mean is one value of that person, so that the interval is about people.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import pandas as pd
import torch
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.provenance import made_with
from benchmarks.quick import understood
from isiw import schedule
from isiw.config.sections import own_wrist
from isiw.devices.robot.tapper import Trigger
from isiw.subjects.cohorts import cohort
from isiw.subjects.subject import SimulatedSubject

Deliver = Callable[[isiw.Stimulus], isiw.Measurement]

SPACES: dict[str, dict[Trigger, isiw.DesignSpace]] = {
    "impact": {"open-loop": isiw.IMPACT_SPACE, "impact": isiw.DesignSpace(5, 320, reference="impact")},
    # Nobody's hit delay plus the time to detect the hit exceeds 215 ms.
    "valve": {"open-loop": isiw.VALVE_SPACE, "impact": isiw.DesignSpace(215, 500, reference="valve")},
}
LARGEST_DIFFERENCE = 0.03


@dataclass(frozen=True)
class Pair:
    """One session with a person, to be run both ways.

    Args:
        reference: the event that ISIs count from.
        trigger: what triggers the robot's pulse.
        seed: of the cohort.
        person: which person of it, from 0.
        session_seed: of strategy and trial noise.
        trials: stimuli at most, mistrials included.
    """

    reference: str
    trigger: Trigger
    seed: int
    person: int
    session_seed: int
    trials: int


@dataclass(frozen=True)
class Examined:
    """What a session came to: F1 of its window, whether it ended without one, and its stimuli by outcome."""

    f1: float
    no_window: bool
    outcomes: Counter[str]


def run(pair: Pair) -> tuple[Examined, Examined]:
    """Both sessions of a pair: on amplitudes, and on waveforms."""
    torch.set_num_threads(1)
    subject = cohort("recruitment", pair.person + 1, pair.seed)[pair.person]
    space = SPACES[pair.reference][pair.trigger]
    strategies = [
        isiw.make_strategy("default", space=space, seed=pair.session_seed, max_trials=pair.trials) for _ in range(2)
    ]
    plain = examine(strategies[0], by_amplitude(subject, space, pair))
    waves = session_of(robot(subject, pair), strategies[1])
    outcomes = Counter("accepted" if each.reason is None else each.reason.value for each in waves.trials)
    truth = subject.window(space)
    return (
        Examined(
            isiw.metrics.f1(strategies[0].estimate(), truth, space), strategies[0].estimate().window is None, plain
        ),
        Examined(isiw.metrics.f1(waves.estimate, truth, space), waves.estimate.window is None, outcomes),
    )


def examine(strategy: isiw.Strategy, deliver: Deliver) -> Counter[str]:
    """The outcomes of a loop on amplitudes, until the strategy stops."""
    outcomes: Counter[str] = Counter()
    while not strategy.decision().stop:
        stimulus = isiw.Stimulus(outcomes.total(), strategy.ask())
        judged = isiw.signals.judge_measurement(deliver(stimulus), stimulus, strategy.space)
        if judged.reason is not None:
            outcomes[judged.reason.value] += 1
            strategy.count_mistrial()
        else:
            outcomes["accepted"] += 1
            strategy.tell(judged.isi_ms, judged.mep_mv, isi_sd_ms=judged.isi_sd_ms)
    return outcomes


def session_of(device: isiw.Device, strategy: isiw.Strategy) -> isiw.SessionResult:
    """A session whose pauses are answered with going on, and whose plan fits its limits."""
    protocol = isiw.VisitProtocol()
    pulses = max(schedule.stimuli_for(protocol, strategy.stimuli_planned or 0), 200)
    with tempfile.TemporaryDirectory() as folder:
        return isiw.Session(
            device,
            strategy,
            log=Path(folder) / "one.mcap",
            limits=isiw.Limits.of_space(strategy.space, min_iti_s=0.0, max_pulses=pulses),
            protocol=protocol,
            safeguards=isiw.Safeguards(on_pause=lambda _: True),
        ).run(progress=False)


def by_amplitude(subject: SimulatedSubject, space: isiw.DesignSpace, pair: Pair) -> Deliver:
    """A device that reports the person's amplitudes."""
    # Triggered by the impact, an ISI that counts from there does not vary with the hit, here as on the robot.
    steady = space.reference == "impact" == pair.trigger
    person = (replace(subject, hit_delay_sd_ms=0.0) if steady else subject).begin(pair.session_seed)

    def deliver(stimulus: isiw.Stimulus) -> isiw.Measurement:
        response = person.respond(stimulus.isi_ms, space.reference)
        return isiw.Measurement(response.mep_mv, response.isi_ms, response.isi_sd_ms)

    return deliver


def robot(subject: SimulatedSubject, pair: Pair) -> isiw.Device:
    """The tapping robot on the same person; what varies from tap to tap is now the robot's."""
    person = replace(subject, hit_delay_sd_ms=0.0).begin(pair.session_seed)
    settings = isiw.TapperSettings(reference=pair.reference, trigger=pair.trigger)
    return isiw.SimulatedDevice(
        isiw.Tapper(
            lambda isi_ms: person.respond(isi_ms, "impact"), own_wrist(subject), settings, seed=pair.session_seed
        )
    )


def results(pairs: list[Pair], workers: int) -> Iterator[tuple[Pair, tuple[Examined, Examined]]]:
    """The outcome of each pair, as it comes."""
    if workers == 1:
        yield from ((pair, run(pair)) for pair in pairs)
        return
    # Forked children would inherit torch's thread pool in an undefined state.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(run, pair): pair for pair in pairs}
        for future in as_completed(running):
            yield running[future], future.result()


def row(reference: str, trigger: Trigger, done: list[tuple[Pair, tuple[Examined, Examined]]]) -> str:
    """The table's row for one reference and trigger."""
    scores = pd.DataFrame([(pair.person, plain.f1, waves.f1) for pair, (plain, waves) in done])
    of_people = scores.groupby(0).mean()
    difference = of_people[2] - of_people[1]
    half = 1.96 * difference.std() / math.sqrt(len(difference))
    kept = "kept" if abs(difference.mean()) <= LARGEST_DIFFERENCE else "MISSED"
    arms = list(zip(*(both for _, both in done), strict=True))
    counts = [sum((one.outcomes for one in arm), Counter()) for arm in arms]
    absent = " and ".join(str(sum(one.no_window for one in arm)) for arm in arms)
    stimuli = " and ".join(str(count.total()) for count in counts)
    return (
        f"{reference:10} {trigger:11} {of_people[1].mean():13.3f} {of_people[2].mean():13.3f} "
        f"{difference.mean():11.3f} ± {half:.3f} {kept:>10}   {absent:9}   {stimuli}   {dict(counts[1])}"
    )


def main() -> None:
    """Run, and print a row for each trigger."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=50)
    parser.add_argument("--sessions", type=int, default=4, help="sessions with each of them, each with its trial noise")
    parser.add_argument("--reference", choices=("impact", "valve"), required=True)
    parser.add_argument("--trials", type=int, default=80, help="stimuli a session at most, mistrials included")
    parser.add_argument("--seed", type=int, default=10_000, help="0–999 for work, reported figures from 10,000")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    chosen = parser.parse_args()
    print(made_with("numpy", "torch"))
    print(f"recruitment cohort, {chosen.people} people, {chosen.sessions} sessions each, seed {chosen.seed}, "
          f"{chosen.trials} stimuli at most")  # fmt: skip
    print(
        "reference  trigger     F1 amplitudes  F1 waveforms  difference (95 % interval)   no window   stimuli, outcomes"
    )
    for trigger in SPACES[chosen.reference]:
        numbers = [
            (person, chosen.people * k + person) for k in range(chosen.sessions) for person in range(chosen.people)
        ]
        pairs = [
            Pair(chosen.reference, trigger, chosen.seed, person, chosen.seed + number, chosen.trials)
            for person, number in numbers
        ]
        progress = track(results(pairs, chosen.workers), trigger, len(pairs), console=Console(stderr=True))
        print(row(chosen.reference, trigger, list(progress)), flush=True)


if __name__ == "__main__":
    understood("waveform_loop", prints=True)
    main()
