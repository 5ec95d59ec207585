"""Whether the change from before an intervention to after it is what it is said to be, beside t-tests.

    python -m benchmarks.after_effects --out benchmarks/results

Simulated interventions: 30 pulses of TMS alone, 150 pairs at the best ISI, 20 pulses after 0, 15, 30 and 60 min. People are those
of `recruitment` and `hand` in turn; the pulses of TMS alone are given at 105 to 130 % RMT. In the last third of them at three intensities. The
pairs change the gain by the factor of the row, once and for all. The level is steady, drifts as recordings show
(SD .26), or strongly (SD .49). Of each intervention the pooled change: how often its 90 % interval covers the true
factor, how wide it is, and how often it holds no factor of 1. Beside it t-tests on the same pulses, of logarithms and
of amplitudes, whose limits are set so that they have the same rate of false alarms. Reported people come from seed
150,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import typer
from scipy import stats

from benchmarks.provenance import command_of, facts_of, made_with
from benchmarks.quick import understood
from isiw.pairing import change_of
from isiw.studies import InterventionPlan, intervene
from isiw.subjects import Drift, Plasticity, cohort
from isiw.types import FloatArray

DRIFTS: Final = {
    "steady": None,
    "as recorded": Drift(0.97, 0.26 * math.sqrt(1 - 0.97**2), ()),
    "strong": Drift(0.97, 0.12, ()),
}
FACTORS: Final = 1.0, 1.3, 1.6, 2.0
ROWS: Final = [(name, factor) for name in ("steady", "as recorded") for factor in FACTORS] + [("strong", 1.0)]
INTERVALS: Final = "factor", "steady"
"""Fields of a change: with a drift allowed for, and without one."""


def examined(number: int, seed: int, drift: str, factor: float) -> dict[str, float]:
    """One intervention: what is said of it, and what t-tests say."""
    person = cohort(("recruitment", "hand")[number % 2], number // 2 + 1, seed)[-1]
    rng = np.random.default_rng([seed, number])
    pct = float(rng.uniform(105, 130))
    tests = (pct,) if number % 3 else (pct - 10, pct, pct + 10)
    best_ms = float(person.profile.start_ms + person.profile.width_ms / 2)  # type: ignore[attr-defined] # of both cohorts
    subject = replace(
        person, drift=DRIFTS[drift], plasticity=Plasticity(math.log(factor), 2.0) if factor != 1 else None
    )
    visit = intervene(subject, best_ms, "impact", InterventionPlan(tests_pct_rmt=tests), seed=seed + number)
    effect = change_of(visit.pulses, pairs=len(visit.delivered))
    before, after = (
        np.array([pulse.mep_mv for pulse in visit.pulses if (pulse.after_last_pair_s < 0) is wanted])
        for wanted in (True, False)
    )
    found = {
        "log t": float(stats.ttest_ind(np.log(after), np.log(before)).statistic),
        "t": float(stats.ttest_ind(after, before).statistic),
    }
    for name in INTERVALS:
        median, low, high = getattr(effect.pooled, name)
        covered = float(low <= visit.change <= high)
        found |= {f"{name} covers": covered, f"{name} width": math.log(high / low), f"{name} median": math.log(median)}
        found[f"{name} shows"] = float(not low <= 1 <= high)
    by_block = [
        low <= true <= high
        for (_, low, high), true in zip((one.factor for one in effect.blocks), visit.changes, strict=True)
    ]
    return found | {"blocks cover": float(np.mean(by_block)), "drift": effect.drift_log_sd}


def shown(table: pd.DataFrame, test: str, false_alarms: float, none: pd.DataFrame) -> FloatArray:
    """Whether a t-test shows a change, at the limit with this rate of false alarms in people without one."""
    return np.asarray(table[test].abs() > np.quantile(none[test].abs(), 1 - false_alarms), dtype=float)


def summary(results: dict[tuple[str, float], pd.DataFrame]) -> pd.DataFrame:
    """A row for each kind of intervention."""
    rows = []
    for (drift, factor), table in results.items():
        none = results[drift, 1.0]
        for name in INTERVALS:
            row: dict[str, Any] = {"level": drift, "factor": factor, "interval": name, "people": len(table)}
            row |= {"covers": table[f"{name} covers"].mean(), "width": math.exp(table[f"{name} width"].median() / 2)}
            row |= {"bias": table[f"{name} median"].mean() - math.log(factor), "shows": table[f"{name} shows"].mean()}
            for test in ("log t", "t"):
                other = shown(table, test, none[f"{name} shows"].mean(), none)
                gain = np.asarray(table[f"{name} shows"]) - other
                error = gain.std(ddof=1) / math.sqrt(len(gain))
                row |= {
                    test: other.mean(),
                    f"more than {test}": gain.mean(),
                    f"{test}, lower bound": gain.mean() - 1.645 * error,
                }
            rows.append(row | {"blocks": table["blocks cover"].mean()})
    return pd.DataFrame(rows)


NAMES: Final = {"factor": "with a drift allowed for", "steady": "without a drift"}


def as_text(table: pd.DataFrame, people: int, seed: int) -> str:
    """The table as a page."""
    lines = [
        "# After-effects: the change of TMS alone, and its interval",
        "",
        f"`{command_of('after_effects')}` · {made_with('numpy', 'scipy')} · people {people} a row, seed {seed}",
        "",
        "Half of the people have a forearm's recruitment curve, half a hand's; TMS alone at 105 to 130 % RMT, a third of them at three",
        "intensities; 30 pulses before, 150 pairs, 4 × 20 pulses after. The level is steady, drifts as recordings show (SD .26, natural log), or",
        "strongly (SD .49). *Covers*: how often the 90 % interval of the pooled change has the true factor. *Width*: from the median to an end, as",
        "a factor. *Shows*: how often the interval holds no factor of 1; with factor 1 that is the rate of false alarms, and the t-tests' limits are",
        "set to the same rate on the same people. *More*: paired difference of what is shown, with the lower end of its 90 % interval.",
        "",
        "| level | true factor | interval | covers | width | bias (log) | shows | t of logs shows | more | t of MEPs shows | more |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in table.to_dict("records"):
        mores = [f"{row[f'more than {test}']:+.3f} (≥ {row[f'{test}, lower bound']:+.3f})" for test in ("log t", "t")]
        tests = (
            ("–", "–", "–", "–")
            if row["factor"] == 1
            else (f"{row['log t']:.3f}", mores[0], f"{row['t']:.3f}", mores[1])
        )
        lines.append(
            f"| {row['level']} | {row['factor']:g} | {NAMES[row['interval']]} | {row['covers']:.3f} | × {row['width']:.2f} "
            f"| {row['bias']:+.3f} | {row['shows']:.3f} | " + " | ".join(tests) + " |"
        )
    of_blocks = table[table["interval"] == "factor"]
    said = ", ".join(f"{row.level} × {row.factor:g}: {row.blocks:.3f}" for row in of_blocks.itertuples())
    return "\n".join([*lines, "", f"Intervals of single blocks, a drift allowed for, cover: {said}.", ""])


def main(
    people: Annotated[int, typer.Option(help="Interventions of each kind.")] = 1000,
    seed: Annotated[
        int, typer.Option(help="Seed of the people; 0 to 999 for work, from 150,000 for figures.")
    ] = 150_000,
    processes: Annotated[int, typer.Option(help="Processes.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Folder of the result.")] = None,
) -> None:
    """Simulate interventions of each kind, and say how often intervals cover the truth."""
    results = {}
    with ProcessPoolExecutor(processes) as pool:
        for drift, factor in ROWS:
            one = partial(examined, seed=seed, drift=drift, factor=factor)
            results[drift, factor] = pd.DataFrame(list(pool.map(one, range(people), chunksize=20)))
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
