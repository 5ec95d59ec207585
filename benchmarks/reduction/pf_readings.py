"""What the text leaves open of the particle filter: its window, its diffusion, its profile (Fig. 4.13, 4.14)."""

from __future__ import annotations

import itertools
from typing import Any, Final

import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.comparison import WORDS
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size

Settings = tuple[tuple[str, Any], ...]

SETTINGS: Final[dict[str, Settings]] = {
    "PF: ± 75 ms, diffusion 10 ms": (),
    "PF: ± 50 ms": (("half_width_ms", 50.0),),
    "PF: window of the fit": (("window", "fit"),),
    "PF: first to last particle": (("window", "particles"),),
    "PF: diffusion 5 ms": (("diffusion_ms", 5.0),),
    "PF: diffusion 20 ms": (("diffusion_ms", 20.0),),
    "PF: diffusion 20 ms, first to last particle": (("diffusion_ms", 20.0), ("window", "particles")),
    "PF: floor subtracted": (("floor", "subtracted"),),
}
"""The first is the base."""

PROSE = """\
The text has three windows for PF: its expectation ± 75 ms (4.3.2, "3 σ"), ± 50 ms (caption of Fig. 4.13, two SDs), and
the particles themselves (Fig. 4.29). Its profile (Fig. 4.14) is a Gaussian (Fig. 4.13), fitted here to all MEPs as NR
fits it. It gives no SD of the diffusion. Its weights are the MEPs as they are; the last reading subtracts the floor."""


def sessions(size: Size, seed: int) -> list[Session]:
    """Every setting with the same people, with and without accelerometer."""
    return [
        Session("pf", PEOPLE, person, seed, accelerometer=accelerometer, settings=settings)
        for settings, accelerometer in itertools.product(SETTINGS.values(), WORDS)
        for person in range(size.readings)
    ]


def rows_of(name: str, rows: pd.DataFrame) -> pd.DataFrame:
    """The sessions of one of `SETTINGS`."""
    return rows[rows["settings"] == SETTINGS[name]]


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a reading and accelerometer, the text first."""
    columns = {"trials": "trials", "F1": "f1, measured", "F1: true": "f1, true", "r": "correlation, measured"}
    table = [
        {
            "reading": "dissertation",
            "accelerometer": word,
            "trials": float(text.TRIALS[word]["pf"]),
            "F1": text.F1[word]["pf"],
            "converged": text.CONVERGED[word]["pf"],
        }
        | ({"r": text.CORRELATION["pf"]} if word == "without" else {})
        for word in WORDS.values()
    ]
    for name, (flag, word) in itertools.product(SETTINGS, WORDS.items()):
        group = rows_of(name, rows)
        means = group[group["accelerometer"] == flag][[*columns.values(), "converged"]].mean()
        ours = {label: means[column] for label, column in columns.items()} | {"converged": means["converged"]}
        table.append({"reading": name, "accelerometer": word} | ours)
    order = ["reading", "accelerometer", *columns, "converged"]
    return pd.DataFrame(table).reindex(columns=order)


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    prose = f"`{PEOPLE}`, {rows['person'].nunique()} sessions for each reading. {PROSE}"
    return Section("Readings of the particle filter (Fig. 4.13, 4.14)", prose, [Table("Means.", summary(rows))])
