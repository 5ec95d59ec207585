"""TMS above the motor threshold: segments that enhance and that depress the MEP, found; and section 8.1.3, again.

    python -m benchmarks.inhibition --out benchmarks/results/inhibition

writes tables (Markdown), figures with versions, command and seeds and the claims of the dissertation beside ours
(JSON), and a picture. A session has 60 stimuli, a tenth of them TMS alone; the oracle, which knows the MEP without a
tap, has 60 pairs. Sessions are kept beside the tables as they finish: the same command goes on where it was
interrupted, and after `--minutes` the tables are of the sessions that are there, and say how many. Reported people come
from seed 10,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import typer

from benchmarks.inhibition_claims import all_claims, choices_of_curves
from benchmarks.opposed_oracle import OpposedOracle
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_tables
from isiw import DesignSpace, VisitProtocol, make_strategy, schedule
from isiw.metrics import f1
from isiw.subjects import RecruitmentResponse, SimulatedSubject, cohort
from isiw.subjects.responses import OpposedProfile
from isiw.trials import Trial

SPACE: Final = DesignSpace(0, 120, reference="impact")
MARKS: Final = (20, 40, 60)
PROTOCOL: Final = VisitProtocol(tms_alone=1 / 10)
SWEPT: Final = 30
"""People who are swept over all ISIs, for the claims of the dissertation."""

ALONE: Final = "enhanced alone"
GROUPS: Final = ("supra-threshold", "recruitment", "gaussian", ALONE)
"""Cohorts: people above the motor threshold, two kinds of people below it, and the first ones without a depression."""


def people_of(group: str, number: int, seed: int) -> list[SimulatedSubject]:
    """The people of a group."""
    if group != ALONE:
        return cohort(group, number, seed)
    return [replace(subject, profile=_opposed(subject).facilitated) for subject in cohort(GROUPS[0], number, seed)]


def _opposed(subject: SimulatedSubject) -> OpposedProfile:
    if not isinstance(subject.profile, OpposedProfile):
        raise TypeError(subject.profile)
    return subject.profile


def by_strategy(subject: SimulatedSubject, name: str, seed: int) -> Iterator[dict[str, Any]]:
    """A session with a strategy, at each mark."""
    strategy, person = make_strategy(name, SPACE, seed=seed), subject.begin(seed)
    for trial in range(MARKS[-1]):
        isi_ms = strategy.ask() if schedule.control(PROTOCOL, trial, seed) is None else None
        response = person.respond(isi_ms, SPACE.reference)
        strategy.learn(Trial.of(response.isi_ms, response.mep_mv))
        if trial + 1 in MARKS:
            found = strategy.estimate()
            segments = {"enhanced": found.window, "depressed": found.depressed}
            yield {"trial": trial + 1, "p_depressed": found.depressed_probability, **segments}


def by_oracle(subject: SimulatedSubject, seed: int) -> Iterator[dict[str, Any]]:
    """A session with the oracle, at each mark."""
    oracle, person = OpposedOracle(subject, SPACE), subject.begin(seed)
    for trial in range(MARKS[-1]):
        response = person.respond(oracle.ask(), SPACE.reference)
        oracle.tell(float(response.isi_ms or 0.0), response.mep_mv)
        if trial + 1 in MARKS:
            yield {"trial": trial + 1, **{kind: oracle.estimate(kind) for kind in ("enhanced", "depressed")}}


def rows_of(group: str, method: str, number: int, subject: SimulatedSubject, seed: int) -> list[dict[str, Any]]:
    """What a session came to at each mark."""
    truth = {"enhanced": subject.window(SPACE), "depressed": subject.depressed(SPACE)}
    session = by_oracle(subject, seed) if method == "oracle" else by_strategy(subject, method, seed)
    return [
        {
            "group": group,
            "method": method,
            "person": number,
            "trial": mark["trial"],
            "f1_enhanced": f1(mark["enhanced"], truth["enhanced"], SPACE),
            "f1_depressed": f1(mark["depressed"], truth["depressed"], SPACE),
            "called_depressed": mark["depressed"] is not None,
            "p_depressed": mark.get("p_depressed"),
        }
        for mark in session
    ]


def sessions(people: int, seed: int, kept: Path, minutes: float, groups: tuple[str, ...] = GROUPS) -> pd.DataFrame:
    """All sessions: those that are there already, and those that are missing, as far as there is time."""
    done = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    done = [row for row in done if row["person"] < people]
    known = {(row["group"], row["method"], row["person"]) for row in done}
    until = time.monotonic() + 60.0 * minutes
    with kept.open("a") as file:
        for group in groups:
            methods = ("supra-threshold", "oracle") if group == GROUPS[0] else ("supra-threshold",)
            for number, subject in enumerate(people_of(group, people, seed)):
                for method in methods:
                    if (group, method, number) in known:
                        continue
                    if time.monotonic() > until:
                        return pd.DataFrame(done)
                    rows = rows_of(group, method, number, subject, seed + number)
                    file.writelines(json.dumps(row) + "\n" for row in rows)
                    file.flush()
                    done += rows
    return pd.DataFrame(done)


def by_trial(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 of each kind, and how many are called depressed, with standard errors, by group, method and trial."""
    values = ["f1_enhanced", "f1_depressed", "called_depressed", "p_depressed"]
    numbers = rows.astype(dict.fromkeys(values, float))
    grouped = numbers.groupby(["group", "method", "trial"], sort=False)[values]
    means, errors = grouped.mean(), grouped.sem().drop(columns="p_depressed").add_suffix("_se")
    return pd.concat([grouped.size().rename("n"), means, errors], axis=1).reset_index()


