"""Whether the change from before an intervention to after it is what it is said to be, beside t-tests.

    python -m benchmarks.after_effects --out benchmarks/results

Simulated interventions: 30 pulses of TMS alone, 150 pairs at the best ISI, 20 pulses after 0, 15, 30 and 60 min. People
are those of `recruitment` and `hand` in turn; TMS alone is given at 105 to 130 % RMT, in a third of them at three
intensities. The pairs change the gain by the factor of the row, once and for all. The level is steady, drifts as
recordings show (SD .26), or strongly (SD .49). Of each intervention the pooled change: how often its 90 % interval
covers the true factor, how wide it is, and how often it holds no factor of 1. Beside it t-tests on the same pulses, of
logarithms and of amplitudes, whose limits are set so that they have the same rate of false alarms. Reported people come
from seed 156,000 on; seeds below 1,000 are for work, those of 150,000 have been looked at.
"""

from __future__ import annotations

import json
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, Final, cast

import numpy as np
import pandas as pd
import typer
from scipy import stats

from benchmarks.provenance import command_of, facts_of, made_with
from benchmarks.quick import understood
from isiw.pairing import change_of
from isiw.studies import InterventionPlan, intervene
from isiw.subjects import Drift, PeakProfile, Plasticity, SimulatedSubject, cohort
from isiw.types import FloatArray

DRIFTS: Final = {
    "steady": None,
    "as recorded": Drift(0.97, 0.26 * math.sqrt(1 - 0.97**2), ()),
    "strong": Drift(0.97, 0.12, ()),
}
FACTORS: Final = 1.0, 1.3, 1.6, 2.0
ROWS: Final = [*((level, factor) for level in ("steady", "as recorded") for factor in FACTORS), ("strong", 1.0)]
INTERVALS: Final = {"factor": "with a drift allowed for", "steady": "without a drift"}
"""Fields of a change."""

TESTS: Final = "log t", "t"
BOUND: Final = 1.645
"""SEs from a difference to the lower end of its 90 % interval."""


@lru_cache
def people_of(seed: int, each: int) -> tuple[list[SimulatedSubject], list[SimulatedSubject]]:
    """So many people of each cohort."""
    return cohort("recruitment", each, seed), cohort("hand", each, seed)


