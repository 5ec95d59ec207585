"""The command about trials that were delivered without isiw."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from rich.console import Console
from rich.progress import Progress

import isiw
from isiw.cli.console import LOGS, STUDIES, Overwrite, Picture, errors_reported, free_beside, show, ticking, working
from isiw.text.sanitize import command, counted

if TYPE_CHECKING:
    from isiw.existing import Layout
    from isiw.existing.batch import Person, Way

app = typer.Typer()

Only = Annotated[str | None, typer.Option(help="The code of the one person who is wanted.")]


class Reading(NamedTuple):
    """How files are read, as a command line says."""

    layout: Layout
    limits: dict[str, Any]  # of `existing.batch.Way` and `existing.look`


def _reading(
    reference: Annotated[str | None, typer.Option(help="What ISIs count from: impact, or valve.")] = None,
    column: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="KEY=NAME", help='What a column holds, such as "isi=Delay"; repeat it.'),
    ] = None,
    where: Annotated[
        list[str] | None,
        typer.Option("--where", metavar="COLUMN=VALUE", help='Rows to read, such as "muscle=FCR"; repeat it.'),
    ] = None,
    unit: Annotated[
        list[str] | None, typer.Option("--unit", help="Unit of ISIs (ms, s) or amplitudes (mV, uV, V).")
    ] = None,
    marker: Annotated[
        list[str] | None,
        typer.Option("--marker", metavar="KEY=NAME", help="What an event of a recording marks: pulse, tap or valve."),
    ] = None,
    channel: Annotated[
        list[str] | None, typer.Option("--channel", metavar="KEY=NAME", help="Which channel holds the EMG: emg=NAME.")
    ] = None,
    unmarked: Annotated[
        str | None,
        typer.Option(help="What pulses without a marked tap are: TMS alone, or lost (the marker is missing)."),
    ] = None,
    alone: Annotated[str | None, typer.Option(help="What stands for the ISI of TMS alone.")] = None,
    decimal: Annotated[str | None, typer.Option(help="The decimal sign of the file.")] = None,
    sheet: Annotated[str | None, typer.Option(help="The sheet of a workbook.")] = None,
    layout: Annotated[Path | None, typer.Option("--layout", help="How the files are laid out (TOML).")] = None,
    also: Annotated[
        list[Path] | None, typer.Option(help="A file elsewhere that a recording may refer to; repeat it.")
    ] = None,
    larger: Annotated[float, typer.Option(help="By what to multiply the limits of reading a file.")] = 1.0,
) -> Reading:
    """The options that say how files are read, each stated here alone."""
    stated = isiw.existing.layout.read_layout(layout) if layout is not None else isiw.existing.Layout()
    named = {"columns": column, "where": where, "markers": marker, "channels": channel}
    pairs = {
        key: isiw.existing.layout.pairs_of(f"--{key.removesuffix('s')}", texts or []) for key, texts in named.items()
    }
    said = {"reference": reference, "alone": alone, "decimal": decimal, "sheet": sheet, "unmarked": unmarked}
    limits = isiw.existing.ReadingLimits().larger(larger)
    return Reading(
        stated.saying(**pairs, units=tuple(unit or ()), **said), {"limits": limits, "also": tuple(also or ())}
    )


def reads_files(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of `_reading` for its parameter `reading`, which is called for them."""
    own, read = (list(inspect.signature(each, eval_str=True).parameters.values()) for each in (command, _reading))
    place = next(index for index, each in enumerate(own) if each.name == "reading")

    def called(**given: Any) -> None:
        options = {each.name: given.pop(each.name) for each in read}
        command(**given, reading=partial(_reading, **options))

    parameters = [each.replace(kind=each.KEYWORD_ONLY) for each in (*own[:place], *read, *own[place + 1 :])]
    called.__name__, called.__doc__ = command.__name__, command.__doc__
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined] # by which Typer makes options
    called.__annotations__ = {}
    return called


@app.command(rich_help_panel=LOGS)
@reads_files
def analyse(
    files: Annotated[list[Path], typer.Argument(help="Tables, recordings or logs; docs/your-data.md.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The log to write (.mcap), or a folder.")
    ] = None,
    *,
    reading: Callable[[], Reading],
    config: Annotated[Path | None, typer.Option(help="Space, strategy, seed and visit as for isiw run (TOML).")] = None,
    strategy: Annotated[str | None, typer.Option(help="The strategy; see isiw strategies.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the analysis.")] = None,
    only: Only = None,
    simulated: Annotated[bool, typer.Option("--simulated", help="The trials are simulated.")] = False,
    look: Annotated[bool, typer.Option("--look", help="Say what is in the files, and analyse nothing.")] = False,
) -> None:
    """Estimate the window from trials that were delivered without isiw; with -o, make a log of them.

    Called again with the same files and folder, it continues where it was interrupted.
    """
    with errors_reported("Interrupted: what is finished is kept; give the same command to continue."):
        layout, limits = reading()
        if look:
            _look_at(files, layout, **limits)
            return
        settings = None  # a file is refused before a configuration that nobody gave is loaded
        if (config, strategy, seed) != (None, None, None):
            settings = isiw.config.load_config(config).with_overrides(strategy=strategy, seed=seed)
        way = isiw.existing.batch.way_of(settings, layout, simulated=simulated, **limits)
        with working(f"Reading {counted(len(files), 'file')}"):
            people = isiw.existing.batch.read_files(files, way, output, only)
        _analyse_all(people, way, files[0])


