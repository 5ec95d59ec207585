"""The commands about sessions, and the command line as a whole."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import isiw
from isiw.cli import interval, logs, prior, serve, study, threshold
from isiw.cli.console import NO_DEFAULT, NOT_OVER, Overwrite, errors_reported, exit_if_damaged, show, show_entry
from isiw.text.commands import command

if TYPE_CHECKING:
    from isiw.repeatability import TimingStudy
    from isiw.session.loop import Session
    from isiw.strategy.settings.described import DescribedSetting

__all__ = ["app"]

app = typer.Typer(
    name="isiw",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(prior.app, name="prior")
app.add_typer(study.app, name="study")
app.add_typer(serve.app)
app.add_typer(logs.app)
app.add_typer(interval.app)
app.add_typer(threshold.app)
new = typer.Typer(help="Write a template for your own rig.", no_args_is_help=True)
app.add_typer(new, name="new")

_INTERRUPTED = "Interrupted: the device is disarmed and the log is closed."

Log = Annotated[Path, typer.Argument(help="A session's log.", **NO_DEFAULT)]
Data = Annotated[Path | None, typer.Option(help="The folder with the recorded EMG.", **NO_DEFAULT)]
Live = Annotated[
    bool, typer.Option("--live", help="Show the session in the browser while it runs, and operate it there.")
]
Seed = Annotated[int | None, typer.Option(help="Seed of the person, the trials and the strategy.", **NO_DEFAULT)]


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


@app.command()
def run(  # noqa: PLR0913, PLR0917 - an option each
    config: Annotated[Path | None, typer.Argument(help="A configuration file (TOML).", **NO_DEFAULT)] = None,
    subject: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="How a person is simulated: simulated, or recorded (simulated MEPs in recorded EMG). The code of the "
            "person who is examined is visit.subject in CONFIG.",
            **NO_DEFAULT,
        ),
    ] = None,
    data: Data = None,
    strategy: Annotated[str | None, typer.Option(help="A name that isiw strategies lists.", **NO_DEFAULT)] = None,
    seed: Seed = None,
    log: Annotated[Path | None, typer.Option(help="The log's file; by default a new one in isiw-sessions.")] = None,
    lab: Annotated[
        Path | None, typer.Option("--prior", help="A lab's prior, as isiw prior learn writes it.", **NO_DEFAULT)
    ] = None,
    after: Annotated[
        list[Path] | None,
        typer.Option(help="The log of an earlier session of the same person; repeat it for several, earliest first."),
    ] = None,
    day: Annotated[
        int | None, typer.Option(help="The number of the person's visit, for the log.", **NO_DEFAULT)
    ] = None,
    operator: Annotated[str | None, typer.Option(help="Who runs the session, for the log.", **NO_DEFAULT)] = None,
    live: Live = False,  # noqa: FBT002 - a flag of the command line
) -> None:
    """Run a session with a simulated person, or with the device of a configuration, and say what was found."""
    with errors_reported():
        settings = isiw.config.load_config(config).with_overrides(
            seed=seed,
            log=log,
            subject=subject,
            data=data,
            strategy=strategy,
            prior=lab,
            after=after,
            day=day,
            operator=operator,
        )
        _run_to_the_end(isiw.config.session_for(settings), config, live=live)


@app.command()
def resume(
    log: Log,
    config: Annotated[
        Path | None,
        typer.Argument(help="The configuration with your device; without it, the simulated person of the log is used."),
    ] = None,
    data: Data = None,
    lost_pulses: Annotated[
        int | None,
        typer.Option(help="If the end of the log is missing: how many delivered pulses are not in it.", **NO_DEFAULT),
    ] = None,
    verify: Annotated[bool, typer.Option(help="Check that the strategy chooses the same ISIs as in the log.")] = True,  # noqa: FBT002 - a flag of the command line
    live: Live = False,  # noqa: FBT002 - a flag of the command line
) -> None:
    """Continue an interrupted session, with its own ISI range and strategy, within the limits in CONFIG."""
    with errors_reported():
        record = isiw.config.read_to_resume(log, config)
        settings = isiw.config.load_config(config) if config else isiw.config.config_of_log(record)
        isiw.config.require_same_person(settings, [record])
        changes = isiw.config.changes_on_resume(settings, record) if config else {}
        device = isiw.config.device_for(settings.with_overrides(data=data))
        session = isiw.resume(log, device, lost_pulses=lost_pulses, verify=verify, **changes)
        for difference in isiw.config.differences_on_resume(settings, record) if config else ():
            show(difference, style="yellow", stderr=True)
        _run_to_the_end(session, config, live=live, resumed=True)


@app.command()
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
        device, space = isiw.config.device_for(settings), settings.space.design()
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


@app.command("show")
def show_log(log: Log) -> None:
    """Say who, when and with what, list the trials, and say what was found; works on a damaged log, too."""
    with errors_reported():
        record = isiw.read_session(log)
        for fact in isiw.report.first_facts(record):
            show(f"{fact.name + ':':10}{fact.value}")
        show("")
        for row in (isiw.report.TRIAL_HEADINGS, *isiw.report.trial_rows(record)):
            show(isiw.session.aligned(row))
        for event in record.events:
            when = "no trial" if event.trial is None else f"trial {event.trial}"
            show(f"{event.kind} ({when}): {event.text}")
        show(isiw.report.final_statement(record), style="bold")
        exit_if_damaged(record.losses)


@app.command()
def plot(
    log: Log,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="The picture's file: .png, .pdf, .svg …; by default beside the log.", **NO_DEFAULT
        ),
    ] = None,
    overwrite: Overwrite = False,  # noqa: FBT002 - a flag of the command line
) -> None:
    """Draw a session: profile, trials, window, and how the edges developed."""
    with errors_reported():
        record = isiw.read_session(log)
        truth = isiw.config.true_window(record)
        target = output or _free_beside(record.path, ".png")
        show(f"picture: {isiw.plots.save_session_plot(record, target, truth=truth, overwrite=overwrite)}")
        exit_if_damaged(record.losses)


@app.command()
def report(
    log: Log,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The page's file; by default beside the log.", **NO_DEFAULT)
    ] = None,
    overwrite: Overwrite = False,  # noqa: FBT002 - a flag of the command line
) -> None:
    """Write a page about a session: what was found and how, trial by trial, for any browser, without a network."""
    with errors_reported():
        record = isiw.read_session(log)
        truth = isiw.config.true_window(record)
        target = output or _free_beside(record.path, ".html")
        show(f"report: {isiw.report.save_report(record, target, truth=truth, overwrite=overwrite)}")
        exit_if_damaged(record.losses)


@app.command()
def exclude(
    log: Log,
    trial: Annotated[int, typer.Argument(help="The trial's number, as in isiw show.")],
    reason: Annotated[str, typer.Option(help="The reason, for readers of the log.")],
) -> None:
    """Exclude a trial afterwards. Nothing is erased; a resumed session learns without it."""
    with errors_reported():
        isiw.exclude(log, trial, reason)
        show(f"Trial {trial} is excluded: {reason}")


@app.command()
def include(
    log: Log,
    trial: Annotated[int, typer.Argument(help="The trial's number, as in isiw show.")],
) -> None:
    """Let an excluded trial count again; a resumed session learns with it."""
    with errors_reported():
        isiw.include(log, trial)
        show(f"Trial {trial} counts again.")


@app.command()
def strategies(
    name: Annotated[str | None, typer.Argument(help="A strategy's name: list its settings.", **NO_DEFAULT)] = None,
) -> None:
    """List the named strategies and what each does, or the settings of one."""
    if name is None:
        for known, summary in isiw.list_strategies().items():
            show(f"{known:18}{summary}")
        return
    with errors_reported():
        settings = isiw.list_settings(name)
        show(f"{isiw.list_strategies()[name]} Its settings:\n")
        for setting in settings:
            show_entry(_heading(setting), setting.meaning)


@app.command()
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
        study = _timing_study(source, taps, seed)
        show(isiw.repeatability.timing_report(study))
        if output is not None:
            show(f"picture: {isiw.plots.save_timing_plot(study, output, overwrite=overwrite)}")


def _timing_study(source: str, taps: int, seed: int) -> TimingStudy:
    if _is_log(source):
        return isiw.repeatability.study_session(isiw.read_session(source))
    if any(sign in source for sign in "./\\"):
        raise isiw.errors.LogError("there is no such log", got=source, remedy="Give the path of a session's log.")
    if source == "vane":
        return isiw.repeatability.study_vane(rotations=taps, seed=seed)
    return isiw.repeatability.study_preset(source, taps=taps, seed=seed)


def _heading(setting: DescribedSetting) -> str:
    """A setting with its value as a configuration has it, or the name of a group."""
    if setting.group:
        return setting.key
    if setting.value is None:
        return f"{setting.key}  # not set"
    comment = "; ".join(filter(None, (setting.unit, ", ".join(setting.parts))))
    return f"{setting.key} = {_inline(setting.value)}{f'  # {comment}' if comment else ''}"


def _inline(value: Any) -> str:
    """A value as TOML has it on one line."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_inline(inner)}' for key, inner in value.items() if inner is not None)} }}"
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_inline, value))}]"
    return json.dumps(value)


