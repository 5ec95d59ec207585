"""The command about the motor threshold."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

import isiw
from isiw.cli.console import DAMAGED, NO_DEFAULT, errors_reported, show

if TYPE_CHECKING:
    from isiw.session import ThresholdRecorder

__all__ = ["app"]

app = typer.Typer()


@app.command()
def threshold(  # noqa: PLR0913, PLR0917 - an option each
    log: Annotated[Path, typer.Argument(help="The log: a new file, unless --resume or --show is given.", **NO_DEFAULT)],
    by_hand: Annotated[  # noqa: FBT002 - a flag
        bool, typer.Option("--by-hand", help="A real person: you set the stimulator, and type what came of it.")
    ] = False,
    high: Annotated[
        float | None,
        typer.Option(help="The highest intensity [% MSO]; --by-hand needs it, else it is 100.", **NO_DEFAULT),
    ] = None,
    low: Annotated[float, typer.Option(help="The lowest intensity [% MSO].")] = 20.0,
    step: Annotated[float, typer.Option(help="The step between intensities [% MSO].")] = 1.0,
    method: Annotated[str, typer.Option(help="bayes, maximum-likelihood or five-of-ten.")] = "bayes",
    max_pulses: Annotated[int, typer.Option(help="Most pulses, lost ones included.")] = 100,
    min_iti_s: Annotated[float, typer.Option(help="Shortest time between two pulses [s].")] = 5.0,
    subject: Annotated[str, typer.Option(help="The person's code, for the log.", **NO_DEFAULT)] = "",
    cohort: Annotated[str, typer.Option(help="Of a simulated person: whose recruitment curve.")] = "recruitment",
    seed: Annotated[int, typer.Option(help="Of a simulated person.")] = 0,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the log, as it was begun.")] = False,  # noqa: FBT002 - a flag
    show_only: Annotated[bool, typer.Option("--show", help="Only say what the log holds.")] = False,  # noqa: FBT002 - a flag
) -> None:
    """Find the resting motor threshold of a simulated person, or of a person whose stimulator you set by hand."""
    with errors_reported(f"Interrupted. The log is safe; go on with: isiw threshold {log} --resume"):
        if show_only:
            _say_what_is_there(log)
            return
        if by_hand and high is None and not resume:
            raise isiw.errors.ConfigError(
                "the highest intensity is missing", remedy="Say with --high how far you may go with this person."
            )

        def opened() -> ThresholdRecorder:
            if resume:
                return isiw.session.resume_threshold(log)
            space = isiw.strategy.threshold.IntensityRange(low, 100.0 if high is None else high, step)
            search = isiw.strategy.threshold.make_threshold_search(method, space)
            options: dict[str, Any] = {"min_iti_s": min_iti_s, "max_pulses": max_pulses, "subject": subject}
            if by_hand:
                return isiw.session.open_threshold(search, log, **options)
            return isiw.session.open_simulated(search, log, cohort=cohort, seed=seed, **options)

        _run(opened)
        _say_what_is_there(log)


def _run(opened: Callable[[], ThresholdRecorder]) -> None:
    with opened() as recorder:
        if recorder.header.device.simulated:
            isiw.session.run_simulated(recorder, show)
        else:
            isiw.session.run_by_hand(recorder, Console(highlight=False, markup=False).input, show)


def _say_what_is_there(log: Path) -> None:
    record = isiw.session.read_threshold(log)
    search = isiw.session.search_of(record)
    decision = search.decision()
    show(f"\n{search.estimate()}", style="bold")
    show(f"{'Ended' if decision.stop else 'Not over'}: {decision.reason}")
    person = isiw.session.simulated_person(record.header)
    if person is not None:
        show(f"The simulated person's true threshold is {person.rmt_pct_mso:.1f} % MSO.")
    show(f"{len(record.intents)} pulses, {len(search.pulses)} of them count. Log: {record.path}")
    for loss in record.losses:
        show(loss, style="red")
    if record.losses:
        raise typer.Exit(DAMAGED)
