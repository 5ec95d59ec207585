"""Sessions with raw sweeps: reflexes evoked by the tap, right rigs that must not be accused, and amplitudes by ISI.

    OMP_NUM_THREADS=1 python -m benchmarks.raw_sweeps reflex --people 100 --minutes 20 --out benchmarks/results
    OMP_NUM_THREADS=1 python -m benchmarks.raw_sweeps flat --people 100 --minutes 20 --out benchmarks/results
    OMP_NUM_THREADS=1 python -m benchmarks.raw_sweeps plain --people 100 --minutes 10 --out benchmarks/results
    OMP_NUM_THREADS=1 python -m benchmarks.raw_sweeps rigs --people 400 --out benchmarks/results
    OMP_NUM_THREADS=1 python -m benchmarks.raw_sweeps sizes --out benchmarks/results
    OMP_NUM_THREADS=1 python -m benchmarks.raw_sweeps random --people 20000 --out benchmarks/results

`reflex`: people with a window, with reflexes of three sizes at two times after the hit, without a tap alone and with
six. `flat`: people without a window, with the same reflexes. `plain`: people without a reflex, in a session and in a
loop that tells amplitudes as they are judged. `rigs`: sessions of rigs that are right. `sizes`: MEPs of .15 mV at ISIs
of 0 to 60 ms. `random`: sweeps of any rate, length and offset. With `--minutes` a run has as many people as there is
time for.
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.signals.tap import TapResponses
from isiw.signals.watch import Watch
from isiw.subjects import SimulatedSubject, TapResponse, cohort
from isiw.types import FloatArray

SPACE: Final = isiw.DesignSpace(0, 320, reference="impact")
TRIALS: Final = 40
Reflex: TypeAlias = tuple[float, float, float, int]
"""Median size [mV], 0 for none; start and duration [ms]; and how many taps alone follow on the first four trials."""

ORACLE_TAPS: Final = 100
"""So many taps alone before the fifth pair leave nothing to learn of the response's mean and spread."""

_CASES: Final = tuple(itertools.product((0.05, 0.1, 0.3), ((20.0, 25.0), (50.0, 50.0)), (0, 6)))
REFLEXES: Final[tuple[Reflex, ...]] = tuple((size_mv, *when, taps) for size_mv, when, taps in _CASES)
NO_REFLEX: Final[tuple[Reflex, ...]] = ((0.0, 0.0, 0.0, 0), (0.0, 0.0, 0.0, 6))
ORACLES: Final[tuple[Reflex, ...]] = ((0.3, 20.0, 25.0, ORACLE_TAPS), (0.3, 50.0, 50.0, ORACLE_TAPS))
SURE: Final = 0.9


def tap_of(case: Reflex) -> TapResponse | None:
    """What the tap alone evokes."""
    size_mv, start_ms, lasts_ms, _ = case
    return TapResponse(start_ms, lasts_ms, size_mv, 0.5) if size_mv else None


MUSCLES: Final = {"forearm": (17.5, 8.0), "hand": (23.0, 12.0)}
"""When an MEP begins after the pulse, and how long it lasts [ms]."""


class Rig:
    """Records the EMG of a person from 500 ms before the pulse until 200 ms after it."""

    def __init__(
        self,
        mep_mv: Callable[[float | None], float],
        tap: TapResponse | None = None,
        seed: int = 0,
        *,
        rate_hz: float = 5000.0,
        muscle: str = "forearm",
        tap_alone: bool = True,
    ) -> None:
        self.mep_mv, self.tap, self.seed, self.rate_hz = mep_mv, tap, seed, rate_hz
        self.muscle, self.tap_alone = muscle, tap_alone

    def describe(self) -> isiw.DeviceInfo:
        """What the rig is."""
        return isiw.DeviceInfo("own", "impact", channels={"emg": "mV"}, simulated=True, tap_alone=self.tap_alone)

    def stage(self) -> None:
        """Nothing is to be armed."""

    stop = unstage = stage

    def deliver(self, stimulus: isiw.Stimulus, timeout_s: float = 1.0) -> isiw.Sweep:  # noqa: ARG002 - answers at once
        """A sweep of a pair, of a pulse alone, or of a tap alone."""
        rng = np.random.default_rng([self.seed, stimulus.trial])
        times_ms, alone = np.arange(-500.0, 200.0, 1000 / self.rate_hz), stimulus.tap_alone
        isi_ms = 150.0 if alone else stimulus.isi_ms
        emg = 0.002 * rng.standard_normal(times_ms.size)
        if not alone:
            first_ms, lasts_ms = MUSCLES[self.muscle]
            phase = (times_ms - first_ms) / lasts_ms
            emg += self.mep_mv(isi_ms) / 2 * np.where((phase > 0) & (phase < 1), np.sin(2 * np.pi * phase), 0)
            emg += 0.3 * (np.abs(times_ms) < 0.3)
        if self.tap is not None and isi_ms is not None:
            emg += self.tap.sample_mv(rng) * self.tap.course(times_ms + isi_ms)
        channels = {"emg": isiw.Channel(emg, self.rate_hz, "mV", t0_ms=-500.0)}
        return isiw.Sweep(channels, None, None if alone else 0.0, None if isi_ms is None else -isi_ms)


