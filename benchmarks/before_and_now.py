"""The default of another version of isiw and of this one, on the same simulated people.

    git worktree add ../before e31d040
    PYTHONPATH=../before/src python benchmarks/before_and_now.py run --out before
    python benchmarks/before_and_now.py run --out now
    python benchmarks/before_and_now.py compare before now --out benchmarks/results/before_and_now

`run` keeps one table a cohort, and goes on where it was interrupted; `compare` pairs the people of both. The hit delay
is stated where a version can be told it. Reported people come from seed 100,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import inspect
import platform
import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import torch
import typer

from isiw.studies import Processes, Study, StudyStrategy, conduct

MARKS = (5, 10, 15, 20, 25, 30, 40)
COHORTS = "recruitment,gaussian,nonresponder"

app = typer.Typer(help=__doc__)


@app.command()
def run(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = COHORTS,
    people: Annotated[int, typer.Option(help="People a cohort.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 100_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("now"),
) -> None:
    """Run the default of the isiw that is imported."""
    torch.set_num_threads(1)
    told: dict[str, Any] = {"hit_delay": "stated"} if "hit_delay" in inspect.signature(Study).parameters else {}
    for name in cohorts.split(","):
        study = Study(
            (StudyStrategy("default"),),
            (name,),
            people,
            seed,
            MARKS[-1],
            MARKS,
            engine="batched",
            batch=25,
            stopping="ignored",
            **told,
        )
        results = conduct(study, out / f"{name}.study", executor=Processes(workers))
        results.rows().to_parquet(out / f"{name}.parquet")


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(help="Folder of the tables of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder of the tables of this version.")],
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = Path("before_and_now"),
) -> None:
    """Pair the people that both versions measured."""
    table = pd.concat([paired(before / path.name, path) for path in sorted(now.glob("*.parquet"))])
    command = shlex.join(["python", "benchmarks/before_and_now.py", *sys.argv[1:]])
    lines = [
        f"- command: `{command}`, after `run` with both versions",
        f"- python {platform.python_version()}, torch {torch.__version__}",
        "- the hit delay is stated where it can be; the stopping rule is ignored",
    ]
    text = table.to_markdown(index=False, floatfmt=".3f")
    out.with_suffix(".md").write_text("\n".join([*lines, "", text, ""]), encoding="utf-8")
    print(text)


def paired(before: Path, now: Path) -> pd.DataFrame:
    """F1 of both, their mean difference on the people of both, and the shares told "no window", by trial.

    Args:
        before: rows of the other version.
        now: rows of this version.
    """
    keys = ["cohort", "person", "trial"]
    new, old = pd.read_parquet(now), pd.read_parquet(before)
    both = new.merge(old, on=keys, suffixes=("_now", "_before"))
    both["difference"] = both["f1_now"] - both["f1_before"]
    for which in ("now", "before"):
        both[f"none_{which}"] = ~both[f"reported_window_{which}"].astype(bool)
    groups = both.groupby(["cohort", "trial"])
    table = groups[["f1_before", "f1_now", "difference", "none_before", "none_now"]].mean()
    table.insert(0, "people", groups.size())
    table.insert(4, "difference_se", groups["difference"].sem())
    return table.reset_index()


if __name__ == "__main__":
    app()
