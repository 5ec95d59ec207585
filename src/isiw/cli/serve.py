"""The command that serves sessions to a lab's own software."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

import isiw
from isiw.cli.console import NO_DEFAULT, SESSIONS, errors_reported, show

app = typer.Typer()

TOKEN = "ISIW_TOKEN"  # noqa: S105 - the variable's name


@app.command(rich_help_panel=SESSIONS)
def serve(
    folder: Annotated[Path, typer.Argument(help="The folder for the logs; created if missing.", **NO_DEFAULT)],
    host: Annotated[str, typer.Option(help="The address to listen on; any but 127.0.0.1 needs TLS.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The port; 0 for any that is free.")] = 8473,
    token_file: Annotated[
        Path | None,
        typer.Option(
            help=f"A file with the token; by default the token is {TOKEN} from the environment, or a random one.",
            **NO_DEFAULT,
        ),
    ] = None,
    certificate: Annotated[Path | None, typer.Option(help="A TLS certificate (PEM).", **NO_DEFAULT)] = None,
    key: Annotated[Path | None, typer.Option(help="Its key (PEM).", **NO_DEFAULT)] = None,
) -> None:
    """Serve sessions over HTTP to MATLAB, LabVIEW or any other software of this computer."""
    with errors_reported("The server has ended; its sessions can be resumed."):
        show("isiw serve starts …", stderr=True)  # standard output begins with the address
        given = _token(token_file) if token_file else os.environ.get(TOKEN)
        settings = isiw.server.ServerSettings(
            folder, host, port, certificate=certificate, key=key, **({} if given is None else {"token": given})
        )

        def ready(url: str) -> None:
            show(f"Ready: isiw serves the sessions of {folder} at {url}", style="bold")
            show("token: as given" if given is not None else f"token: {settings.token}")

        isiw.server.serve(settings, ready)


def _token(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8-sig").strip()  # with the mark that Windows puts first
    except UnicodeDecodeError as error:
        raise isiw.errors.ConfigError(
            "the token file is not text", got=str(file), remedy="Write the token into a file of its own."
        ) from error
