"""Long sessions: what their late trials cost, how long resuming them takes, and whether they go on identically.

    python -m benchmarks.long_sessions > benchmarks/results/long_sessions.md
    python -m benchmarks.long_sessions --waveforms --strategies random --most 1500

A trial's cost is everything between two trials: model, acquisition function, stopping rule, log, and safeguards. All
times are the processor's, since other programs share the machine. A session is interrupted behind its last trial and
resumed; it goes on identically where it asks what the log says it would ask next, and believes what it believed.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.config.sections import own_wrist
from isiw.strategy.stopping import Budget

SPACE = isiw.DesignSpace(0, 200, reference="valve")
AT = (50, 100, 200, 500, 1000, 1500, 2000)
RESUMED_AT = (200, 2000)
NEAR = 21
"""Of how many trials, each with the trial behind it, the median is taken."""


class Interrupted(Exception):  # noqa: N818 - no error
    """The session has come far enough."""


def run(name: str, trials: int, log: Path, *, waveforms: bool = False) -> np.ndarray:
    """Run a session of so many trials, which is interrupted then; how long each took [ms], but the first.

    Args:
        name: the strategy.
        trials: how many.
        log: where it is logged.
        waveforms: whether the device is the tapping robot, whose sweeps hold four waveforms of a second.
    """
    ended_s: list[float] = []

    def on_trial(update: isiw.SessionUpdate) -> None:
        ended_s.append(time.process_time())
        if update.trial.index == trials - 1:
            raise Interrupted

    limits = isiw.Limits.of_space(SPACE, max_pulses=trials + 1)
    try:
        isiw.Session(
            device(waveforms=waveforms),
            unstopped(name, trials),
            log=log,
            limits=limits,
            safeguards=isiw.Safeguards(on_pause=lambda _: True),
            on_trial=on_trial,
        ).run()
    except Interrupted:
        return 1e3 * np.diff(ended_s)
    raise RuntimeError("the session has ended before its time")


def unstopped(name: str, trials: int) -> isiw.Strategy:
    """A strategy that only its budget stops, which is one trial more than are run.

    Args:
        name: the strategy.
        trials: how many are run.
    """
    usual = isiw.make_strategy(name, SPACE)
    return isiw.Strategy(SPACE, usual.model, usual.acquisition, Budget(trials + 1), seed=3)


def device(*, waveforms: bool = False) -> isiw.SimulatedDevice:
    """A simulated person's device, which reports amplitudes, or records waveforms."""
    subject = isiw.subjects.cohort("recruitment", 1, 7)[0]
    if waveforms:
        person = replace(subject, hit_delay_sd_ms=0.0).begin(7)
        settings = isiw.TapperSettings(reference="valve", trigger="open-loop")
        wrist = own_wrist(subject)
        return isiw.SimulatedDevice(
            isiw.Tapper(lambda isi_ms: person.respond(isi_ms, "impact"), wrist, settings, seed=7)
        )
    person = subject.begin(7)
    return isiw.SimulatedDevice(isiw.SimulatedPerson(lambda isi_ms: person.respond(isi_ms, "valve"), "valve"))


def resuming_s(log: Path, strategy: isiw.Strategy, *, waveforms: bool = False) -> tuple[float, bool]:
    """How long resuming a session takes [s], and whether it is identical to the one that was interrupted."""
    last = isiw.read_session(log).estimates[-1]
    begin_s = time.process_time()
    strategy = isiw.resume(log, device(waveforms=waveforms), strategy).strategy
    spent_s = time.process_time() - begin_s
    now = strategy.estimate()
    again = now.probability, now.start_ms, now.end_ms, now.expected_f1, strategy.ask()
    return spent_s, again == (last.probability, last.start_ms, last.end_ms, last.expected_f1, last.next_isi_ms)


def main() -> None:
    """Measure and print two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strategies", nargs="+", default=["random", "default"])
    parser.add_argument("--most", type=int, default=max(AT), help="trials of the longest session")
    parser.add_argument("--waveforms", action="store_true", help="the tapping robot, instead of amplitudes")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    costs, resumptions = [], []
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.strategies:
            for trials in sorted({min(each, arguments.most) for each in RESUMED_AT}):
                log = Path(folder) / f"{name}-{trials}.mcap"
                cost_ms = run(name, trials, log, waveforms=arguments.waveforms)
                spent_s, identical = resuming_s(log, unstopped(name, trials), waveforms=arguments.waveforms)
                resumptions.append(f"| {name} | {trials:,} | {spent_s:.1f} | {'yes' if identical else 'NO'} |")
            near = [cost_ms[max(0, at - NEAR) : at] for at in AT if at <= arguments.most]
            costs.append(f"| {name} | {' | '.join(f'{np.median(part):.0f} ({part.mean():.0f})' for part in near)} |")
    print(f"- command: `{command_of('long_sessions')}`")
    print(f"- {made_with('torch')}, one thread")
    print("- seeds: 3 (strategy), 7 (person)\n")
    reached = [at for at in AT if at <= arguments.most]
    print(f"What a trial costs at trial … [ms of the processor]: median (mean) of the last {NEAR}\n")
    print(f"| strategy | {' | '.join(f'{at:,}' for at in reached)} |\n|{'---|' * (len(reached) + 1)}")
    print("\n".join(costs))
    print("\nResuming\n\n| strategy | trials | takes [s of the processor] | identical |\n|---|---|---|---|")
    print("\n".join(resumptions))


if __name__ == "__main__":
    understood("long_sessions", prints=True)
    main()
