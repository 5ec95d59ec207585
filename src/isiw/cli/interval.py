"""The command about manual interval production."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import isiw
from isiw.cli.console import NO_DEFAULT, SESSIONS, errors_reported, exit_if_damaged, refuse_ignored, show

if TYPE_CHECKING:
    from isiw.dissertation.interval import ProductionRecord

app = typer.Typer()


@app.command(rich_help_panel=SESSIONS)
def interval(  # noqa: PLR0913, PLR0917 - an option each
    log: Annotated[Path, typer.Argument(help="The log's file.", **NO_DEFAULT)],
    session: Annotated[
        int | None,
        typer.Option(help="1: 300 ms. 2: 500 ms. 3: 300 ms with half the score. By default 1.", **NO_DEFAULT),
    ] = None,
    mode: Annotated[
        list[int] | None,
        typer.Option(
            help="Only this feedback: 1 score bar, 2 light, 3 produced time, 4 absolute error; may be repeated."
        ),
    ] = None,
    trials: Annotated[int | None, typer.Option(help="Trials in each mode; by default 200.", **NO_DEFAULT)] = None,
    subject: Annotated[str | None, typer.Option(help="The person's code, for the log.", **NO_DEFAULT)] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the lights; default 0.", **NO_DEFAULT)] = None,
    rest_s: Annotated[float, typer.Option(help="Seconds of rest between two modes.")] = 120.0,
    resume: Annotated[bool, typer.Option("--resume", help="Continue this log.")] = False,  # noqa: FBT002 - a flag
    look: Annotated[bool, typer.Option("--show", help="Print what is in this log.")] = False,  # noqa: FBT002 - a flag
) -> None:
    """Produce time intervals by two key presses, with feedback after each, at a terminal; see docs/interval.md."""
    with errors_reported(f"Interrupted. Every trial whose feedback was shown is kept; resume with: {_way_on(log)}"):
        if resume or look:
            refuse_ignored(
                "a task keeps what its log says", session=session, mode=mode, trials=trials, subject=subject, seed=seed
            )
        if look:
            _say(isiw.interval.read_productions(log))
        elif resume:
            _end(isiw.interval.resume_task(log, rest_s=rest_s))
        else:
            blocks = isiw.interval.session_blocks(
                1 if session is None else session, mode or (), 200 if trials is None else trials
            )
            _end(isiw.interval.run_task(log, blocks, subject=subject or "", seed=seed or 0, rest_s=rest_s))


def _way_on(log: Path) -> str:
    return isiw.session.LogKind.PRODUCTION.continued_by(log)


def _end(record: ProductionRecord) -> None:
    """What is said at the end; a hidden target stays hidden while trials are left."""
    if record.left:
        show(f"{len(record.left)} trials are left; resume with: {_way_on(record.path)}", style="bold")
    else:
        _say(record)


def _say(record: ProductionRecord) -> None:
    header = record.header
    show(f"{header.subject or 'An unnamed subject'}, {header.created}", style="bold")
    show(record.table.to_string(index=False, float_format=lambda value: f"{value:.4g}") if len(record.table) else "")
    show(f"{len(record.productions)} trials, {len(record.left)} left. log: {record.path}")
    exit_if_damaged(record.losses)
