"""Every table and figure of the dissertation's chapters 3 to 8 and B, ours beside the text's numbers.

    python -m benchmarks.dissertation --quick
    python -m benchmarks.dissertation

computes what is about the robot's timing, response counts and single sessions, collects what other benchmarks have left
in benchmarks/results, and writes one page in Markdown and HTML. Each part is kept: a run that was interrupted goes on
after the last part that is done. Run it from the project's root.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Final

os.environ.setdefault("OMP_NUM_THREADS", "1")

import typer
from rich.console import Console
from rich.progress import track

from benchmarks.dissertation import counts, events, examples, excitability, precision, traces
from benchmarks.dissertation.page import read_sources, write_page
from benchmarks.dissertation.parts import keep, kept
from benchmarks.dissertation.size import FEW, FULL
from benchmarks.quick import understood

PARTS: Final = {
    "events": events.tell,
    "counts": counts.tell,
    "precision": precision.tell,
    "traces": traces.tell,
    "examples": examples.tell,
    "excitability": excitability.tell,
}
RESULTS: Final = Path("benchmarks/results/dissertation")


def main(
    seed: Annotated[int, typer.Option(help="First seed of people and taps.")] = 10_000,
    out: Annotated[Path, typer.Option(help="Folder inside that of the results.")] = RESULTS,
    *,
    few: Annotated[bool, typer.Option(help="Few taps and people.")] = False,
    again: Annotated[bool, typer.Option(help="Compute every part again, also those that are done.")] = False,
) -> None:
    """Make the gallery."""
    size = FEW if few else FULL
    for name in track(PARTS, "parts", console=Console(stderr=True)):
        path = out / f"{name}.json"
        if again or not kept(path, size, seed):
            keep(PARTS[name], path, size, seed)
    sources, missing = read_sources(out, list(PARTS))
    for verdict, count in write_page(out, sources, missing).most_common():
        print(f"{verdict}: {count}")
    print(out / "README.md")


if __name__ == "__main__":
    understood("dissertation")
    typer.run(main)
