"""Whether a closed loop on waveforms ends in windows as good as one on amplitudes.

    python benchmarks/waveform_loop.py --reference impact > benchmarks/results/waveform_loop_impact.txt
    python benchmarks/waveform_loop.py --reference valve > benchmarks/results/waveform_loop_valve.txt

The same people of the `recruitment` cohort are examined twice by the default strategy, with the same seeds: once by a
device that reports the amplitude itself, and once by the simulated tapping robot, with waveforms. Both are judged by
the same rules. Paired, for both trigger modes. Each session ends when the strategy says so. The robot's hit delay and
its variation are the person's.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import math
import os
import platform
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch

import isiw
from isiw.devices.plant import Geometry
from isiw.devices.tapper import Trigger
from isiw.subjects import SimulatedSubject, cohort

SPACES: dict[str, dict[Trigger, isiw.DesignSpace]] = {
    "impact": {"open-loop": isiw.IMPACT_SPACE, "impact": isiw.DesignSpace(5, 320, reference="impact")},
    # Nobody's hit delay plus the time to detect the hit exceeds 215 ms.
    "valve": {"open-loop": isiw.VALVE_SPACE, "impact": isiw.DesignSpace(215, 500, reference="valve")},
}
LARGEST_DIFFERENCE = 0.03


def examine(
    space: isiw.DesignSpace, seed: int, trials: int, deliver: Callable[[isiw.Stimulus], isiw.Measurement | isiw.Sweep]
) -> tuple[isiw.WindowEstimate, Counter[str]]:
    """One person's session of at most so many stimuli: the estimate, and how many were accepted or why not."""
    strategy = isiw.make_strategy("default", space=space, seed=seed, max_trials=trials)
    outcomes: Counter[str] = Counter()
    for trial in range(trials):
        if strategy.decision().stop:
            break
        stimulus = isiw.Stimulus(trial, strategy.ask())
        answer = deliver(stimulus)
        judge = isiw.signals.judge if isinstance(answer, isiw.Sweep) else isiw.signals.judge_measurement
        judged = judge(answer, stimulus, space)
        if judged.reason is not None:
            outcomes[judged.reason.value] += 1
            strategy.count_mistrial()
        else:
            outcomes["accepted"] += 1
            strategy.tell(judged.isi_ms, judged.mep_mv, isi_sd_ms=judged.isi_sd_ms)
    return strategy.estimate(), outcomes


def by_amplitude(
    subject: SimulatedSubject, space: isiw.DesignSpace, seed: int
) -> Callable[[isiw.Stimulus], isiw.Measurement]:
    """A device that reports the person's amplitudes."""
    person = subject.begin(seed)

    def deliver(stimulus: isiw.Stimulus) -> isiw.Measurement:
        response = person.respond(stimulus.isi_ms, space.reference)
        return isiw.Measurement(response.mep_mv, response.isi_ms, response.isi_sd_ms)

    return deliver


def by_waveform(
    subject: SimulatedSubject, space: isiw.DesignSpace, seed: int, trigger: Trigger
) -> Callable[[isiw.Stimulus], isiw.Sweep]:
    """The tapping robot on the same person; what varies from tap to tap is now the robot's."""
    person = replace(subject, hit_delay_sd_ms=0.0).begin(seed)
    hit_ms, sd_ms = subject.hit_delay_ms, subject.hit_delay_sd_ms
    geometry = Geometry(hit_ms - 55, sd_ms, hit_ms, sd_ms, contact_ms=15, contact_sd_ms=0.5, memg_sd_ms=1.0)
    settings = isiw.TapperSettings(reference=space.reference, trigger=trigger)
    robot = isiw.Tapper(lambda isi_ms: person.respond(isi_ms, "impact"), geometry, settings, seed=seed)
    robot.stage()
    return lambda stimulus: robot.deliver(stimulus, 1.0)


def main() -> None:
    """Run, and print a row for each reference and trigger."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=50)
    parser.add_argument("--reference", choices=("impact", "valve"), required=True)
    parser.add_argument("--trials", type=int, default=80, help="stimuli a person at most, mistrials included")
    parser.add_argument("--seed", type=int, default=10_000, help="0–999 for work, reported figures from 10,000")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    subjects = cohort("recruitment", arguments.people, arguments.seed)
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("isiw", "numpy", "torch"))
    print(f"python {platform.python_version()}, {versions}")
    print(f"recruitment cohort, {arguments.people} people, seed {arguments.seed}, {arguments.trials} stimuli at most")
    print("reference  trigger     F1 amplitudes  F1 waveforms  difference (95 % interval)   stimuli     outcomes")
    for trigger, space in SPACES[arguments.reference].items():
        scores, plain_outcomes, outcomes = [], Counter(), Counter()
        for number, subject in enumerate(subjects):
            seed, truth = arguments.seed + number, subject.window(space)
            plain, plain_reasons = examine(space, seed, arguments.trials, by_amplitude(subject, space, seed))
            waves, reasons = examine(space, seed, arguments.trials, by_waveform(subject, space, seed, trigger))
            scores.append([isiw.metrics.f1(estimate, truth, space) for estimate in (plain, waves)])
            plain_outcomes += plain_reasons
            outcomes += reasons
        amplitudes, waveforms = np.array(scores).T
        difference = waveforms - amplitudes
        half = 1.96 * difference.std(ddof=1) / math.sqrt(len(difference))
        counts = f"{plain_outcomes.total()} and {outcomes.total()}   {dict(outcomes)}"
        kept = "kept" if abs(difference.mean()) <= LARGEST_DIFFERENCE else "MISSED"
        print(f"{space.reference:10} {trigger:11} {amplitudes.mean():13.3f} {waveforms.mean():13.3f} "
              f"{difference.mean():11.3f} ± {half:.3f} {kept:>10}   {counts}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