def _is_log(source: str) -> bool:
    """Whether there is a log of this name, closed or not."""
    closed = source.removesuffix(".part")
    return Path(closed).is_file() or Path(f"{closed}.part").is_file()


def _run_to_the_end(session: Session, config: Path | None, *, live: bool, resumed: bool = False) -> None:
    if session.log_path.suffix.lower() == ".png":
        raise isiw.errors.ConfigError(
            "the log would be overwritten by its picture", got=str(session.log_path), expected=".mcap"
        )
    if session.log_path.name.startswith("-"):
        raise isiw.errors.ConfigError(
            "a log's name cannot begin like an option", got=str(session.log_path), remedy="Give --log a file's name."
        )
    before, ours = len(session.trials), resumed or not _is_log(str(session.log_path))
    try:
        with errors_reported(_INTERRUPTED), _shown_live(session) if live else nullcontext():
            show(f"log: {session.log_path}")
            result = session.run(progress=True)
    except BaseException as end:
        delivered, refused = len(session.trials) > before, isinstance(end.__cause__, isiw.errors.DeviceError)
        if delivered or (refused and ours and _is_log(str(session.log_path))):
            for line in isiw.config.after_error(session, config, end.__cause__, delivered=delivered):
                show(line)
        raise
    record = isiw.read_session(result.log)
    truth = isiw.config.true_window(record)
    show(f"\n{isiw.report.final_statement(record, config)}", style="bold")
    if isiw.config.has_truth(record):
        show(isiw.report.truth_sentence(record, truth))
    show(f"log:     {result.log}")
    try:
        picture = isiw.plots.save_session_plot(record, _free_beside(result.log, ".png"), truth=truth)
        show(f"picture: {picture}")
    except OSError as error:
        later = command("plot", result.log)
        show(f"The picture cannot be written ({error.strerror}). The log is complete; draw it later with: {later}")
    if not result.decision.stop:
        raise typer.Exit(NOT_OVER)
    more = isiw.config.after_end(session, config, delivered=len(session.trials) > before)
    if more is not None:
        show(more)


@contextmanager
def _shown_live(session: Session) -> Iterator[None]:
    """Within, the session has a page in the browser."""
    with isiw.watch(session) as page:
        show(f"live page: {page.url}", style="bold")
        yield


def _free_beside(log: Path, suffix: str) -> Path:
    """Where a file of a session goes that nobody gave a place: beside its log, under a name that is free."""
    stem = Path(log.name.removesuffix(".part")).stem
    names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
    return next(path for path in (log.with_name(f"{name}{suffix}") for name in names) if not path.exists())
