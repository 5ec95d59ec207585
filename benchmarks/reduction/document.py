"""Sections of a report: prose, tables and a figure; written as Markdown, JSON and PNG."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import pandas as pd
from matplotlib.figure import Figure

__all__ = ["DPI", "Section", "Table", "markdown", "write"]

DPI: Final = 110


@dataclass(frozen=True, eq=False)
class Table:
    """A table and what it shows."""

    caption: str
    rows: pd.DataFrame


@dataclass(frozen=True, eq=False)
class Section:
    """One part of the report.

    Args:
        title: its heading.
        prose: paragraphs that stand before the tables.
        tables: its tables.
        figure: name and picture; None where there is none.
        conclusions: sentences that stand after the tables.
    """

    title: str
    prose: str
    tables: Sequence[Table] = ()
    figure: tuple[str, Figure] | None = None
    conclusions: Sequence[str] = field(default=())


def write(
    sections: Sequence[Section],
    facts: Mapping[str, Any],
    out: Path,
    title: str,
    opening: str = "",
    claims: Sequence[Any] = (),
) -> None:
    """Write `out`.md, `out`.json and the figures `out`_NAME.png.

    Args:
        sections: the parts.
        facts: command, versions and seeds, for the top.
        out: path without suffix.
        title: of the whole.
        opening: the first paragraph.
        claims: what the text claims, with verdicts, as records of strings.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    header = [f"- {key}: {value}" for key, value in facts.items()]
    lines = [f"# {title}", "", fill(opening, 120), "", *header, ""]
    for section in sections:
        lines += markdown(section, out)
    out.with_suffix(".md").write_text("\n".join(lines).rstrip() + "\n")
    record = {
        "facts": dict(facts),
        "opening": opening,
        "claims": list(claims),
        "sections": [_record(section) for section in sections],
    }
    out.with_suffix(".json").write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n")


def markdown(section: Section, out: Path) -> list[str]:
    """A section as lines of Markdown; its figure is written beside `out`."""
    lines = [f"## {section.title}", "", section.prose, ""]
    if section.figure is not None:
        name, picture = section.figure
        path = out.with_name(f"{out.name}_{name}.png")
        for axes in picture.axes:
            axes.title.set_fontsize(9)
        picture.savefig(path, dpi=DPI)
        lines += [f"![{section.title}]({path.name})", ""]
    for table in section.tables:
        lines += [f"{table.caption}", "", table.rows.map(_cell).to_markdown(index=False, disable_numparse=True), ""]
    return lines + [f"- {sentence}" for sentence in section.conclusions] + [""]


def _cell(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, float):
        return "–" if value is None else str(value)
    if pd.isna(value):
        return "–"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"


def _record(section: Section) -> dict[str, Any]:
    tables = [
        {"caption": table.caption, "rows": json.loads(table.rows.to_json(orient="records", double_precision=6))}
        for table in section.tables
    ]
    return {"title": section.title, "tables": tables, "conclusions": list(section.conclusions)}