def session_of(rig: Rig, seed: int, taps: int, signals: isiw.signals.SignalLimits | None = None) -> isiw.SessionResult:
    """A session of 40 pairs; whatever it pauses for is answered with going on."""
    strategy = isiw.make_strategy(space=SPACE, seed=seed, max_trials=TRIALS)
    with tempfile.TemporaryDirectory() as folder:
        return isiw.Session(
            rig,
            strategy,
            log=Path(folder) / "one.mcap",
            signals=signals,
            protocol=isiw.VisitProtocol(taps_first=taps),
            safeguards=isiw.Safeguards(on_pause=lambda _: True),
        ).run(progress=False)


def person_rig(person: SimulatedSubject, seed: int, tap: TapResponse | None, *, tap_alone: bool = False) -> Rig:
    """A rig that records this person."""
    responder = person.begin(seed)
    return Rig(lambda isi_ms: responder.respond(isi_ms, "impact").mep_mv, tap, seed, tap_alone=tap_alone)


class Outcome(NamedTuple):
    """What a session says of one person: probability of a window, F1, and whether its intervals hold the true edges."""

    probability: float
    f1: float
    covered: tuple[bool, bool] | None


def outcome(person: SimulatedSubject, seed: int, tap: TapResponse | None, taps: int) -> Outcome:
    """What a session of this person ends with, and so many taps alone after the first trials."""
    truth, estimate = person.window(SPACE), session_of(person_rig(person, seed, tap, tap_alone=taps > 0), seed, taps)
    known = estimate.estimate
    return Outcome(
        known.probability or 0.0, isiw.metrics.f1(known, truth, SPACE), isiw.metrics.covers(known, truth, SPACE)
    )


def name_of(case: Reflex) -> str:
    """A case in a table."""
    size_mv, start_ms, lasts_ms, taps = case
    how = f"{taps} taps alone" if taps else "no tap alone"
    return (
        f"no reflex, {how}"
        if not size_mv
        else f"{size_mv:.2f} mV at {start_ms:.0f}-{start_ms + lasts_ms:.0f} ms, {how}"
    )


def in_time(persons: list[SimulatedSubject], minutes: float) -> Iterator[tuple[int, SimulatedSubject]]:
    """The number of each person and the person, as long as there is time."""
    ends_s = time.monotonic() + 60 * minutes
    for number, person in enumerate(persons):
        if time.monotonic() > ends_s:
            return
        yield number, person


