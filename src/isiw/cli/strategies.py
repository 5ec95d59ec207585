"""The commands about the named strategies and their settings, and about a lab's prior."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import isiw
from isiw.cli.console import (
    NO_DEFAULT,
    STUDIES,
    Overwrite,
    counting,
    errors_reported,
    exit_if_damaged,
    show,
    show_entry,
    working,
)
from isiw.text.sanitize import command, counted

if TYPE_CHECKING:
    import pandas as pd

    from isiw.log.reader import SessionRecord
    from isiw.priors import LabPrior
    from isiw.strategy.settings.common import DescribedSetting

app = typer.Typer()
prior = typer.Typer(help="Learn from a lab's own people, for isiw run --prior.", no_args_is_help=True)


@app.command(rich_help_panel=STUDIES)
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


LabFile = Annotated[Path, typer.Argument(help="A lab's prior (TOML).", **NO_DEFAULT)]


@prior.command()
def learn(
    logs: Annotated[list[Path], typer.Argument(help="The logs of sessions, one a person.", **NO_DEFAULT)],
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write (.toml).")],
    again: Annotated[bool, typer.Option(help="Count a second session of the same person as another person.")] = False,  # noqa: FBT002 - a flag
    damaged: Annotated[bool, typer.Option("--damaged", help="Learn what is left of damaged logs.")] = False,  # noqa: FBT002 - a flag
    seed: Annotated[int, typer.Option(help="Seed of the sampler.")] = 0,
    overwrite: Overwrite = False,  # noqa: FBT002 - a flag
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
            show(isiw.session.imported_sentence(imported))
        show(f"prior: {output}")
        show(f"Run a session with it, and with your rig's CONFIG: {command('run', 'CONFIG', '--prior', output)}")
        exit_if_damaged([f"{record.path.name}: {loss}" for record in done for loss in record.losses])


@prior.command("show")
def show_prior(
    source: LabFile,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Picture to draw.", **NO_DEFAULT)] = None,
    overwrite: Overwrite = False,  # noqa: FBT002 - a flag
) -> None:
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
    trials = counted(sum(session.trials for session in lab.sessions), "trial")
    show(f"Learnt from {counted(len(lab.sessions), 'session')} with {trials}.", style="bold")
