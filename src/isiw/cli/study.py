"""The commands about the named strategies and their settings, a lab's prior, and studies."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.padding import Padding
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

import isiw
from isiw.cli.console import (
    STUDIES,
    Overwrite,
    Picture,
    counting,
    errors_reported,
    exit_if_damaged,
    refuse_ignored,
    show,
    ticking,
    working,
)
from isiw.text.sanitize import command, counted, plain, read_whole

if TYPE_CHECKING:
    import pandas as pd

    from isiw.log.record import SessionRecord
    from isiw.priors import LabPrior
    from isiw.strategy.settings.common import DescribedSetting
    from isiw.studies import Store, Unit

app = typer.Typer()
prior = typer.Typer(help="Learn from a lab's own people, for isiw run --prior.", no_args_is_help=True)


@app.command(rich_help_panel=STUDIES)
def strategies(
    name: Annotated[str | None, typer.Argument(help="A strategy's name: list its settings.")] = None,
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
            show(_heading(setting), style="bold")
            Console(highlight=False).print(Padding(Text(setting.meaning), (0, 0, 0, 4)))


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


LabFile = Annotated[Path, typer.Argument(help="A lab's prior (TOML).")]


@prior.command()
def learn(
    logs: Annotated[list[Path], typer.Argument(help="The logs of sessions, one a person.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write (.toml).")],
    again: Annotated[bool, typer.Option(help="Count a second session of the same person as another person.")] = False,
    damaged: Annotated[bool, typer.Option("--damaged", help="Learn what is left of damaged logs.")] = False,
    seed: Annotated[int, typer.Option(help="Seed of the sampler.")] = 0,
    overwrite: Overwrite = False,
) -> None:
    """Learn what a lab's people are like from sessions already run. Exit code 3 if a log is damaged."""
    done: list[SessionRecord] = []
    with errors_reported("Interrupted: nothing was written."):
        with counting("Learning from", len(logs), "session") as count:
            isiw.priors.file.check_lab_output(output, overwrite=overwrite)  # the import takes a second

            def note(record: SessionRecord) -> None:
                done.append(record)
                count(len(done))

            lab = isiw.priors.learn(logs, again=again, damaged=damaged, seed=seed, on_done=note)
        isiw.priors.write_lab_prior(lab, output, overwrite=overwrite)
        _print(lab, isiw.priors.compared(lab))
        if imported := [record.path.name for record in done if record.header.imported]:
            show(isiw.log.imported_sentence(imported))
        show(f"prior: {output}")
        show(f"Run a session with it, and with your rig's CONFIG: {command('run', 'CONFIG', '--prior', output)}")
        exit_if_damaged([f"{record.path.name}: {loss}" for record in done for loss in record.losses])


@prior.command("show")
def show_prior(source: LabFile, output: Picture = None, overwrite: Overwrite = False) -> None:
    """Show what a lab's people are like, compared with the built-in prior."""
    with errors_reported():
        lab = isiw.priors.read_lab_prior(source)
        with working(f"Comparing {source.name} with the built-in prior"):
            table = isiw.priors.compared(lab)
        _print(lab, table)
        if output is not None:
            with working(f"Drawing {source.name}"):
                figure = isiw.plots.prior_figure(isiw.priors.densities(lab))
                picture = isiw.plots.save_figure(figure, output, overwrite=overwrite)
            show(f"picture: {picture}")


def _print(lab: LabPrior, table: pd.DataFrame) -> None:
    show(table.to_string(float_format=lambda value: f"{value:.3g}", na_rep=""))
    for slope in lab.slopes:
        show(str(slope))
    trials = counted(sum(session.trials for session in lab.sessions), "trial")
    show(f"Learnt from {counted(len(lab.sessions), 'session')} with {trials}.", style="bold")


study = typer.Typer(help="Compare strategies on simulated people.", no_args_is_help=True)

Folder = Annotated[Path, typer.Argument(help="The folder of a study.")]


@study.command()
def run(
    context: typer.Context,
    source: Annotated[
        Path, typer.Argument(help="A study (TOML), or the folder of one, to continue it, or with --out to begin again.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="The folder of its results; by default beside it, as NAME.study.")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Number of processes; by default one per core.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to run on.")] = None,
    retry: Annotated[bool, typer.Option(help="Run what failed again.")] = False,
) -> None:
    """Run a study, or what is left of it. The exit code is 1 if sessions failed."""
    with errors_reported():
        if scheduler:
            refuse_ignored("the workers of a Dask cluster are those that it has", context, "workers")
        with working(f"Running the study of {source}"):
            studies, store = isiw.studies, _store(source, out)
            left = store.left(retry=retry)
        folder = store.folder
        processes = (os.cpu_count() or 1) if workers is None else workers
        executor = studies.DaskCluster(scheduler) if scheduler else studies.Processes(processes)
        again = ("study", "run", source, "--out", folder) if source.is_file() else ("study", "run", folder)
        kept = f"Interrupted. All that is finished is kept; continue with: {command(*again)}"
        with errors_reported(kept), _bar(left) as on_done:
            if left:
                studies.conduct(store.study, folder, executor, retry=retry, on_done=on_done)
        _say_what_is_there(store)
        if len(store.errors()):
            raise typer.Exit(1)


