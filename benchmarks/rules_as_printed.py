"""Rules of the dissertation as they are printed, each beside ours, and what the difference does.

    python -m benchmarks.rules_as_printed --out benchmarks/results/rules_as_printed

- The conventional sweep: 500 ms in steps of 5 ms, twelve trials each, "a maximum of 600 trials" (4.2.1), which end at
  245 ms, beside the 1,212 that the range has.
- The impact: the first falling crossing of the first reading, within a hysteresis, after the hammer has begun to move
  (5.2.2), and the first zero crossing after that (4.2.1), beside `isiw.signals.impact_times`. The text gives neither
  the hysteresis nor the threshold of the motion.

Simulated people and taps, whose true window and impact are known.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import pandas as pd
import typer

import isiw
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.reduction.recorded import STEP_MS, SWEPT, TRIALS_PER_ISI, RecordedSweep, record
from benchmarks.tables import write_tables
from isiw.devices.robot.mechanism import draw_taps
from isiw.devices.robot.tapper import preset
from isiw.devices.robot.waveforms import record_robot, sample_times_ms
from isiw.signals import impact_times
from isiw.types import FloatArray

RATE_HZ, VALVE_MS, TRIAL_MS = 5000.0, 500.0, 1000.0
PRESETS: Final = ("bench", "subject1")
NOISE: Final = (1.0, 3.0, 10.0)
"""The accelerometer's noise, as a multiple of the presets'."""

MOVED: Final = 0.1
"""The hammer has begun to move where the acceleration exceeds this share of its largest value."""

HYSTERESIS: Final = (0.0, 0.02, 0.1)
"""Half the hysteresis, as a share of the largest acceleration; the text gives none."""

LATE_MS: Final = 2.0
BUDGETS: Final = (1212, 600)
COHORTS: Final = ("kim11-measured", "recruitment", "kim11")


def sweeps(people: int, seed: int) -> pd.DataFrame:
    """What a sweep from the valve command finds within its budget, by cohort."""
    rows = []
    for cohort in COHORTS:
        recorded = [record(one, seed + n) for n, one in enumerate(isiw.subjects.cohort(cohort, people, seed))]
        for start, budget in itertools.product(("valve", "impact"), BUDGETS):
            found = pd.DataFrame([within(one, start, budget) for one in recorded]).mean()
            rows.append({"people": cohort, "from": start, "budget": budget} | found.to_dict())
    return pd.DataFrame(rows)


def within(swept: RecordedSweep, start: str, budget: int) -> dict[str, float]:
    """What a sweep finds that is terminated behind the window or where its budget is used up.

    Args:
        swept: the recorded sweep.
        start: what it begins at, the "valve" command or the "impact".
        budget: trials.
    """
    first_ms = swept.subject.hit_delay_ms if start == "impact" else 0.0
    last_ms = min(first_ms + STEP_MS * (budget / TRIALS_PER_ISI - 1), SWEPT.high_ms)
    part, truth = swept.sweep(first_ms, last_ms=last_ms), swept.windows["true"]
    return {
        "last ISI from the valve command [ms]": last_ms,
        "trials": part.terminated,
        "share terminated behind a window": float(part.terminated < part.trials),
        "share that finds a window": float(part.window is not None),
        "F1: true": isiw.metrics.f1(part.window, truth, SWEPT),
        "share of true windows that end beyond the last ISI": float(truth is not None and truth.end_ms > last_ms),
    }


def impacts(taps: int, seed: int) -> pd.DataFrame:
    """Error of each rule against the true impact, by preset."""
    conditions = itertools.product(PRESETS, NOISE)
    return pd.DataFrame([row for name, noise in conditions for row in _of_preset(name, noise, taps, seed)])


def _of_preset(name: str, noise: float, taps: int, seed: int) -> Iterator[dict[str, object]]:
    rng, usual = np.random.default_rng(seed), preset(name)
    louder = replace(usual.noise, acceleration_m_s2=noise * usual.noise.acceleration_m_s2)
    drawn = draw_taps(replace(usual, noise=louder), taps, rng)
    waves = record_robot(sample_times_ms(RATE_HZ, TRIAL_MS, VALVE_MS), drawn, rng)["acceleration"]
    found = {"ours": impact_times(waves, RATE_HZ, VALVE_MS), "4.2.1: first zero crossing": printed(waves, 0.0)}
    found |= {f"5.2.2: first falling edge, hysteresis {h:.0%}": printed(waves, h, from_first=True) for h in HYSTERESIS}
    for rule, times_ms in found.items():
        error_ms = times_ms - VALVE_MS - drawn.hit_ms
        yield {
            "taps": name,
            "noise": f"{noise:g} times",
            "rule": rule,
            "n": taps,
            "mean error [ms]": float(pd.Series(error_ms).mean()),
            "SD [ms]": float(pd.Series(error_ms).std()),
            f"off by more than {LATE_MS:g} ms": float((np.abs(error_ms) > LATE_MS).mean()),
            "not found": float(np.isnan(error_ms).mean()),
        }


def printed(waves: FloatArray, hysteresis: float, *, from_first: bool = False) -> FloatArray:
    """The impact by the text's rule [ms from the first sample], NaN where there is none, shape (n,).

    Args:
        waves: acceleration, shape (n, w).
        hysteresis: half of it, as a share of the largest acceleration.
        from_first: whether the level is the first reading of each sweep, as in 5.2.2, or zero.
    """
    level = waves[:, :1] if from_first else np.zeros((len(waves), 1))
    valve = round(VALVE_MS * RATE_HZ / 1000)
    above, largest = (waves - level)[:, valve:], waves.max(axis=1, keepdims=True)
    times = np.full(len(waves), np.nan)
    for row, (signal, top) in enumerate(zip(above, largest[:, 0], strict=True)):
        moved = int((signal > MOVED * top).argmax())
        below = np.flatnonzero(signal[moved:] < -hysteresis * top)
        if signal[moved] > MOVED * top and len(below):
            last_above = moved + int(np.flatnonzero(signal[moved : moved + below[0] + 1] >= 0)[-1])
            before, after = signal[last_above], signal[last_above + 1]
            times[row] = VALVE_MS + (last_above + before / (before - after)) * 1000 / RATE_HZ
    return times


def main(
    people: Annotated[int, typer.Option(help="People of each cohort.")] = 200,
    seed: Annotated[int, typer.Option(help="Seed of people and taps.")] = 10_000,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("rules_as_printed"),
) -> None:
    """Compare the rules."""
    tables = {
        "The budget of the conventional sweep": sweeps(people, seed),
        "The impact: errors against the true one": impacts(2 * people, seed),
    }
    write_tables(tables, facts_of("rules_as_printed", "numpy", "scipy", seed=seed, people=people), out)
    print(out.with_suffix(".md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    understood("rules_as_printed")
    typer.run(main)
