"""The command about the motor threshold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

import isiw
from isiw.cli.console import NO_DEFAULT, SESSIONS, errors_reported, exit_if_damaged, refuse_ignored, show
from isiw.text.sanitize import counted

if TYPE_CHECKING:
    from isiw.session import ThresholdRecorder

app = typer.Typer()


@app.command(rich_help_panel=SESSIONS)
def threshold(  # noqa: PLR0913, PLR0917 - an option each
    log: Annotated[Path, typer.Argument(help="The log: a new file, unless --resume or --show is given.", **NO_DEFAULT)],
    by_hand: Annotated[  # noqa: FBT002 - a flag
        bool, typer.Option("--by-hand", help="A real person: you set the stimulator, and type each result.")
    ] = False,
    high: Annotated[
        float | None,
        typer.Option(help="The highest intensity [% MSO]; --by-hand needs it, else it is 100.", **NO_DEFAULT),
    ] = None,
    low: Annotated[float | None, typer.Option(help="The lowest intensity [% MSO]; default 20.", **NO_DEFAULT)] = None,
    step: Annotated[
        float | None, typer.Option(help="The step between intensities [% MSO]; default 1.", **NO_DEFAULT)
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="bayes (default), maximum-likelihood, five-of-ten; or hot-spot, which says where to hold the coil.",
            **NO_DEFAULT,
        ),
    ] = None,
    enough: Annotated[
        int | None,
        typer.Option(help="five-of-ten: how many of ten suffice; default 5, and 6 for more than five.", **NO_DEFAULT),
    ] = None,
    max_pulses: Annotated[
        int | None, typer.Option(help="Largest number of pulses, including lost ones; default 100.", **NO_DEFAULT)
    ] = None,
    min_iti_s: Annotated[
        float | None, typer.Option(help="Shortest time between two pulses, in seconds; default 5.", **NO_DEFAULT)
    ] = None,
    subject: Annotated[str | None, typer.Option(help="The person's code, for the log.", **NO_DEFAULT)] = None,
    cohort: Annotated[
        str | None,
        typer.Option(help="The cohort that a simulated person comes from; default recruitment.", **NO_DEFAULT),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the simulated person; default 0.", **NO_DEFAULT)] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the log, as it was begun.")] = False,  # noqa: FBT002 - a flag
    show_only: Annotated[bool, typer.Option("--show", help="Only say what the log holds.")] = False,  # noqa: FBT002 - a flag
) -> None:
    """Find the resting motor threshold, or the hot spot, of a simulated person, or by hand with a real stimulator."""
    settings: dict[str, Any] = {
        "method": method,
        "enough": enough,
        "high": high,
        "low": low,
        "step": step,
        "cohort": cohort,
        "seed": seed,
    }
    settings |= {"max_pulses": max_pulses, "min_iti_s": min_iti_s, "subject": subject}
    with errors_reported(f"Interrupted. The log is safe; resume with: {_resuming(log)}"):
        if resume or show_only:
            refuse_ignored("a search keeps what its log says", **settings)
        if by_hand:
            refuse_ignored("nobody is simulated if a stimulator is set by hand", cohort=cohort, seed=seed)
        if not show_only:
            given = {name: value for name, value in settings.items() if value is not None}
            recorder = isiw.session.resume_threshold(log) if resume else _begun(log, by_hand=by_hand, **given)
            try:
                _run(recorder)
            except isiw.errors.LimitExceededError:
                _say_what_is_there(log)
                raise
        _say_what_is_there(log)


def _begun(  # noqa: PLR0913 - an option each
    log: Path,
    *,
    by_hand: bool,
    method: str = "bayes",
    enough: int | None = None,
    high: float | None = None,
    low: float = 20.0,
    step: float = 1.0,
    cohort: str = "recruitment",
    seed: int = 0,
    **options: Any,
) -> ThresholdRecorder:
    if by_hand and high is None:
        raise isiw.errors.ConfigError(
            "the highest intensity is missing", remedy="Say with --high how far you may go with this person."
        )
    space = isiw.strategy.threshold.IntensityRange(low, 100.0 if high is None else high, step)
    own = {} if enough is None else {"enough": enough}
    search = isiw.strategy.threshold.make_threshold_search(method, space, **own)
    if by_hand:
        return isiw.session.open_threshold(search, log, **options)
    return isiw.session.open_simulated(search, log, cohort=cohort, seed=seed, **options)


def _resuming(log: Path) -> str:
    return isiw.session.LogKind.THRESHOLD.continued_by(log)


def _run(recorder: ThresholdRecorder) -> None:
    with recorder:
        if recorder.header.device.simulated:
            isiw.session.run_simulated(recorder, show)
        else:
            isiw.session.run_by_hand(recorder, _typed, show)


def _typed(question: str) -> str:
    """What is typed once it is asked for: what came before was not about this pulse."""
    isiw.session.terminal.drop_typed_ahead()
    return Console(highlight=False, markup=False).input(question)


def _say_what_is_there(log: Path) -> None:
    record = isiw.session.read_threshold(log)
    search = isiw.session.search_of(record)
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
    person = isiw.session.simulated_person(record.header)
    if person is not None:
        spot, whose = person.hot_spot, "The simulated person's true"
        if search.place_mm is None:
            show(f"{whose} threshold is {person.rmt_pct_mso:.1f} % MSO.")
        else:
            show(f"{whose} hot spot is {spot.x_mm:+.0f} mm forward and {spot.y_mm:+.0f} mm to the right.")
    show(f"{counted(given, 'pulse')}, learnt from {len(search.pulses)}. Log: {record.path}")
    exit_if_damaged(record.losses)
