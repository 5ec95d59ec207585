"""The command line. Everything else is loaded when a command runs, so that `--help` answers at once."""

from __future__ import annotations

import io
import sys
from typing import Annotated

import typer

import isiw
from isiw.cli import analyse, logs, session, study, tasks
from isiw.cli.console import SESSIONS, STUDIES, show

__all__ = ["app"]

app = typer.Typer(name="isiw", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
for commands in (session, tasks, analyse, logs, study):
    app.add_typer(commands.app)
app.add_typer(study.prior, name="prior", rich_help_panel=STUDIES)
app.add_typer(study.study, name="study", rich_help_panel=STUDIES)
app.add_typer(tasks.new, name="new", rich_help_panel=SESSIONS)


def _show_version(value: bool) -> None:  # noqa: FBT001 - as typer calls it
    if value:
        show(f"isiw {isiw.__version__}")
        raise typer.Exit


@app.callback()
def main(
    *,
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Find the inter-stimulus intervals at which a tap enhances the MEP, with as few stimuli as possible."""
    del version  # shown by its callback
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a sign that a terminal lacks must end no session
