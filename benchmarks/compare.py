"""Every strategy, and every acquisition function with every family of models, on the same people.

    python -m benchmarks.compare --quick
    python -m benchmarks.compare --out benchmarks/results/compare --picture docs/images/results.svg

writes tables and three sentences (Markdown), all figures and README's table (JSON), a picture (SVG), and the rows
(Parquet). Units of work are kept in a folder beside them as they finish: the same command continues where it was
interrupted, and where another computer left off, from the file of rows. `--first 50` ends each row after its first
fifty people, `--parts`, `--rows` and `--cohorts` run some rows only; the tables are made of all that is there, and say
how many people each row has. Recorded people need the folder that ISIW_SHARED_DATA names. People of seeds below 1,000
are for work.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from rich.progress import Progress

from benchmarks.comparison.guess import with_guess
from benchmarks.comparison.measures import table_of
from benchmarks.comparison.picture import picture
from benchmarks.comparison.rows import EVEN, Part, chosen, parts
from benchmarks.comparison.running import (
    COHORTS,
    Plan,
    as_study,
    keep,
    processor_ms,
    require_same,
    rows_of,
    run_part,
    timed,
)
from benchmarks.comparison.words import (
    DEFAULT,
    MAIN,
    PEOPLE,
    compared_rows,
    readable,
    readme_table,
    savings,
    sentences,
)
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_tables
from isiw.plots.style import save_figure
from isiw.studies import DaskCluster, Processes

SEED = 130_000
WHOLE = "python -m benchmarks.compare --out benchmarks/results/compare --picture docs/images/results.svg"
COLUMNS = """\
People are the same in all rows, the first ones where a row has fewer. F1: mean ± standard error. Stimuli to a lasting
mean F1 of .7, .8, .9 as a ratio to those at even ISIs on the same people, with its 95 % interval by a bootstrap over
people; `<` and `>` where only one of both reached it, `≥` where more than a fortieth of the resamples never did, and
no interval where too many resamples reached it neither way. Of what follows, values after 20 / 40 stimuli: expected
minus actual F1; share of the true edges in the 90 % intervals; *sure and wrong* expects at least .7, and .35 more than
it has. Processor time is that of one session alone, ask and tell. `family+function` is a family's model with an
acquisition function; `guess` is one window for everybody, chosen on 1,000 other people (those of `kim11-measured` are
the same eleven)."""


def write(
    rows: pd.DataFrame, processor: dict[str, float], facts: dict[str, object], out: Path, drawn: Path | None = None
) -> None:
    """Tables; with even ISIs and the default among the rows of `MAIN`, sentences and picture, too.

    Args:
        rows: of all that was run, and of the fixed window.
        processor: processor time of a trial by strategy [ms].
        facts: command, versions and seed.
        out: path of the results, without suffix.
        drawn: the picture's path; without it beside the results.
    """
    table = table_of(rows, processor)
    if not {DEFAULT, EVEN} <= set(table.loc[table["cohort"] == MAIN, "strategy"]):
        write_tables({"All rows": table}, facts, out)
        out.with_suffix(".md").write_text(_text(table, facts), encoding="utf-8")
        return
    said = sentences(table, rows)
    shown = {cohort: compared_rows(rows, cohort) for cohort in PEOPLE if cohort in set(table["cohort"])}
    tables = {cohort: table_of(own, processor) for cohort, own in shown.items()}
    readme = f"{savings(table, tables)}\n\n{readme_table(tables)}"
    write_tables({"All rows": table}, facts, out, said=said, readme=readme)
    text = _text(table, facts, said)
    out.with_suffix(".md").write_text(text, encoding="utf-8")
    save_figure(picture(shown, tables), drawn or out.with_suffix(".svg"), overwrite=True)
    print(text, readme, sep="\n\n")


def _text(table: pd.DataFrame, facts: dict[str, object], said: Sequence[str] = ()) -> str:
    """The tables as they are read, under what made them and what follows from them."""
    blocks = [f"## `{name}`\n\n{readable(own).to_markdown(index=False)}" for name, own in table.groupby("cohort")]
    made = "\n".join(f"- {key}: `{value}`" for key, value in facts.items())
    follows = ["## What follows", "\n".join(f"- {sentence}" for sentence in said)] if said else []
    return "\n\n".join(["# Strategies compared", made, *follows, COLUMNS, *blocks]) + "\n"


def unfinished(plan: Plan, every: Sequence[Part], rows: pd.DataFrame) -> dict[str, str]:
    """What there is to say if not all was run: how much is there, and the command that runs the rest.

    Args:
        plan: people and trials.
        every: the parts.
        rows: what was run.
    """
    wanted = sum(
        plan.study(part, cohort).people * len(part.strategies)
        for part in every
        for cohort in COHORTS
        if cohort in (part.cohorts or COHORTS)
    )
    there = len(rows[["cohort", "strategy", "person"]].drop_duplicates())
    said = f"{there} of {wanted} sessions were run; the column people says how many of each row"
    return {} if there == wanted else {"not finished": said, "the rest by": WHOLE}


def main(  # noqa: PLR0913, PLR0917 - an option each
    people: Annotated[int, typer.Option(help="People of each cohort.")] = 200,
    slow_people: Annotated[int, typer.Option(help="People for rows of BoTorch and the parametric family.")] = 40,
    reference_people: Annotated[int, typer.Option(help="People for NUTS, half a minute a trial.")] = 2,
    trials: Annotated[int, typer.Option(help="Pairs a session.")] = 60,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = SEED,
    first: Annotated[int, typer.Option(help="End each row after so many people; 0 for all.")] = 0,
    rows_a_part: Annotated[
        int, typer.Option("--rows", help="Rows of each part but the first, the named strategies; 0 for all.")
    ] = 0,
    only: Annotated[str, typer.Option("--parts", help="Parts to run, comma-separated; all if empty.")] = "",
    cohorts: Annotated[str, typer.Option(help="Cohorts to run, comma-separated; none to write tables only.")] = (
        ",".join(COHORTS)
    ),
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    dask: Annotated[str, typer.Option(help="Address of a Dask scheduler, instead of processes.")] = "",
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("compare"),
    drawn: Annotated[Path | None, typer.Option("--picture", help="Path of the picture; beside the results.")] = None,
) -> None:
    """Compare strategies on the same people."""
    executor = DaskCluster(dask) if dask else Processes(workers)
    plan = Plan(out, people, trials, seed, first, executor)
    every, wanted = parts(slow_people, reference_people, rows_a_part), [name for name in cohorts.split(",") if name]
    if wanted:
        require_same(plan, every[0])
    with Progress() as progress:
        for part in chosen(every, [name for name in only.split(",") if name]):
            for cohort in wanted:
                bar = progress.add_task(f"{part.name} on {cohort}", total=None)
                run_part(plan, part, cohort, lambda _key, bar=bar: progress.advance(bar))
            if wanted:
                processor_ms(plan, part)
    rows = rows_of(plan)
    keep(plan, rows)
    facts = facts_of("compare", "numpy", "torch", seed=seed, space="valve, 0–500 ms", **unfinished(plan, every, rows))
    write(with_guess(as_study(rows)), timed(plan), facts, out, drawn)


if __name__ == "__main__":
    understood("compare")
    np.seterr(all="raise", under="ignore")
    typer.run(main)