def examined(number: int, people: int, seed: int, level: str, factor: float) -> dict[str, float]:
    """One intervention: what is said of it, and what t-tests say."""
    person = people_of(seed, people // 2 + 1)[number % 2][number // 2]
    profile = cast("PeakProfile", person.profile)  # as all people of both cohorts have
    pct = float(np.random.default_rng([seed, number]).uniform(105, 130))
    tests = (pct,) if number % 3 else (pct - 10, pct, pct + 10)
    grown = None if factor == 1 else Plasticity(math.log(factor), 2.0)
    subject = replace(person, drift=DRIFTS[level], plasticity=grown)
    best_ms = profile.start_ms + profile.width_ms / 2
    visit = intervene(subject, best_ms, "impact", InterventionPlan(tests_pct_rmt=tests), seed=1000 * seed + number)
    effect = change_of(visit.pulses, pairs=len(visit.delivered))
    before = np.array([pulse.mep_mv for pulse in visit.pulses if pulse.after_last_pair_s < 0])
    after = np.array([pulse.mep_mv for pulse in visit.pulses if pulse.after_last_pair_s >= 0])
    found = {
        "log t": float(stats.ttest_ind(np.log(after), np.log(before)).statistic),
        "t": float(stats.ttest_ind(after, before).statistic),
    }
    for name in INTERVALS:
        median, low, high = getattr(effect.pooled, name)
        found |= {f"{name} covers": float(low <= visit.change <= high), f"{name} shows": float(not low <= 1 <= high)}
        found |= {f"{name} width": math.log(high / low), f"{name} off": math.log(median / visit.change)}
    blocks = zip((one.factor for one in effect.blocks), visit.changes, strict=True)
    return found | {"blocks": float(np.mean([low <= true <= high for (_, low, high), true in blocks]))}


def summary(results: dict[tuple[str, float], pd.DataFrame]) -> pd.DataFrame:
    """A row for each kind of intervention and each interval."""
    rows = []
    for (level, factor), table in results.items():
        for name in INTERVALS:
            row: dict[str, Any] = {"level": level, "factor": factor, "interval": name, "people": len(table)}
            row |= {"covers": table[f"{name} covers"].mean(), "width": math.exp(table[f"{name} width"].median() / 2)}
            row |= {"off": table[f"{name} off"].mean(), "shows": table[f"{name} shows"].mean()}
            row |= {"blocks": table["blocks"].mean()}
            for test in TESTS:
                row |= beside(table, results[level, 1.0], name, test)
            rows.append(row)
    return pd.DataFrame(rows)


def beside(table: pd.DataFrame, unchanged: pd.DataFrame, name: str, test: str) -> dict[str, float]:
    """What a t-test shows, at the limit with which it has as many false alarms, and the paired difference."""
    limit = np.quantile(unchanged[test].abs(), 1 - unchanged[f"{name} shows"].mean())
    shown: FloatArray = np.asarray(table[test].abs() > limit, dtype=float)
    more = np.asarray(table[f"{name} shows"]) - shown
    error = more.std(ddof=1) / math.sqrt(len(more))
    return {test: shown.mean(), f"{test}: more": more.mean(), f"{test}: at least": more.mean() - BOUND * error}


ABOUT: Final = """\
Half of the people have a forearm's recruitment curve, half a hand's; TMS alone at 105 to 130 % RMT, a third of them at
three intensities; 30 pulses before, 150 pairs, 4 × 20 pulses after. The level is steady, drifts as recordings show (SD
.26, natural log), or strongly (SD .49). *Covers*: how often the 90 % interval of the pooled change has the true factor.
*Width*: from its middle to an end, as a factor. *Off*: mean error, natural log. *Shows*: how often it holds no factor
of 1; with factor 1 that is the rate of false alarms, and the t-tests' limits are set to the same rate on the same
people. *More*: paired difference of what is shown, with the lower end of its 90 % interval."""

HEADINGS: Final = (
    "level", "true factor", "interval", "covers", "width", "off", "shows",
    "t of logs shows", "more", "t of MEPs shows", "more",
)  # fmt: skip


def as_text(table: pd.DataFrame, people: int, seed: int) -> str:
    """The table as a page."""
    made = f"`{command_of('after_effects')}` · {made_with('numpy', 'scipy')} · {people} people a row, seed {seed}"
    lines = ["# After-effects: the change of TMS alone, and its interval", "", made, "", ABOUT, ""]
    lines += [f"| {' | '.join(HEADINGS)} |", "|" + "---|" * len(HEADINGS)]
    for row in table.to_dict("records"):
        cells = [row["level"], f"{row['factor']:g}", INTERVALS[row["interval"]], f"{row['covers']:.3f}"]
        cells += [f"× {row['width']:.2f}", f"{row['off']:+.3f}", f"{row['shows']:.3f}"]
        for test in TESTS:
            more = f"{row[f'{test}: more']:+.3f} (≥ {row[f'{test}: at least']:+.3f})"
            cells += ["–", "–"] if row["factor"] == 1 else [f"{row[test]:.3f}", more]
        lines.append(f"| {' | '.join(cells)} |")
    allowed = table[table["interval"] == "factor"].to_dict("records")
    said = ", ".join(f"{row['level']} × {row['factor']:g}: {row['blocks']:.3f}" for row in allowed)
    return "\n".join([*lines, "", f"Intervals of single blocks, a drift allowed for, cover: {said}.", ""])


def main(
    people: Annotated[int, typer.Option(help="Interventions of each kind.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the people; for figures from 156,000 on.")] = 156_000,
    processes: Annotated[int, typer.Option(help="Processes.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Folder of the result.")] = None,
) -> None:
    """Simulate interventions of each kind, and say how often intervals cover the truth."""
    results = {}
    with ProcessPoolExecutor(processes) as pool:
        for level, factor in ROWS:
            one = partial(examined, people=people, seed=seed, level=level, factor=factor)
            results[level, factor] = pd.DataFrame(list(pool.map(one, range(people), chunksize=20)))
    table = summary(results)
    text = as_text(table, people, seed)
    print(text)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        (out / "after_effects.md").write_text(text)
        facts = facts_of("after_effects", "numpy", "scipy", seed=seed, people=people)
        rows = json.loads(table.round(5).to_json(orient="records"))
        (out / "after_effects.json").write_text(json.dumps({**facts, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    understood("after_effects")
    typer.run(main)