def reflex(people: int, seed: int, minutes: float) -> Iterator[str]:
    """F1 and coverage of people with a window: with reflexes, without, and of an oracle that has seen 100 taps."""
    found: dict[Reflex, list[Outcome]] = {case: [] for case in (*NO_REFLEX, *REFLEXES, *ORACLES)}
    for number, person in in_time(cohort("recruitment", people, seed), minutes):
        for case, outcomes in found.items():
            outcomes.append(outcome(person, seed + number, tap_of(case), case[-1]))
    f1s = {case: np.array([one.f1 for one in outcomes]) for case, outcomes in found.items()}
    usual = {case: f1s[case] - f1s[0.0, 0.0, 0.0, case[-1]] for case in REFLEXES}
    best = {case: f1s[case] - f1s[*case[:-1], ORACLE_TAPS] for case in REFLEXES if case[0] == ORACLES[0][0]}
    for case, outcomes in found.items():
        held = [each for one in outcomes if one.covered is not None for each in one.covered]
        less = f", {told(usual[case])} to no reflex" if case in usual else ""
        less += f", {told(best[case])} to the oracle" if case in best else ""
        mean = f"{f1s[case].mean():.3f} ± {error(f1s[case]):.3f}"
        yield f"{name_of(case):40} F1 {mean}, edges covered {np.mean(held):.2f}, {len(outcomes)} people{less}"
    for size_mv in dict.fromkeys(case[0] for case in REFLEXES):
        pooled = np.mean([each for case, each in usual.items() if case[0] == size_mv], axis=0)
        yield f"{size_mv:.2f} mV, pooled: F1 {told(pooled)} to no reflex"
    yield f"the oracle's cases, pooled: F1 {told(np.mean(list(best.values()), axis=0))} to the oracle"


def flat(people: int, seed: int, minutes: float) -> Iterator[str]:
    """How often people without a window, and with a reflex, get a probable one."""
    found: dict[Reflex, list[Outcome]] = {case: [] for case in REFLEXES}
    for number, person in in_time(cohort("nonresponder", people, seed), minutes):
        for case, outcomes in found.items():
            outcomes.append(outcome(person, seed + number, tap_of(case), case[-1]))
    sure = {case: sum(one.probability >= SURE for one in outcomes) for case, outcomes in found.items()}
    for case, outcomes in found.items():
        yield f"{name_of(case):40} without a window: P >= {SURE} in {sure[case]} of {len(outcomes)}"
    yield f"pooled: P >= {SURE} in {sum(sure.values())} of {sum(map(len, found.values()))}"


def error(values: FloatArray) -> float:
    """The standard error of a mean."""
    return float(np.std(values, ddof=1) / math.sqrt(len(values))) if len(values) > 1 else math.nan


def told(differences: FloatArray) -> str:
    """The mean of some differences, and its standard error."""
    return f"{differences.mean():+.3f} ± {error(differences):.3f}"