@study.command()
def replay(
    context: typer.Context,
    folder: Folder,
    key: Annotated[str, typer.Argument(help="A unit's key, or the number of a row of the table.")],
    person: Annotated[int | None, typer.Option(help="Of a batch, compare this person only.")] = None,
    study: Annotated[
        Path | None, typer.Option(help="The study (TOML) that names code of your own, if it has any.")
    ] = None,
) -> None:
    """Run one session of a study again, alone, and say whether the result is the same."""
    with errors_reported():
        with working(f"Opening {folder}"):
            store = isiw.studies.open_store(folder) if study is None else _store(study, folder)
        if (row := read_whole(key)) is not None:
            refuse_ignored("a row of the table is of one person", context, "person")
            key, person = isiw.studies.running.unit_of_row(store, row)
        with working(f"Running {key} again"):
            result = isiw.studies.replay(store, key, person)
        show(result.again.T.to_string(header=False))
        if result.differing:
            show(f"{key} is not what it was: {', '.join(result.differing)} differ.", style="red", stderr=True)
            raise typer.Exit(1)
        show(f"{key} is identical: {len(result.kept)} rows.", style="bold")


@study.command()
def summary(
    folder: Folder,
    reference: Annotated[
        str | None, typer.Option(help="The strategy that others are compared with; by default the default.")
    ] = None,
) -> None:
    """Print the mean F1 and the paired differences of a study, and write its tables and pictures into the folder."""
    with errors_reported():
        with working(f"Summarising {folder}"):
            store = isiw.studies.open_store(folder)
            rows = store.rows()
        if not len(rows):
            _say_what_is_there(store)
            raise typer.Exit(1)
        table, compared = isiw.studies.summarise(rows, store.errors()), None
        table.to_csv(folder / "summary.csv", index=False)
        if len(set(rows["strategy"])) > 1 or reference is not None:
            compared = isiw.studies.differences(rows, reference)
            compared.to_csv(folder / "differences.csv", index=False)
        show(isiw.studies.means_table(table, compared))
        _say_what_is_there(store)
        for name in ("summary", *(["differences"] if compared is not None else [])):
            show(f"table:   {folder / f'{name}.csv'}")
        for name in isiw.plots.STUDY_PICTURES:
            target = folder / f"summary_{name}.svg"
            with working(f"Drawing {target.name}"):
                isiw.plots.save_figure(isiw.plots.study_figure(table, name), target, overwrite=True)
            show(f"picture: {target}")


def _store(source: Path, out: Path | None) -> Store:
    """The folder to run: that of a study that was begun, or one for the study of a file or of another folder."""
    if source.name == "study.toml" and (source.parent / "parts").is_dir():
        source = source.parent
    if source.is_dir() and out in {None, source}:
        return isiw.studies.open_store(source)
    plan = isiw.studies.load_study(source)
    return isiw.studies.store.begin_store(plan, out or source.with_name(f"{source.stem}.study"))


@contextmanager
def _bar(left: list[Unit]) -> Iterator[Callable[[Unit, Any], None]]:
    """A progress bar with rate and remaining time, and what moves it."""
    if not left:
        show("Nothing is left to run.")
        yield lambda _unit, _result: None
        return
    rate, people = TextColumn("{task.fields[rate]}"), sum(len(unit.sessions) for unit in left)
    columns = (TextColumn("sessions"), BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn())
    progress = Progress(*columns, console=Console(stderr=True))
    with progress, ticking(lambda: f"{progress.tasks[0].completed:.0f} of {counted(people, 'session')}"):
        task = progress.add_task("sessions", total=people, rate="")

        def on_done(unit: Unit, result: Any) -> None:
            progress.advance(task, len(unit.sessions))
            state = progress.tasks[0]
            progress.update(task, rate=f"{state.completed / max(state.elapsed or 0.0, 1e-9):.2f}/s")
            if isinstance(result, isiw.studies.Failure):
                progress.console.print(plain(f"{unit.key} failed: {result.error}"), style="red", markup=False)

        yield on_done


def _say_what_is_there(store: Store) -> None:
    rows, errors = store.rows(), store.errors()
    sessions = rows.groupby(["strategy", "cohort", "person"]).ngroups if len(rows) else 0
    show(f"{sessions} sessions are in {store.folder}, {len(store.left())} units are left.", style="bold")
    if len(errors):
        show(f"{len(errors)} sessions failed:", style="red")
        for line, people in (errors["strategy"] + ": " + errors["error"]).value_counts().items():
            show(f"  {line} ({people} sessions)", style="red")
