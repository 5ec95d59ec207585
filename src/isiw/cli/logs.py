"""The commands about logs: what is in one, its picture and page, trials excluded afterwards, exports, comparisons."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import typer

import isiw
from isiw.cli.console import (
    LOGS,
    Beside,
    Overwrite,
    counting,
    errors_reported,
    exit_if_damaged,
    free_beside,
    say_unread,
    show,
    show_statement,
    working,
)
from isiw.text.sanitize import command, counted

app = typer.Typer()

_MOST_LISTED = 400

Number = Annotated[int, typer.Argument(help="The trial's number, as in isiw show.")]
Log = Annotated[Path, typer.Argument(help="A session's log.")]


@app.command("show", rich_help_panel=LOGS)
def show_log(
    log: Log, whole: Annotated[bool, typer.Option("--all", help="List all trials and events of a long log.")] = False
) -> None:
    """Say who, when and with what, list the trials, and say what was found; works on a damaged log, too."""
    with errors_reported():
        record = isiw.read_session(log, channels=())
        say_unread(record)
        record.require_open()
        for fact in isiw.report.tables.first_facts(record):
            show(f"{fact.name + ':':10}{fact.value}")
        show("")
        show(isiw.session.aligned(isiw.report.words.TRIAL_HEADINGS))
        _list("trials", [isiw.session.aligned(row) for row in isiw.report.words.trial_rows(record)], whole=whole)
        events = [(e, "no trial" if e.trial is None else f"trial {e.trial}") for e in record.events]
        _list("events", [f"{event.kind} ({when}): {event.text}" for event, when in events], whole=whole)
        show_statement(isiw.report.final_statement(record))
        exit_if_damaged(record.losses)


def _list(what: str, lines: list[str], *, whole: bool) -> None:
    """Print lines; of very many the first and the last, unless all are wanted."""
    left = 0 if whole or len(lines) <= _MOST_LISTED else len(lines) - _MOST_LISTED
    head = _MOST_LISTED // 2 if left else len(lines)
    if lines:
        show("\n".join(lines[:head]))
    if left:
        show(f"… {left} {what} in between are not listed; --all lists them …", style="yellow")
        show("\n".join(lines[head + left :]))


@app.command(rich_help_panel=LOGS)
def plot(log: Log, output: Beside = None, overwrite: Overwrite = False) -> None:
    """Draw a session: profile, trials, window, and how the edges developed (.png, .pdf, .svg …)."""
    with errors_reported():
        _save("picture", isiw.plots.save_session_plot, log, output, ".png", overwrite=overwrite)


@app.command(rich_help_panel=LOGS)
def report(log: Log, output: Beside = None, overwrite: Overwrite = False) -> None:
    """Write a page about a session: what was found and how, trial by trial, for any browser, without a network."""
    with errors_reported():
        _save("report", isiw.report.save_report, log, output, ".html", overwrite=overwrite)


def _save(
    what: str, save: Callable[..., Path], log: Path, output: Path | None, suffix: str, *, overwrite: bool
) -> None:
    """Save what is made of a log, beside it if nobody gave a place, and say where it is."""
    record = isiw.read_session(log)
    say_unread(record)
    target = output or free_beside(record.path, suffix, overwrite=overwrite)
    with working(f"Drawing {record.path.name}"):
        truth = isiw.config.resume.truth_of(record)
        saved = save(record, target, truth=truth.window, overwrite=overwrite)
    show(f"{what}: {saved}")
    if truth.lacking:
        show(f"Drawn without it: {truth.lacking}", style="yellow")
    exit_if_damaged(record.losses)


@app.command(rich_help_panel=LOGS)
def exclude(
    log: Log, trial: Number, reason: Annotated[str, typer.Option(help="The reason, for readers of the log.")]
) -> None:
    """Exclude a trial afterwards. Nothing is erased; isiw estimate and isiw resume learn without it."""
    with errors_reported():
        isiw.exclude(log, trial, reason)
        show(f"Trial {trial} is excluded: {reason}")
        show(f"Estimate without it: {command('estimate', log)}")


@app.command(rich_help_panel=LOGS)
def include(log: Log, trial: Number) -> None:
    """Let an excluded trial count again; isiw estimate and isiw resume learn with it."""
    with errors_reported():
        isiw.include(log, trial)
        show(f"Trial {trial} counts again.")
        show(f"Estimate with it: {command('estimate', log)}")


@app.command(rich_help_panel=LOGS)
def estimate(log: Log) -> None:
    """Estimate again after trials were excluded or included, and append it to the log; needs no device."""
    with errors_reported():
        record = isiw.read_session(log)
        if record.is_judged_since:
            with counting("Learning", len(record.table), "trial") as count:
                isiw.session.estimate_again(log, replayed=count)
            record = isiw.read_session(log)
        else:
            show("No trial was excluded or included since the last estimate.")
        show_statement(isiw.report.final_statement(record))
        exit_if_damaged(record.losses)


@app.command(rich_help_panel=LOGS)
def export(
    source: Annotated[Path, typer.Argument(help="A session's log, or a folder of logs.")],
    folder: Annotated[Path, typer.Argument(help="A new folder; nothing is replaced.")],
    to: Annotated[
        Literal["csv", "parquet", "bids"], typer.Option(help="Tables, or a BIDS data set with the sweeps.")
    ] = "csv",
    pseudonymise: Annotated[
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


@app.command(rich_help_panel=LOGS)
def compare(
    logs: Annotated[list[Path], typer.Argument(help="Logs; each is compared to the first.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Page (.html) or picture to write.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Compare the windows of sessions: of one person on several days, or of several people."""
    with errors_reported():
        with working(f"Comparing {counted(len(logs), 'session')}"):
            records = [isiw.read_session(log) for log in logs]
            table, differences = isiw.report.comparison.comparison_table(records), isiw.priors.differences(records)
        for record in records:
            say_unread(record)
        show(table)
        for difference in differences:
            show(isiw.report.comparison.comparison_sentence(difference), style="bold")
        if output is not None and output.suffix.lower() == ".html":
            show(f"page: {isiw.report.save_comparison(records, differences, output, overwrite=overwrite)}")
        elif output is not None:
            figure = isiw.plots.comparison_figure(records)
            show(f"picture: {isiw.plots.save_figure(figure, output, overwrite=overwrite)}")
        losses = [f"{record.path.name}: {loss}" for record in records for loss in record.losses]
        exit_if_damaged(losses)


