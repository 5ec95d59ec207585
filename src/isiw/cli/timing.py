"""The command about how repeatable taps are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import isiw
from isiw.cli.console import NO_DEFAULT, SESSIONS, Overwrite, counting, errors_reported, log_exists, show

if TYPE_CHECKING:
    from isiw.dissertation.repeatability import TimingStudy

app = typer.Typer()


@app.command(rich_help_panel=SESSIONS)
def timing(
    source: Annotated[
        str, typer.Argument(help="A preset of the tapping robot, vane, or a session's log.", **NO_DEFAULT)
    ],
    taps: Annotated[int, typer.Option(help="Taps for each ISI of a preset; rotations of vane.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of a preset's taps.")] = 0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Picture to draw.", **NO_DEFAULT)] = None,
    overwrite: Overwrite = False,  # noqa: FBT002 - a flag of the command line
) -> None:
    """Report how repeatable the taps are, or the rotations of the vane actuator: events, ISI errors, mistrials."""
    with errors_reported():
        show(f"Studying {source} …", stderr=True)
        study = _timing_study(source, taps, seed)
        show(isiw.repeatability.timing_report(study))
        if output is not None:
            show(f"picture: {isiw.plots.save_timing_plot(study, output, overwrite=overwrite)}")


def _timing_study(source: str, taps: int, seed: int) -> TimingStudy:
    if log_exists(source):
        return isiw.repeatability.study_session(isiw.read_session(source))
    if any(sign in source for sign in "./\\"):
        raise isiw.errors.LogError("there is no such log", got=source, remedy="Give the path of a session's log.")
    if source == "vane":
        return isiw.repeatability.study_vane(rotations=taps, seed=seed)
    with counting("Simulating", taps * len(isiw.repeatability.STUDY_ISI_MS), "tap") as count:
        return isiw.repeatability.study_preset(source, taps=taps, seed=seed, on_done=count)
