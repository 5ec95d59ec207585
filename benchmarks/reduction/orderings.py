"""The dissertation's orderings: whether they hold here, on which people, and under which reading."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import NAMES

SHARE = 0.3
"""What the dissertation's trials are to be met within."""

PROSE = """\
Each ordering, with our numbers, on different people and under different readings. What fails on `kim11` and holds
on constant-CV noise fails by the trial noise of the simulated people, not by the method; what fails everywhere is not
explained by it. Two failures have causes of their own. PF's stand-in profile has the right width wherever its place
is right, after ten times the trials, and so correlates with the best. NR's floor, where it is subtracted, is the
median of all MEPs: with accelerometer the window takes so much of the range that the median lies in it (compare the
readings with a raw floor). ≫ is taken as twice as many, ≈ as within 30 % (trials) or .1 (correlation)."""


def claims(table: pd.DataFrame) -> dict[str, tuple[bool, str]]:
    """The orderings: whether each holds in one comparison, and its numbers.

    Args:
        table: as from `comparison.summary`.
    """
    cells = table.set_index(["method", "accelerometer"])
    n, f1, r = (cells[name] for name in ("trials", "F1: true", "r: measured"))
    bare = {name: n[name, "without"] for name in (*map(NAMES.get, text.METHODS), NAMES["incremental"])}
    corr = {name: r[name, "without"] for name in map(NAMES.get, text.METHODS)}
    numbers = " ".join(f"{name} {value:.0f}" for name, value in bare.items())
    correlations = " ".join(f"{name} {value:.2f}" for name, value in corr.items())
    found = {
        "trials: conventional ≫ PF ≫ SVMR": (bare["conventional"] > 2 * bare["PF"] > 4 * bare["SVMR"], numbers),
        "trials: SVMR > GPR": (bare["SVMR"] > bare["GPR"], ""),
        "trials: GPR ≈ NR": (within(bare["GPR"], bare["NR"]), ""),
        "correlation: GPR > SVMR, PF > NR": (
            corr["GPR"] > max(corr["SVMR"], corr["PF"]) and min(corr["SVMR"], corr["PF"]) > corr["NR"],
            correlations,
        ),
        "correlation: SVMR ≈ PF": (abs(corr["SVMR"] - corr["PF"]) <= 0.1, ""),
    }
    for name in corr:
        change = (
            f"{n[name, 'without']:.1f} → {n[name, 'with']:.1f}, F1 {f1[name, 'without']:.2f} → {f1[name, 'with']:.2f}"
        )
        helps = n[name, "with"] <= n[name, "without"] and f1[name, "with"] >= f1[name, "without"]
        found[f"the accelerometer helps {name}"] = (helps, change)
    for name, method in (("NR", "nr"), ("GPR", "gpr")):
        theirs = text.TRIALS["without"][method]
        found[f"{name}'s trials within 30 % of {theirs}"] = (within(bare[name], theirs), f"{bare[name]:.1f}")
    return found


def within(ours: float, theirs: float) -> bool:
    """Whether one number is within 30 % of another."""
    return abs(ours / theirs - 1.0) <= SHARE


def outside(table: pd.DataFrame, readings: pd.DataFrame) -> list[str]:
    """For each mean number of trials beyond 30 % of the text's: which readings bring it within.

    Args:
        table: the comparison that is judged, as from `comparison.summary`.
        readings: as from `reading_table.summary`, without accelerometer.
    """
    sentences = []
    for row in table[table["accelerometer"] == "without"].itertuples():
        label, theirs = f"n {row.method}", table.loc[row.Index, "text: trials"]
        if label not in readings or within(row.trials, theirs):
            continue
        near = readings.loc[readings[label].map(lambda n, theirs=theirs: within(n, theirs)), "reading"].iloc[1:]
        found = "; ".join(near) or "no reading"
        sentences.append(f"{row.method}: {row.trials:.1f} trials against {theirs:.0f}; within 30 % under: {found}.")
    return sentences


def section(tables: Mapping[str, pd.DataFrame], readings: pd.DataFrame) -> Section:
    """This part of the report.

    Args:
        tables: comparisons by name, as from `comparison.summary`; the first is the one that is judged.
        readings: as from `reading_table.summary`, without accelerometer.
    """
    judged = {name: claims(table) for name, table in tables.items()}
    rows = [
        {"ordering": claim} | {name: _verdict(*found[claim]) for name, found in judged.items()}
        for claim in next(iter(judged.values()))
    ]
    kept = [
        f"{name}: {sum(holds for holds, _ in found.values())} of {len(found)} hold." for name, found in judged.items()
    ]
    beyond = outside(next(iter(tables.values())), readings)
    return Section("The orderings", PROSE, [Table("Orderings.", pd.DataFrame(rows))], conclusions=[*kept, *beyond])


def _verdict(holds: bool, numbers: str) -> str:  # noqa: FBT001 - as `claims` has it
    return ("holds" if holds else "FAILS") + (f" ({numbers})" if numbers else "")
