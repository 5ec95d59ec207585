"""How results are written: tables under what made them, as Markdown to read and as JSON to count with."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd

__all__ = ["kept", "write_table", "write_tables"]


def kept(path: Path, run: Callable[[], pd.DataFrame]) -> pd.DataFrame:
    """Rows from a file, so that what was interrupted does not repeat them; without it they are made, and kept whole.

    Args:
        path: the file.
        run: makes the rows.
    """
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_suffix(".unfinished")
        run().to_parquet(unfinished)
        unfinished.replace(path)
    return pd.read_parquet(path)


def write_table(table: pd.DataFrame, facts: Mapping[str, object], out: Path) -> None:
    """A table under what made it, as Markdown; it is printed, too.

    Args:
        table: the table.
        facts: command, versions, seed and how many there were.
        out: path of the result, without suffix.
    """
    text = f"{_listed(facts)}\n\n{table.to_markdown(index=False, floatfmt='.3f')}\n"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


def write_tables(
    tables: Mapping[str, pd.DataFrame],
    facts: Mapping[str, object],
    out: Path,
    floatfmt: str = ".3f",
    claims: Sequence[Mapping[str, str]] = (),
    **more: object,
) -> None:
    """Tables by their titles under what made them, as Markdown and as JSON.

    Args:
        tables: by their titles.
        facts: command, versions, seed and how many there were.
        out: path of the result, without suffix.
        floatfmt: how numbers are written in the Markdown.
        claims: the dissertation's, each beside what was found; the gallery collects them from the JSON.
        **more: what the JSON holds besides.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    read = {**tables, "Claim by claim": pd.DataFrame(claims)} if claims else tables
    parts = [f"## {title}\n\n{part.to_markdown(index=False, floatfmt=floatfmt)}\n" for title, part in read.items()]
    out.with_suffix(".md").write_text("\n".join([_listed(facts), "", *parts]), encoding="utf-8")
    records = {title: json.loads(part.to_json(orient="records", double_precision=6)) for title, part in tables.items()}
    content = {"facts": facts, **records, **({"claims": claims} if claims else {}), **more}
    out.with_suffix(".json").write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _listed(facts: Mapping[str, object]) -> str:
    return "\n".join(f"- {key}: `{value}`" for key, value in facts.items())