@app.command(rich_help_panel=STUDIES)
@reads_files
def replay(
    file: Annotated[Path, typer.Argument(help="A table, a recording, or a log.")],
    strategy: Annotated[list[str] | None, typer.Option(help="A name that isiw strategies lists; repeat it.")] = None,
    seeds: Annotated[int, typer.Option(help="How many times each strategy is run, with other draws.")] = 5,
    trials: Annotated[int, typer.Option(help="How many stimuli each time.")] = 60,
    output: Picture = None,
    *,
    reading: Callable[[], Reading],
    only: Only = None,
    overwrite: Overwrite = False,
) -> None:
    """How many stimuli would it have taken? Strategies choose ISIs, and the trials of a file answer."""
    with errors_reported("Interrupted."):
        layout, limits = reading()
        way = isiw.existing.batch.Way(layout, **limits)
        with working(f"Reading {file.name}"):
            found = isiw.existing.batch.read_files([file], way, only=only)
        if len(found) > 1:
            people = isiw.existing.delivered.codes_of([one.delivered for one in found])
            raise isiw.errors.ConfigError("a replay is of one person", got=people, remedy="Say whose: --only CODE.")
        if found[0].refused is not None:
            raise found[0].refused
        names = strategy or ["default"]
        progress = Progress(console=Console(stderr=True))
        task = progress.add_task("runs", total=seeds * len(names))
        with progress, ticking(lambda: f"{progress.tasks[0].completed:.0f} of {counted(seeds * len(names), 'run')}"):
            replayed = isiw.existing.replay(
                found[0].delivered, names, seeds=seeds, trials=trials, on_done=lambda: progress.advance(task)
            )
        show(f"{replayed}")
        _say_unused(found, way)
        if output is not None:
            show(f"picture: {replayed.plot(output, overwrite=overwrite)}")


def _look_at(files: list[Path], layout: Layout, **limits: Any) -> None:
    """Say what is in files, and draw the first sweeps of each that has any."""
    for file in files:
        with working(f"Looking into {file.name}"):
            found = isiw.existing.look(file, layout, **limits)
        show(f"{found}")
        if found.figure is not None:
            picture = free_beside(file.with_name(f"{file.stem}_look"), ".png")
            show(f"picture: {isiw.plots.save_figure(found.figure, picture)}")


def _analyse_all(people: list[Person], way: Way, source: Path) -> None:
    """Analyse each person; of several, those who cannot be analysed are named, and keep nobody else from it."""
    several, failed = len(people) > 1, list[str]()
    with Progress(console=Console(stderr=True), disable=not several) as progress:
        task = progress.add_task("people", total=len(people))
        for person in people:
            try:
                _analyse_one(person, way, source, several=several)
            except isiw.errors.InvalidValueError as error:
                if not several:
                    raise
                failed.append(isiw.existing.delivered.codes_of([person.delivered]))
                show(f"{failed[-1]}: {error}")
            progress.advance(task)
    _say_unused(people, way)
    if failed:
        raise isiw.errors.InvalidValueError(
            f"{counted(len(failed), 'person', 'people')} of {len(people)} could not be analysed",
            got=", ".join(failed),
            remedy="Correct what is said of each above, and give the same command again.",
        )


def _say_unused(people: list[Person], way: Way) -> None:
    """Name the columns of which nothing was read: one of them may exclude trials, which count then; and other notes."""
    for note in dict.fromkeys(note for person in people for note in person.delivered.notes):
        show(note)
    if unused := dict.fromkeys(name for person in people for name in person.delivered.unused):
        show(f"Columns not used: {', '.join(unused)}. If one excludes trials, name it: --column exclude=NAME.")
    mark, trials = way.layout.alone, [trial for person in people for trial in person.delivered.trials]
    if mark and all(trial.isi_ms is not None for trial in trials):
        show(f"No trial is TMS alone: no ISI is {mark!r}, as --alone says.")


def _analyse_one(person: Person, way: Way, source: Path, *, several: bool) -> None:
    name = f"{isiw.existing.delivered.codes_of([person.delivered])}: " if several else ""
    if person.log is not None and isiw.existing.batch.is_there(person):
        show(f"{name}{person.log} is there already, of the same file and settings.")
        if not person.log.with_suffix(".png").exists():  # interrupted between the two
            isiw.plots.save_session_plot(isiw.read_session(person.log), person.log.with_suffix(".png"))
        return
    with nullcontext() if several else working(f"Analysing {counted(len(person.delivered.trials), 'trial')}"):
        analysis = isiw.existing.batch.analyse_person(person, way)
    show(f"{name}{analysis}", style=None if several else "bold")
    if person.log is not None:
        show(f"log:     {person.log}")
    code = isiw.existing.batch.code_in_names(person.delivered.subject)
    beside = person.log or (source.with_name(f"{source.stem}_{code}.x") if several else source)
    picture = free_beside(beside, ".png")
    analysis.plot(picture)
    show(f"picture: {picture}")
    if person.log is not None and not several:
        show(f"Its page: {command('report', person.log)}")
