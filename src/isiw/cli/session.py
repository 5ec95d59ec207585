"""The commands that run and serve sessions, and the end of a session on the command line."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import isiw
from isiw.cli.console import (
    NOT_OVER,
    SESSIONS,
    counting,
    errors_reported,
    free_beside,
    log_exists,
    show,
    show_statement,
)
from isiw.text.sanitize import command

if TYPE_CHECKING:
    from isiw.config import RunConfig
    from isiw.devices.protocol import Device
    from isiw.log.record import SessionRecord
    from isiw.session.loop import Session
    from isiw.window import Window

app = typer.Typer()

_INTERRUPTED = "Interrupted: the device is disarmed and the log is closed."

Data = Annotated[Path | None, typer.Option(help="The folder with the recorded EMG.")]
Day = Annotated[int | None, typer.Option(help="The number of the person's visit, for the log.")]
Earlier = Annotated[
    list[Path] | None,
    typer.Option(
        help="The log of an earlier session of the same person, or of the search for the threshold just before, whose "
        "pulses teach the recruitment curve; repeat it for several, earliest first. With the strategy supra-threshold, "
        "of a session below the threshold, about whose window it looks."
    ),
]
NewLog = Annotated[Path | None, typer.Option(help="The log's file; by default a new one in isiw-sessions.")]
Operator = Annotated[str | None, typer.Option(help="Who runs the session, for the log.")]
Live = Annotated[
    bool, typer.Option("--live", help="Show the session in the browser while it runs, and operate it there.")
]


@app.command(rich_help_panel=SESSIONS)
def run(
    config: Annotated[Path | None, typer.Argument(help="A configuration file (TOML).")] = None,
    subject: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="How a person is simulated: simulated, or recorded (simulated MEPs in recorded EMG). The code of the "
            "person who is examined is visit.subject in CONFIG.",
        ),
    ] = None,
    data: Data = None,
    strategy: Annotated[str | None, typer.Option(help="A name that isiw strategies lists.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the person, the trials and the strategy.")] = None,
    log: NewLog = None,
    lab: Annotated[Path | None, typer.Option("--prior", help="A lab's prior, as isiw prior learn writes it.")] = None,
    after: Earlier = None,
    earlier: Annotated[
        list[Path] | None,
        typer.Option(
            help="A log of earlier trials of this visit, such as isiw analyse writes, or a table (.csv) of pulses of "
            "TMS alone, with the columns intensity_pct_rmt and mep_mv; repeat it for several."
        ),
    ] = None,
    day: Day = None,
    operator: Operator = None,
    live: Live = False,
) -> None:
    """Run a session with a simulated person, or with the device of a configuration, and say what was found."""
    with errors_reported():
        settings = _settings(
            config,
            seed=seed,
            log=log,
            subject=subject,
            data=data,
            strategy=strategy,
            prior=lab,
            after=after,
            earlier=earlier,
            day=day,
            operator=operator,
        )
        show(isiw.config.session.assumed_space(settings) or "Preparing the session …")
        session = isiw.config.session_for(settings)
        if imported := isiw.config.given.given_before(settings).sentence(settings):
            show(imported)
        _run_to_the_end(session, config, live=live)


@app.command(rich_help_panel=SESSIONS)
def pair(
    config: Annotated[Path | None, typer.Argument(help="A configuration with the section of an intervention.")] = None,
    after: Annotated[
        Path | None, typer.Option(help="The log of the search, of the same visit, that found the window.")
    ] = None,
    log: NewLog = None,
    day: Day = None,
    operator: Operator = None,
    live: Live = False,
    opens: Annotated[
        Path | None,
        typer.Option("--open", metavar="LOG", help="Say which arm a log is of; the log keeps that it was opened."),
    ] = None,
) -> None:
    """Use a window: pulses of TMS alone, pairs at the best ISI, and pulses again, as its configuration plans it.

    Continue one that was interrupted with isiw resume; one that its operator has ended is over.
    """
    with errors_reported():
        if opens is not None:
            show(f"The arm is {isiw.session.open_arm(opens).words}. The log keeps that it was opened.")
            return
        if config is None:
            raise isiw.errors.ConfigError(
                "an intervention needs a configuration that plans it", remedy="isiw pair CONFIG --after WINDOW_LOG"
            )
        settings = _settings(config, log=log, earlier=None if after is None else [after], day=day, operator=operator)
        show("Preparing the intervention …")
        _run_to_the_end(isiw.config.session.intervention_for(settings), config, live=live)


@app.command(rich_help_panel=SESSIONS)
def resume(
    log: Annotated[Path, typer.Argument(help="A session's log.")],
    config: Annotated[
        Path | None,
        typer.Argument(help="The configuration with your device; without it, the simulated person of the log is used."),
    ] = None,
    data: Data = None,
    lost_pulses: Annotated[
        int | None, typer.Option(help="If the end of the log is missing: how many delivered pulses are not in it.")
    ] = None,
    verify: Annotated[bool, typer.Option(help="Check that the strategy chooses the same ISIs as in the log.")] = True,
    live: Live = False,
) -> None:
    """Continue an interrupted session, with its own ISI range and strategy, within the limits in CONFIG."""
    with errors_reported():
        record = isiw.config.resume.read_to_resume(log, config)
        changes: dict[str, Any] = {}
        differences: tuple[str, ...] = ()
        if config is None:  # then only what the log says of a simulated person, which names nothing to import or open
            device: Device = isiw.config.resume.device_of_log(record, data)
        else:
            settings = isiw.config.load_config(config)
            isiw.config.session.require_same_person(settings, [record])
            changes = isiw.config.resume.changes_on_resume(settings, record)
            differences = isiw.config.resume.differences_on_resume(settings, record)
            device = isiw.config.device_for(settings.with_overrides(data=data))
        with counting("Replaying", len(record.table), "trial") as count:
            session = isiw.resume(log, device, lost_pulses=lost_pulses, verify=verify, replayed=count, **changes)
        for difference in differences:
            show(difference, style="yellow", stderr=True)
        _run_to_the_end(session, config, live=live, resumed=True)


def _settings(config: Path | None, **said: Any) -> RunConfig:
    """A configuration with what options say, of which it is said if it takes the place of files."""
    stated = isiw.config.load_config(config)
    settings = stated.with_overrides(**said)
    if left_out := isiw.config.session.left_out(stated, settings):
        show(left_out, style="yellow", stderr=True)
    return settings


def _run_to_the_end(session: Session, config: Path | None, *, live: bool, resumed: bool = False) -> None:
    if session.log_path.suffix.lower() == ".png":
        raise isiw.errors.ConfigError(
            "the log would be overwritten by its picture", got=str(session.log_path), expected=".mcap"
        )
    if session.log_path.name.startswith("-"):
        raise isiw.errors.ConfigError(
            "a log's name cannot begin like an option", got=str(session.log_path), remedy="Give --log a file's name."
        )
    before, ours = len(session.trials), resumed or not log_exists(session.log_path)
    try:
        with errors_reported(_INTERRUPTED), _shown_live(session, config) if live else nullcontext():
            session.require_effect()
            show(f"log: {session.log_path}")
            result = session.run(progress=True)
    except BaseException as end:
        delivered, refused = len(session.trials) > before, isinstance(end.__cause__, isiw.errors.DeviceError)
        if delivered or (refused and ours and log_exists(session.log_path)):
            for line in isiw.config.resume.after_error(session, config, end.__cause__, delivered=delivered):
                show(line)
        raise
    record = isiw.read_session(result.log)
    truth = isiw.config.resume.truth_of(record)
    show("")
    show_statement(isiw.report.final_statement(record, config))
    if truth.known:
        show(isiw.report.words.truth_sentence(record, truth.window))
    show(f"log:     {result.log}")
    if not record.conceals:
        _draw(record, truth.window)
    if not result.decision.stop:
        raise typer.Exit(NOT_OVER)
    more = isiw.config.resume.after_end(session, config, delivered=len(session.trials) > before)
    if more is not None:
        show(more)


def _draw(record: SessionRecord, truth: Window | None) -> None:
    """Draw a session beside its log, and say where."""
    try:
        show(f"picture: {isiw.plots.save_session_plot(record, free_beside(record.path, '.png'), truth=truth)}")
    except OSError as error:
        later = command("plot", record.path)
        show(f"The picture cannot be written ({error.strerror}). The log is complete; draw it later with: {later}")


@contextmanager
def _shown_live(session: Session, config: Path | None) -> Iterator[None]:
    """Within, the session has a page in the browser."""
    with isiw.watch(session, config=config) as page:
        show(f"live page: {page.url}", style="bold")
        yield


TOKEN = "ISIW_TOKEN"  # noqa: S105 - the variable's name


@app.command(rich_help_panel=SESSIONS)
def serve(
    folder: Annotated[Path, typer.Argument(help="The folder for the logs; created if missing.")],
    host: Annotated[str, typer.Option(help="The address to listen on; any but 127.0.0.1 needs TLS.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The port; 0 for any that is free.")] = 8473,
    token_file: Annotated[
        Path | None,
        typer.Option(
            help=f"A file with the token; by default the token is {TOKEN} from the environment, or a random one."
        ),
    ] = None,
    certificate: Annotated[Path | None, typer.Option(help="A TLS certificate (PEM).")] = None,
    key: Annotated[Path | None, typer.Option(help="Its key (PEM).")] = None,
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
