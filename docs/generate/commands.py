"""The command line, as typer knows it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from docs.generate.tables import cell, table
from typer.main import get_command

from isiw.cli import app

_CODES = """
Exit codes: 0 all is well, 1 an error, 2 wrong usage, 3 a damaged log, 4 a device that could not be disarmed, so that
the process ended, 5 a session that has paused or was ended early, 130 Ctrl-C or a signal.
"""


def pages() -> Iterator[tuple[str, str]]:
    """One page."""
    root = get_command(app)
    head = f"# Command line\n\n{root.help}\n{_CODES}"
    yield "command-line.md", head + "".join(_section(name, command) for name, command in every(root))


def every(group: Any, before: str = "isiw") -> Iterator[tuple[str, Any]]:
    """All commands with their full names."""
    for name, command in sorted(group.commands.items()):
        if hasattr(command, "commands"):
            yield from every(command, f"{before} {name}")
        else:
            yield f"{before} {name}", command


def _section(name: str, command: Any) -> str:
    usage = " ".join(
        [name, "[OPTIONS]", *(_argument(one) for one in command.params if one.param_type_name == "argument")]
    )
    rows = [[_names(one), cell(_meaning(one))] for one in command.params if one.name != "help"]
    return f"\n## `{name}`\n\n{inspect.cleandoc(command.help or '')}\n\n```text\n{usage}\n```\n\n" + (
        table(["option", "meaning"], rows) if rows else ""
    )


def _argument(one: Any) -> str:
    name = (one.metavar or one.name).upper() + ("..." if one.nargs == -1 else "")
    return name if one.required else f"[{name}]"


def _names(one: Any) -> str:
    if one.param_type_name == "argument":
        return f"`{(one.metavar or one.name).upper()}`"
    return ", ".join(f"`{name}`" for name in [*one.opts, *one.secondary_opts])


def _meaning(one: Any) -> str:
    default = one.default
    shown = default not in (None, False, True, [], "") and not callable(default)
    return " ".join(filter(None, [one.help, f"Default: `{default}`." if shown else ""]))
