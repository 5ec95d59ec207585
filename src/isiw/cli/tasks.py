"""The commands about a rig, the motor threshold, and manual interval production."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

import isiw
from isiw.cli.console import (
    SESSIONS,
    Overwrite,
    Picture,
    counting,
    errors_reported,
    exit_if_damaged,
    is_given,
    log_exists,
    refuse_ignored,
    show,
)
from isiw.text.sanitize import command, counted

if TYPE_CHECKING:
    from isiw.dissertation.interval import ProductionRecord
    from isiw.dissertation.repeatability import TimingStudy
    from isiw.session import ThresholdRecorder

app = typer.Typer()
new = typer.Typer(help="Write a template for your own rig.", no_args_is_help=True)

Code = Annotated[str, typer.Option(help="The person's code, for the log.")]


@app.command(rich_help_panel=SESSIONS)
def check(
    config: Annotated[Path, typer.Argument(help="The configuration with your device.")],
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before stimulating.")] = False,
) -> None:
    """Check a device, with the coil on a phantom: what it delivers, and whether a session can use it. It stimulates.

    The limits of CONFIG hold, as in a session.
    """
    with errors_reported("Interrupted: the device is disarmed."):
        settings = isiw.config.load_config(config)
        isiw.config.session.require_device(settings, config)
        device, space, said = isiw.config.device_for(settings), settings.design(), ""
        if not (yes or device.describe().simulated):
            said = isiw.testing.device_table.announcement(device, settings.limits.iti_s)
            show(said)
            typer.confirm("Is the coil on a phantom?", abort=True)
        try:
            isiw.testing.check_device(
                lambda: isiw.config.device_for(settings),
                space,
                iti_s=settings.limits.iti_s,
                limits=isiw.config.limits_for(settings),
                timeout_s=settings.timeout_s,
                signals=settings.signals,
                say=lambda text: None if text == said else show(text),
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
    source: Annotated[str, typer.Argument(help="A preset of the tapping robot, vane, or a session's log.")],
    taps: Annotated[int, typer.Option(help="Taps for each ISI of a preset; rotations of vane.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of a preset's taps.")] = 0,
    output: Picture = None,
    overwrite: Overwrite = False,
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


@app.command(rich_help_panel=SESSIONS)
def threshold(
    context: typer.Context,
    log: Annotated[Path, typer.Argument(help="The log: a new file, unless --resume or --show is given.")],
    by_hand: Annotated[
        bool, typer.Option("--by-hand", help="A real person: you set the stimulator, and type each result.")
    ] = False,
    high: Annotated[float, typer.Option(help="The highest intensity [% MSO]; --by-hand needs it.")] = 100.0,
    low: Annotated[float, typer.Option(help="The lowest intensity [% MSO].")] = 20.0,
    step: Annotated[float, typer.Option(help="The step between intensities [% MSO].")] = 1.0,
    method: Annotated[
        str,
        typer.Option(
            help="bayes, maximum-likelihood, five-of-ten; hot-spot, which says where to hold the coil; or curve, which "
            "asks for the intensities --at in an order by the seed."
        ),
    ] = "bayes",
    enough: Annotated[
        int | None, typer.Option(help="five-of-ten: how many of ten suffice; default 5, and 6 for more than five.")
    ] = None,
    at: Annotated[list[float] | None, typer.Option(help="curve: an intensity [% MSO]; repeat it for several.")] = None,
    each: Annotated[int | None, typer.Option(help="curve: pulses at each; default 5.")] = None,
    max_pulses: Annotated[int, typer.Option(help="Largest number of pulses, including lost ones.")] = 100,
    min_iti_s: Annotated[float, typer.Option(help="Shortest time between two pulses, in seconds.")] = 5.0,
    subject: Code = "",
    muscle: Annotated[
        str, typer.Option(help="Whose MEPs they are, as a session's configuration says under visit.")
    ] = "",
    cohort: Annotated[str, typer.Option(help="The cohort that a simulated person comes from.")] = "recruitment",
    seed: Annotated[int, typer.Option(help="Seed of the simulated person, and of the order of a curve.")] = 0,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the log, as it was begun.")] = False,
    show_only: Annotated[bool, typer.Option("--show", help="Only say what the log holds.")] = False,
) -> None:
    """Find the resting motor threshold, or the hot spot, of a simulated person, or by hand with a real stimulator."""
    with errors_reported(f"Interrupted. The log is safe; resume with: {_resuming(log)}"):
        _require_used(context, kept=resume or show_only, by_hand=by_hand)
        if resume:
            _run(isiw.session.resume_threshold(log), log)
        elif not show_only:
            space = isiw.strategy.threshold.IntensityRange(low, high, step)
            stated = {"enough": enough, "at_pct_mso": tuple(at or ()) or None, "each": each}
            own: dict[str, Any] = {name: value for name, value in stated.items() if value is not None}
            own |= {"seed": seed} if method == "curve" else {}
            search = isiw.strategy.threshold.make_threshold_search(method, space, **own)
            options: dict[str, Any] = {"subject": subject, "muscle": muscle, "min_iti_s": min_iti_s}
            options |= {"max_pulses": max_pulses}
            if by_hand:
                recorder = isiw.session.open_threshold(search, log, **options)
            else:
                recorder = isiw.studies.threshold.open_simulated(search, log, cohort=cohort, seed=seed, **options)
            _run(recorder, log)
        _say_what_is_there(log)


def _require_used(context: typer.Context, *, kept: bool, by_hand: bool) -> None:
    """Refuse options that would be ignored, and a search by hand without the highest intensity."""
    if kept:
        named = [name for name in context.params if name not in {"log", "by_hand", "resume", "show_only"}]
        refuse_ignored("a search keeps what its log says", context, *named)
    if by_hand:
        of_people = ("cohort",) if context.params["method"] == "curve" else ("cohort", "seed")
        refuse_ignored("nobody is simulated if a stimulator is set by hand", context, *of_people)
    for method, its in {"five-of-ten": ("enough",), "curve": ("at", "each")}.items():
        if not kept and context.params["method"] != method:
            refuse_ignored(f"an option is of --method {method} alone", context, *its)
    if by_hand and not kept and not is_given(context, "high"):
        raise isiw.errors.ConfigError(
            "the highest intensity is missing", remedy="Say with --high how far you may go with this person."
        )


def _resuming(log: Path) -> str:
    return isiw.log.LogKind.THRESHOLD.continued_by(log)


def _run(recorder: ThresholdRecorder, log: Path) -> None:
    try:
        with recorder:
            if recorder.header.device.simulated:
                isiw.studies.threshold.run_simulated(recorder, show)
            else:
                isiw.session.threshold_loops.run_by_hand(recorder, _typed, show)
    except isiw.errors.LimitExceededError:
        _say_what_is_there(log)
        raise


def _typed(question: str) -> str:
    """The answer to a question; what was typed before it was not about this pulse."""
    isiw.session.terminal.drop_typed_ahead()
    return Console(highlight=False, markup=False).input(question)


def _say_what_is_there(log: Path) -> None:
    record = isiw.session.read_threshold(log)
    search = isiw.session.threshold.search_of(record)
    decision = search.decision()
    given, most = record.given, record.header.max_pulses
    show(f"\n{search.estimate()}", style="bold")
    if decision.stop:
        show(f"Ended: {decision.reason}")
    elif given >= most:
        show(f"Ended by its limit of {counted(most, 'pulse')}. {decision.reason}")
        show("For more pulses begin a new log with --max-pulses.")
    else:
        show(f"Not over: {decision.reason} Resume with: {_resuming(log)}")
    person = isiw.studies.threshold.simulated_person(record.header)
    if person is not None:
        spot, whose = person.hot_spot, "The simulated person's true"
        if search.place_mm is None:
            show(f"{whose} threshold is {person.rmt_pct_mso:.1f} % MSO.")
        else:
            show(f"{whose} hot spot is {spot.x_mm:+.0f} mm forward and {spot.y_mm:+.0f} mm to the right.")
    show(f"{counted(given, 'pulse')}, learnt from {len(search.pulses)}. Log: {record.path}")
    exit_if_damaged(record.losses)


@app.command(rich_help_panel=SESSIONS)
def interval(
    context: typer.Context,
    log: Annotated[Path, typer.Argument(help="The log's file.")],
    session: Annotated[int, typer.Option(help="1: 300 ms. 2: 500 ms. 3: 300 ms with half the score.")] = 1,
    mode: Annotated[
        list[int] | None,
        typer.Option(
            help="Only this feedback: 1 score bar, 2 light, 3 produced time, 4 absolute error; may be repeated."
        ),
    ] = None,
    trials: Annotated[int, typer.Option(help="Trials in each mode.")] = 200,
    subject: Code = "",
    seed: Annotated[int, typer.Option(help="Seed of the lights.")] = 0,
    rest_s: Annotated[float, typer.Option(help="Seconds of rest between two modes.")] = 120.0,
    resume: Annotated[bool, typer.Option("--resume", help="Continue this log.")] = False,
    look: Annotated[bool, typer.Option("--show", help="Print what is in this log.")] = False,
) -> None:
    """Produce time intervals by two key presses, with feedback after each, at a terminal; see docs/interval.md."""
    way_on = isiw.log.LogKind.PRODUCTION.continued_by(log)
    with errors_reported(f"Interrupted. Every trial whose feedback was shown is kept; resume with: {way_on}"):
        if resume or look:
            named = ("session", "mode", "trials", "subject", "seed")
            refuse_ignored("a task keeps what its log says", context, *named)
        if look:
            _say(isiw.interval.read_productions(log))
        elif resume:
            _end(isiw.interval.resume_task(log, rest_s=rest_s))
        else:
            blocks = isiw.interval.session_blocks(session, mode or (), trials)
            _end(isiw.interval.run_task(log, blocks, subject=subject, seed=seed, rest_s=rest_s))


def _end(record: ProductionRecord) -> None:
    """Say how a task ended; a hidden target stays hidden while trials are left."""
    if record.left:
        way_on = isiw.log.LogKind.PRODUCTION.continued_by(record.path)
        show(f"{len(record.left)} trials are left; resume with: {way_on}", style="bold")
    else:
        _say(record)


def _say(record: ProductionRecord) -> None:
    header = record.header
    show(f"{header.subject or 'An unnamed subject'}, {header.created}", style="bold")
    show(record.table.to_string(index=False, float_format=lambda value: f"{value:.4g}") if len(record.table) else "")
    show(f"{len(record.productions)} trials, {len(record.left)} left. log: {record.path}")
    exit_if_damaged(record.losses)
