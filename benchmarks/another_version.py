"""The default of another version of isiw on this version's simulated people: `python -m benchmarks.another_version`.

    git worktree add ../before 1bbe107
    python -m benchmarks.another_version run ../before/src --cohorts step,ramp --seed 240000 --out before
    python -m benchmarks.steps run --cohorts step,ramp --seed 240000 --out now
    python -m benchmarks.another_version compare now before --out versions

Earlier versions do not know people who change within a session, nor the window of the moment. So the other version is
copied as a package of another name, and only proposes ISIs and estimates windows; people, noise and truth are those of
this version. The hit delay and the stimulus are stated if that version can use them; the stopping rule is ignored.
"""

from __future__ import annotations

import importlib
import inspect
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import pandas as pd
import torch
import typer

from benchmarks.before_and_now import MARKS, study_of
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.estimate import WindowEstimate
from isiw.strategy.choice import Choice
from isiw.studies import summary
from isiw.studies.sessions import SimulatedSession, examine
from isiw.subjects.subject import Response
from isiw.window import Window

COMPARED: Final = (10, 20, 40)

PACKAGE: Final = "isiw_of_another_version"

IMPORTED: Final = re.compile(r"(?<=\bfrom )isiw\b|(?<=\bimport )isiw\b|\bisiw(?=\.)")
"""The name of the package where Python code means it."""

app = typer.Typer(help=__doc__)


def copied(source: Path, folder: Path) -> None:
    """Copy the package isiw of a folder into another one, under another name, and make it importable."""
    target = folder / PACKAGE
    if not target.exists():
        shutil.copytree(source / "isiw", target, ignore=shutil.ignore_patterns("__pycache__"))
        for file in target.rglob("*.py*"):
            file.write_text(IMPORTED.sub(PACKAGE, file.read_text("utf-8")), "utf-8")
    sys.path.insert(0, str(folder))


class Another:
    """Another version's default with people side by side, as `examine` needs it.

    Args:
        sessions: the sessions, of this version.
    """

    stopping = None

    def __init__(self, sessions: Sequence[SimulatedSession]) -> None:
        theirs = importlib.import_module(f"{PACKAGE}.studies.sessions")
        known = getattr(theirs, "known_settings", _none)
        there = [
            theirs.SimulatedSession(
                session.strategy,
                "gaussian",  # only what it is called; the people are this version's
                session.person,
                session.seed,
                session.trials,
                session.marks,
                settings=tuple(known(session.strategy, dict(session.settings)).items()),
            )
            for session in sessions
        ]
        home = theirs if hasattr(theirs, "_Batch") else importlib.import_module(f"{PACKAGE}.studies.batch")
        batch: Any = vars(home)["_Batch"]
        on_a_device = "device" in inspect.signature(batch).parameters  # as versions with an engine in torch have it
        self.batch: Any = batch(there, "cpu") if on_a_device else batch(there)

    def ask(self) -> list[Choice]:
        """Each person's next ISI."""
        return [Choice(choice.isi_ms, choice.fallback) for choice in self.batch.ask()]

    def tell(self, responses: Sequence[Response]) -> None:
        """Learn from one trial of each person."""
        self.batch.tell(responses)

    def count_mistrial(self, _: int, lost: Choice) -> Choice:
        """Ask the same once more."""
        return lost

    def estimate(self, person: int) -> WindowEstimate:
        """The other version's estimate of a person's window, as far as it is judged."""
        theirs = self.batch.estimate(person)
        window = theirs.window
        return WindowEstimate(
            theirs.probability,
            None if window is None else Window(window.start_ms, window.end_ms, window.segments),
            theirs.start_ms,
            theirs.end_ms,
            edge_samples_ms=theirs.edge_samples_ms,
            expected_f1=getattr(theirs, "expected_f1", None),
        )

    def trouble(self) -> bool | None:
        """Whether a fit failed; None if it is not known whose."""
        return self.batch.trouble()


def _none(_: str, __: Mapping[str, Any]) -> dict[str, Any]:
    """No settings, of a version that does not say which it knows."""
    return {}


@app.command()
def run(
    source: Annotated[Path, typer.Argument(help="Folder src of the other version.")],
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = "step",
    people: Annotated[int, typer.Option(help="People a cohort.")] = 200,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 240_000,
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("before"),
) -> None:
    """Run the other version's default, 25 people at a time; a cohort's table grows with each 25."""
    torch.set_num_threads(1)
    out.mkdir(parents=True, exist_ok=True)
    copied(source, out / "package")
    for name in cohorts.split(","):
        file = out / f"{name}.parquet"
        tables = [pd.read_parquet(file)] if file.exists() else []
        done = set() if not tables else set(tables[0]["person"])
        for unit in study_of(name, people, seed, MARKS).units():
            if {session.person for session in unit.sessions} <= done:
                continue
            tables.append(examine(unit.sessions, Another(unit.sessions)))
            pd.concat(tables).to_parquet(file)


@app.command()
def compare(
    now: Annotated[Path, typer.Argument(help="Folder of this version's tables.")],
    others: Annotated[list[Path], typer.Argument(help="Folders of the other versions', named as these are.")],
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = Path("versions"),
) -> None:
    """Put versions beside each other: F1, sure and wrong, coverage, and what this one's F1 is more, with its SE."""
    tables = [beside(file, [other / file.name for other in others]) for file in sorted(now.glob("*.parquet"))]
    text = pd.concat(tables).to_markdown(index=False, floatfmt=".3f")
    lines = [f"- command: `{command_of('another_version')}`", f"- {made_with('torch')}", "", text, ""]
    out.with_suffix(".md").write_text("\n".join(lines), encoding="utf-8")
    print(text)


def beside(now: Path, others: Sequence[Path]) -> pd.DataFrame:
    """Versions on the same people of a cohort, by trial.

    Args:
        now: rows of this version.
        others: rows of the others, each in a folder named as its version.
    """
    own = pd.read_parquet(now)
    own = own[own["trial"].isin(COMPARED)]
    table = own.groupby(["cohort", "trial"]).agg(people=("f1", "size")).assign(**_said(own, "now"))
    for other in others:
        name, theirs = other.parent.name, pd.read_parquet(other)
        both = own.merge(theirs, on=["cohort", "seed", "person", "trial"], suffixes=("", "_then"))
        more = (both["f1"] - both["f1_then"]).groupby([both["cohort"], both["trial"]])
        there = both[both["true_window"]]
        found = (there["f1"] - there["f1_then"]).groupby([there["cohort"], there["trial"]])
        table = table.assign(**_said(theirs, name))
        table[f"more than {name}"] = _with_error(more)
        table[f"of people with a window, more than {name}"] = _with_error(found)
    return table.reset_index()


def _said(rows: pd.DataFrame, name: str) -> dict[str, pd.Series]:
    """Mean F1, share of sure and wrong, and shares of covered edges of a version, by cohort and trial."""
    columns = {
        f"F1 {name}": rows["f1"],
        f"sure and wrong {name}": summary.sure_and_wrong(rows["expected_f1"], rows["f1"]),
        f"start {name}": rows["start_covered"],
        f"end {name}": rows["end_covered"],
    }
    return {column: values.groupby([rows["cohort"], rows["trial"]]).mean() for column, values in columns.items()}


def _with_error(groups: Any) -> pd.Series:
    """Mean and standard error of groups, as they are read."""
    both = groups.agg(["mean", "sem"])
    return both.apply(lambda row: f"{row['mean']:+.3f} ± {row['sem']:.3f}", axis=1)


if __name__ == "__main__":
    understood("another_version")
    app()
