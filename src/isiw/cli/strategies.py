"""The command about the named strategies and their settings."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

import isiw
from isiw.cli.console import NO_DEFAULT, STUDIES, errors_reported, show, show_entry

if TYPE_CHECKING:
    from isiw.strategy.settings.common import DescribedSetting

app = typer.Typer()


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