@app.command(rich_help_panel=LOGS)
def correlate(
    log: Log,
    measured: Annotated[
        Path, typer.Argument(help="A log with the measured MEPs, such as that of a sweep over all ISIs.")
    ],
) -> None:
    """Correlate the estimated profile of a log with the mean MEPs by ISI of another one (Fig. 4.23)."""
    with errors_reported():
        records = [isiw.read_session(path, channels=()) for path in (log, measured)]
        for record in records:
            say_unread(record)
        show(isiw.report.comparison.correlation_sentence(*records), style="bold")
        exit_if_damaged([f"{record.path.name}: {loss}" for record in records for loss in record.losses])


@app.command(rich_help_panel=LOGS)
def counts(
    log: Log,
    threshold_mv: Annotated[
        float | None,
        typer.Option(help="What an MEP has to exceed to be a response [mV]; by default by the log's TMS alone."),
    ] = None,
    share: Annotated[float, typer.Option(help="The share of responses that an effective ISI exceeds.")] = 0.4,
) -> None:
    """Count the responses at each ISI, and name the effective ISIs: the dissertation's earlier definition (3.3.4)."""
    with errors_reported():
        record = isiw.read_session(log, channels=())
        say_unread(record)
        show(isiw.report.comparison.counts_table(record, threshold_mv, share))
        exit_if_damaged(record.losses)
