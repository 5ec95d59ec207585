"""Whether the people of `kim11-measured` have the measured windows of the dissertation's Table 4.1.

    python -m benchmarks.measured_windows > benchmarks/results/measured_windows.md

Each person is swept as in the text (4.2.1): every 5 ms, the mean of ten MEPs, the window where it is above TMS alone at
100 % RMT. Again and again, with other noise.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import pandas as pd
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.recorded import RecordedSweep, record
from isiw.design import VALVE_SPACE
from isiw.subjects import SimulatedSubject
from isiw.subjects.measured import MEASURED_KIM, MeasuredPerson
from isiw.types import FloatArray

ALONE = 2000
"""Trials of TMS alone, and at the best ISI, for each person."""

WITHIN = 0.1
MOST_CROSSINGS = 0.02

NOTE = """\
Widths in ms. A window is above TMS alone at 100 % RMT, in the text's words (4.2.1). Above TMS alone at 90 %, which is
silent, a sweep shows far wider ones, since every other mean outside is above that by chance. Three peaks are read from
the ends of the text's axes, the others are 2.5 thresholds. The true window is by 0.135 of the largest excess. Where no
mean of three ISIs is three standard errors above TMS alone at 100 % RMT, a sweep shows no window; widths are means of
the others."""


def widths_ms(sweeps: list[RecordedSweep], baseline: str) -> FloatArray:
    """Widths of the measured windows [ms], NaN where a sweep shows none, shape (n,)."""
    windows = [sweep.windows[f"measured, {baseline}"] for sweep in sweeps]
    return np.array([math.nan if window is None else window.end_ms - window.start_ms for window in windows])


def answers_mv(subject: SimulatedSubject, isi_ms: float | None, seed: int) -> FloatArray:
    """MEPs [mV] at an ISI from the valve command, or of TMS alone, shape (n,)."""
    responder = subject.begin(seed)
    return np.array([responder.respond(isi_ms, "valve").mep_mv for _ in range(ALONE)])


def row(number: int, text: MeasuredPerson, subject: SimulatedSubject, sweeps: int, seed: int) -> dict[str, object]:
    """One person: theirs and ours."""
    swept = [record(subject, seed + k) for k in range(sweeps)]
    measured = widths_ms(swept, "100 % RMT")
    best_ms = float(VALVE_SPACE.grid_ms[subject.expected_mep_mv(VALVE_SPACE).argmax()])
    peak_mv = float(answers_mv(subject, best_ms, seed).mean())
    window = subject.window(VALVE_SPACE)
    error = "not shown" if text.peak_error_mv is None else f"± {1e3 * text.peak_error_mv:.0f}"
    return {
        "subject": number,
        "width: text": text.width_ms,
        "width: mean": np.nanmean(measured),
        "SD": np.nanstd(measured),
        "difference %": 100 * (np.nanmean(measured) / text.width_ms - 1),
        "no window": np.isnan(measured).mean(),
        "over TMS at 90 %": np.nanmean(widths_ms(swept, "90 % RMT")),
        "true": math.nan if window is None else window.width_ms,
        "peak µV: read": 1e3 * text.peak_mv,
        "reading error": error,
        "peak µV": 1e3 * peak_mv,
        "threshold µV": 1e3 * text.threshold_mv,
        "TMS alone crosses %": 100 * float((answers_mv(subject, None, seed + 1) > text.threshold_mv).mean()),
    }


def verdicts(table: pd.DataFrame) -> list[str]:
    """What is to hold."""
    theirs, ours = table["width: text"], table["width: mean"]
    worst = table["difference %"].abs().max()
    errors = pd.Series([person.peak_error_mv or math.nan for person in MEASURED_KIM]) * 1e3
    off = (table["peak µV"] - table["peak µV: read"]).abs()
    crossings = table["TMS alone crosses %"].max()
    mean, sd = (f"{f(ours):.1f} ms, exactly {f(theirs):.1f} in the text" for f in (np.mean, np.std))
    near = [abs(f(ours) / f(theirs) - 1) <= WITHIN for f in (np.mean, np.std)]
    shown = (off[errors.notna()] <= errors.dropna()).all()
    silent = table.loc[table["no window"].idxmax()]
    seen = f"worst {worst:.1f} %; of subject {silent['subject']:.0f}, {100 * silent['no window']:.0f} % show none"
    each = f"every person's width within 10 % of Table 4.1, of the sweeps that show a window ({seen})"
    return [
        f"{_word(worst <= 100 * WITHIN)}: {each}.",
        f"{_word(near[0])}: their mean within 10 % ({mean}).",
        f"{_word(near[1])}: their SD within 10 % ({sd}).",
        f"{_word(shown)}: peaks that a figure shows within their reading error.",
        f"{_word(crossings <= 100 * MOST_CROSSINGS)}: TMS alone crosses a threshold in at most 2 % ({crossings:.2f}).",
    ]


def _word(holds: object) -> str:
    return "holds" if holds else "FAILS"


def main(
    sweeps: Annotated[int, typer.Option(help="Sweeps of each person.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of the first sweep.")] = 10_000,
) -> None:
    """Measure the windows of `kim11-measured`."""
    people = isiw.subjects.cohort(PEOPLE, len(MEASURED_KIM), seed)
    pairs = zip(MEASURED_KIM, people, strict=True)
    table = pd.DataFrame([row(n, text, subject, sweeps, seed) for n, (text, subject) in enumerate(pairs, 1)])
    print("# Measured windows of `kim11-measured`\n")
    print(f"- command: `{command_of('measured_windows')}`")
    print(f"- {made_with('numpy')}; {sweeps} sweeps of each person, seed {seed}\n")
    print("\n".join(f"- {sentence}" for sentence in verdicts(table)) + "\n")
    print(table.round(2).to_markdown(index=False))
    print(f"\n{NOTE}")


if __name__ == "__main__":
    understood("measured_windows", prints=True)
    typer.run(main)
