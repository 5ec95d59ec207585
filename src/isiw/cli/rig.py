"""The commands about a lab's own rig: a template for its device, and the check of a device."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import isiw
from isiw.cli.console import SESSIONS, errors_reported, show
from isiw.text.sanitize import command

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
        isiw.config.require_device(settings, config)
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
        for file in isiw.config.write_rig_template(folder):
            show(f"{file}")
        show(f"It runs as it is, on made-up EMG: {command('run', folder / 'session.toml')}", style="bold")