def plain(people: int, seed: int, minutes: float) -> Iterator[str]:
    """The F1 of a session with taps alone and of a loop that tells amplitudes as they are judged; no reflex."""
    differences, lost = [], 0
    both = itertools.chain(
        *zip(*(cohort(name, people // 2, seed) for name in ("recruitment", "gaussian")), strict=True)
    )
    for number, person in in_time(list(both), minutes):
        truth, own = person.window(SPACE), seed + number
        result = session_of(person_rig(person, own, None), own, 0)
        lost += sum(trial.reason is not None for trial in result.trials)
        strategy, rig = isiw.make_strategy(space=SPACE, seed=own, max_trials=TRIALS), person_rig(person, own, None)
        while not strategy.decision().stop:
            stimulus = isiw.Stimulus(strategy.delivered, strategy.ask())
            trial = isiw.signals.judge(rig.deliver(stimulus), stimulus, SPACE)
            strategy.learn(trial)
        f1s = [isiw.metrics.f1(estimate, truth, SPACE) for estimate in (result.estimate, strategy.estimate())]
        differences.append(f1s[0] - f1s[1])
    yield f"{len(differences)} people: F1 {told(np.array(differences))} (SE), {lost} trials lost"


def rigs(people: int, seed: int, _: float) -> Iterator[str]:
    """For how many trials of rigs that are right a session would pause; 30 trials a rig, at ISIs all over the range."""
    accused: list[str] = []
    for number in range(people):
        muscle = list(MUSCLES)[number % 2]
        rate_hz = (1000.0, 2000.0, 3000.0, 5000.0, 10000.0)[number // 2 % 5]
        tap = (None, TapResponse(30.0, 30.0, 0.1, 0.5))[number // 10 % 2]
        rng = np.random.default_rng([seed, number])
        rig = Rig(lambda _, rng=rng: 0.12 * rng.gamma(2.0, 0.5), tap, number, rate_hz=rate_hz, muscle=muscle)
        signals = isiw.signals.SignalLimits(mep_window_ms=isiw.signals.MEP_WINDOWS_MS[muscle])
        watch = Watch(SPACE, signals, max_in_a_row=3)
        for trial, isi_ms in enumerate(rng.uniform(0.0, 320.0, 30)):
            stimulus = isiw.Stimulus(trial, float(isi_ms))
            sweep = rig.deliver(stimulus)
            watch = watch.after(isiw.signals.judge(sweep, stimulus, SPACE, signals), sweep)
            if watch.pause is not None:
                accused.append(f"{muscle}, {rate_hz:g} Hz, {'a' if tap else 'no'} response: {watch.pause}")
                watch = watch.seen()
    yield f"right rigs: {len(accused)} pauses in {people} times 30 trials"
    yield from accused


class Told:
    """What a rig's trials are told as, once what a tap alone evokes is learnt from each."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.taps, self.count = rig, TapResponses(), 0

    def mv(self, isi_ms: float | None, *, alone: bool = False) -> float:
        """The amplitude of the next trial without what is left of the response in it [mV]."""
        stimulus = isiw.Stimulus(self.count, isi_ms, tap_alone=alone)
        self.count += 1
        sweep = self.rig.deliver(stimulus)
        trial = isiw.signals.judge(sweep, stimulus, SPACE)
        self.taps = self.taps.after(trial, sweep)
        trial = self.taps.measured(trial)
        return (trial.mep_mv or 0.0) - (trial.tap_mv or 0.0)


def sizes(_: int, seed: int, __: float) -> Iterator[str]:
    """The median amplitude of MEPs of .15 mV at ISIs of 0 to 60 ms, as a share of that at 200 ms."""
    for name, tap in (("no response", None), ("an artefact of .1 mV at 18-23 ms", TapResponse(18.0, 5.0, 0.1, 0.2))):
        told = Told(Rig(lambda _: 0.15, tap, seed))
        for _ in range(12):
            told.mv(None, alone=True)
        usual = statistics.median(told.mv(200.0) for _ in range(20))
        ratios = [statistics.median(told.mv(float(isi_ms)) for _ in range(20)) / usual for isi_ms in range(61)]
        off = [isi_ms for isi_ms, ratio in enumerate(ratios) if abs(ratio - 1) > 0.05]
        yield f"{name}: {len(off)} of 61 ISIs off by more than 5 %: {off}; {min(ratios):.3f} to {max(ratios):.3f}"


def random(sweeps: int, seed: int, _: float) -> Iterator[str]:
    """How many sweeps of any rate, length and offset raise an error."""
    rng, raised, accepted = np.random.default_rng(seed), 0, 0
    for _ in range(sweeps):
        rate_hz, before_ms = float(np.exp(rng.uniform(np.log(500), np.log(50_000)))), rng.uniform(-40, 300)
        count = max(2, round((before_ms + rng.uniform(0, 120)) * rate_hz / 1000))
        emg = isiw.Channel(0.003 * rng.standard_normal(count), rate_hz, "mV", t0_ms=rng.uniform(-1e4, 1e4))
        pulse_ms, isi_ms = emg.t0_ms + before_ms, rng.uniform(0, 320)
        stimulus = isiw.Stimulus(0, isi_ms)
        sweep = isiw.Sweep({"emg": emg}, t_tms_ms=pulse_ms, t_hit_ms=pulse_ms - isi_ms)
        try:
            trial = isiw.signals.judge(sweep, stimulus, SPACE)
            taps = TapResponses().after(trial, sweep)
            taps.measured(replace(trial, index=0))
            accepted += trial.reason is None
        except Exception:  # noqa: BLE001 - it is what is counted
            raised += 1
    yield f"{sweeps} random sweeps: {raised} raised, {accepted} accepted"


PARTS: Final = {"reflex": reflex, "flat": flat, "plain": plain, "rigs": rigs, "sizes": sizes, "random": random}


def main() -> None:
    """Run one part, and print or write its lines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--seed", type=int, default=10_000)
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin with no person after this time")
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    lines = [command_of("raw_sweeps"), made_with("numpy")]
    for line in PARTS[asked.part](asked.people, asked.seed, asked.minutes):
        lines.append(line)
        print(line, flush=True)
        if asked.out:
            (asked.out / f"raw_sweeps_{asked.part}.txt").write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    understood("raw_sweeps")
    main()