def behind_oracle(rows: pd.DataFrame) -> pd.DataFrame:
    """By how much the oracle's F1 is larger on the same people, and the standard error of that."""
    kinds = ["f1_enhanced", "f1_depressed"]
    both = rows[rows["group"] == GROUPS[0]].set_index(["method", "trial", "person"])[kinds]
    table = (both.loc["oracle"] - both.loc["supra-threshold"]).groupby("trial")
    return pd.concat([table.mean(), table.sem().add_suffix("_se")], axis=1).reset_index()


def picture(table: pd.DataFrame, curves: pd.DataFrame, example: SimulatedSubject, out: Path) -> None:
    """One person below and above the threshold, which curves are chosen, and F1 by trial."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(15, 4.2), layout="constrained")
    grid = SPACE.grid_ms
    response = example.response
    if not isinstance(response, RecruitmentResponse):
        raise TypeError(response)
    for intensity in (90.0, 120.0):
        person = replace(example, response=replace(response, intensity_pct_rmt=intensity))
        left.semilogy(grid, person.expected_mep_mv(SPACE), label=f"{intensity:.0f} % RMT")
        left.axhline(person.baseline_mv, color="gray", linewidth=0.8, linestyle=":")
    left.set(xlabel="ISI from the impact [ms]", ylabel="expected MEP [mV]", title="One person; dotted: TMS alone")
    left.legend()
    curves.set_index("curve").plot.bar(ax=middle, rot=45)
    middle.set(xlabel="", ylabel="share of people", title="Curve of the smallest AICc")
    chosen = table[table["group"] == GROUPS[0]]
    for (method, rows), marker in zip(chosen.groupby("method", sort=False), "os", strict=True):
        for kind, style in (("enhanced", "-"), ("depressed", "--")):
            errors = rows[f"f1_{kind}_se"]
            right.errorbar(rows["trial"], rows[f"f1_{kind}"], errors, fmt=marker + style, label=f"{method}, {kind}")
    right.set(xlabel="stimuli", ylabel="F1", ylim=(0, 1), title="Both kinds of segment, with standard errors")
    right.legend(fontsize=8)
    figure.savefig(out.with_suffix(".png"), dpi=110)


def main(
    people: Annotated[int, typer.Option(help="People a group.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 10_000,
    minutes: Annotated[float, typer.Option(help="Interrupt the sessions after so many minutes.")] = np.inf,
    only: Annotated[str, typer.Option(help="Run the sessions of these groups, comma-separated, and no tables.")] = "",
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("inhibition"),
) -> None:
    """Run sessions above the motor threshold, and section 8.1.3 again."""
    groups = tuple(only.split(",")) if only else GROUPS
    rows = sessions(people, seed, out.with_suffix(".parts"), minutes, groups)
    if only:
        print("The sessions are kept; the same command without --only makes the tables.")
        return
    curves, example = choices_of_curves(SWEPT, seed), cohort(GROUPS[0], 4, seed)[3]
    tables = {"By trial": by_trial(rows), "Behind the oracle": behind_oracle(rows), "Curves": curves}
    claims = all_claims(SWEPT, seed, curves)
    facts = facts_of("inhibition", "torch", "numpy", seed=seed, people=people)
    write_tables(tables, facts, out, claims=claims)
    picture(tables["By trial"], curves, example, out)


if __name__ == "__main__":
    understood("inhibition")
    typer.run(main)
