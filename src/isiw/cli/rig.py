"""The commands about a rig: a template for its device, the check of a device, and how repeatable taps are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import isiw
from isiw.cli.console import NO_DEFAULT, SESSIONS, Overwrite, counting, errors_reported, log_exists, show
from isiw.text.sanitize import command

if TYPE_CHECKING:
    from isiw.dissertation.repeatability import TimingStudy

app = typer.Typer()
new = typer.Typer(help="Write a template for your own rig.", no_args_is_help=True)


@app.command(rich_help_panel=SESSIONS)
def check(
    config: Annotated[Path, typer.Argument(help="The configuration with your device.")],
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before stimulating.")] = False,  # noqa: FBT002 - a flag of the command line
) -> None:
    """Check a device, with the coil on a phantom: what it delivers, and whether a session can use it. It stimulates.

    The limits of CONFIG hold, as in a session.
    """
    with errors_reported("Interrupted: the device is disarmed."):
        settings = isiw.config.load_config(config)
        isiw.config.session.require_device(settings, config)
        device, space = isiw.config.device_for(settings), settings.design()
        if not (yes or device.describe().simulated):
            typer.confirm("The check stimulates. Is the coil on a phantom?", abort=True)
        try:
            isiw.testing.check_device(
                lambda: isiw.config.device_for(settings),
                space,
                iti_s=settings.limits.min_iti_s,
                limits=isiw.config.limits_for(settings),
                timeout_s=settings.timeout_s,
                signals=settings.signals,
                say=show,
            )
        except AssertionError as broken:
            show(f"{broken}", style="red", stderr=True)
            raise typer.Exit(1) from broken
        show("The device passed the check.", style="bold")


@new.command("rig")
def new_rig(
    folder: Annotated[Path, typer.Argument(help="The folder to write to; by default the current one.")] = Path(),
) -> None:
    """Write a commented starting point for your own rig: device, configuration and test."""
    with errors_reported():
        for file in isiw.config.session.write_rig_template(folder):
            show(f"{file}")
        show(f"It runs as it is, on made-up EMG: {command('run', folder / 'session.toml')}", style="bold")


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
            show(f"picture: {isiw.plots.save_figure(isiw.plots.timing_figure(study), output, overwrite=overwrite)}")


def _timing_study(source: str, taps: int, seed: int) -> TimingStudy:
    if log_exists(source):
        return isiw.repeatability.study_session(isiw.read_session(source))
    if any(sign in source for sign in "./\\"):
        raise isiw.errors.LogError("there is no such log", got=source, remedy="Give the path of a session's log.")
    if source == "vane":
        return isiw.repeatability.study_vane(rotations=taps, seed=seed)
    with counting("Simulating", taps * len(isiw.repeatability.STUDY_ISI_MS), "tap") as count:
        return isiw.repeatability.study_preset(source, taps=taps, seed=seed, on_done=count)
