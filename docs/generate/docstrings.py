"""Docstrings as Sphinx reads them: what is indented below a paragraph is shown as it stands."""

from __future__ import annotations

from typing import Any


def connect(app: Any) -> None:
    """Connect it."""
    app.connect("autodoc-process-docstring", _process, priority=400)  # before napoleon


def _process(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:  # noqa: ARG001
    for index in range(len(lines) - 1, 1, -1):
        before = lines[index - 2]
        if lines[index].startswith("    ") and not lines[index - 1].strip() and before.strip() and before[0] != " ":
            lines[index:index] = ["::", ""]
