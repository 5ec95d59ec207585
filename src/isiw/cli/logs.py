"""The commands about several logs: exporting them for others' software, and comparing them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import isiw
from isiw.cli.console import NO_DEFAULT, Overwrite, counted, errors_reported, exit_if_damaged, show

__all__ = ["app"]

app = typer.Typer()


@app.command()
def export(
    source: Annotated[Path, typer.Argument(help="A session's log, or a folder of logs.", **NO_DEFAULT)],
    folder: Annotated[Path, typer.Argument(help="A new folder; nothing is replaced.", **NO_DEFAULT)],
    to: Annotated[
        Literal["csv", "parquet", "bids"], typer.Option(help="Tables, or a BIDS data set with the sweeps.")
    ] = "csv",
    pseudonymise: Annotated[  # noqa: FBT002 - a flag of the command line
        bool, typer.Option("--pseudonymise", help="Replace codes and dates, leave out notes; see docs/export.md.")
    ] = False,
) -> None:
    """Export sessions as tables or as BIDS.

    A damaged log is exported as far as it can be read; the exit code is 3 if anything is missing.
    """
    with errors_reported("Interrupted: nothing was written."):
        exported = isiw.export.export_logs(source, folder, to, pseudonymise=pseudonymise)
        for subject, pseudonym in exported.pseudonyms.items():
            show(f"{subject} is now {pseudonym}")
        if exported.pseudonyms:
            show("Keep this list if you need it: it is stored nowhere.")
        what = f"{counted(exported.sessions, 'session')} with {counted(exported.trials, 'trial')}"
        show(f"{what}: {exported.folder}", style="bold")
        exit_if_damaged(exported.lacking)


@app.command()
def compare(
    logs: Annotated[list[Path], typer.Argument(help="Logs; each is compared to the first.", **NO_DEFAULT)],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Page (.html) or picture to write.", **NO_DEFAULT)
    ] = None,
    overwrite: Overwrite = False,  # noqa: FBT002 - a flag
) -> None:
    """Compare the windows of sessions: of one person on several days, or of several people."""
    with errors_reported():
        records = [isiw.read_session(log) for log in logs]
        differences = isiw.priors.differences(records)
        show(isiw.report.comparison_table(records))
        for difference in differences:
            show(isiw.report.comparison_sentence(difference), style="bold")
        if output is not None and output.suffix.lower() == ".html":
            show(f"page: {isiw.report.save_comparison(records, differences, output, overwrite=overwrite)}")
        elif output is not None:
            show(f"picture: {isiw.plots.save_comparison_plot(records, output, overwrite=overwrite)}")
        losses = [f"{record.path.name}: {loss}" for record in records for loss in record.losses]
        exit_if_damaged(losses)
