"""The gallery's one page, in Markdown and HTML, of the claims that benchmarks have left."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, FileSystemLoader, select_autoescape

from benchmarks.dissertation.claims import KINDS, NOT, REPRODUCED, Claim, by_kind, kind_of, places, read_claims
from benchmarks.dissertation.contents import CHAPTERS, Chapter, Item

__all__ = ["OTHERS", "Source", "read_sources", "write_page"]

OTHERS: Final[Mapping[str, tuple[str, ...]]] = {
    "trial_reduction": ("4", "5"),
    "interval": ("6",),
    "vane": ("7",),
    "inhibition": ("8", "B"),
}
"""Other benchmarks whose claims are collected, and the chapters that they are about."""

_PICTURES: Final[Mapping[str, str]] = {
    "Fig. 4.23": "trial_reduction_methods.png",
    "Fig. 4.28": "trial_reduction_particles.png",
    "Fig. 4.31": "trial_reduction_initial.png",
    "Fig. 5.12": "trial_reduction_online.png",
    "Fig. 6.5": "interval.png",
    "Fig. 7.9": "vane.png",
    "Fig. 8.1": "inhibition.png",
}
"""Of a benchmark whose JSON file names no pictures; each shows the neighbouring figures as well."""

_DRAWN = {item.place for chapter in CHAPTERS for item in chapter.items if item.without is not None}
_SECTION = re.compile(r"\b([3-8]|B)\.\d")
_CHAPTER = re.compile(r"\b(?:[Cc]hapter|[Aa]ppendix)\s+([3-8]|B)\b")


@dataclass(frozen=True, eq=False)
class Source:
    """What one benchmark has left.

    Args:
        name: of the benchmark, or of the gallery's own part.
        path: its JSON file.
        claims: what it says.
        facts: command, versions and seed.
        note: where its data come from; empty where its own report says so.
        pictures: file by place.
    """

    name: str
    path: Path
    claims: Sequence[Claim]
    facts: Mapping[str, Any]
    note: str
    pictures: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Entry:
    """A table or figure on the page.

    Args:
        item: which.
        line: why it has no counterpart, or where else it is told; empty where claims follow.
        claims: what is told here.
        pictures: paths from the page.
        notes: where the data come from.
    """

    item: Item
    line: str
    claims: Sequence[Claim]
    pictures: Sequence[str]
    notes: Sequence[str]


def read_sources(folder: Path, parts: Sequence[str]) -> tuple[list[Source], list[str]]:
    """The gallery's own parts and the other benchmarks' claims, and the names of those that are missing.

    Args:
        folder: of the gallery, inside that of all results.
        parts: names of the own parts.
    """
    paths = {name: folder / f"{name}.json" for name in parts}
    paths |= {name: folder.parent / f"{name}.json" for name in OTHERS}
    there = {name: path for name, path in paths.items() if path.exists() and "claims" in json.loads(path.read_text())}
    return [_source(name, path) for name, path in there.items()], [name for name in paths if name not in there]


def _source(name: str, path: Path) -> Source:
    content = json.loads(path.read_text())
    claims = [claim for claim in read_claims(path) if not _of_a_drawing(claim)]
    return Source(name, path, claims, content.get("facts", {}), content.get("note", ""), content.get("pictures", {}))


def _of_a_drawing(claim: Claim) -> bool:
    """Whether a claim says no more than that a drawing or a photograph has no counterpart, as its item does."""
    return kind_of(claim) == NOT and set(places(claim.where)[:1]) <= _DRAWN and bool(places(claim.where))


def write_page(folder: Path, sources: Sequence[Source], missing: Sequence[str]) -> Counter[str]:
    """Write README.md and index.html into the gallery's folder.

    Args:
        folder: of the gallery.
        sources: as `read_sources` gives them.
        missing: names of benchmarks without claims.

    Returns:
        How many claims have which verdict, and how many tables and figures have no claim.
    """
    chapters = [
        (
            chapter,
            [_entry(item, chapter, sources, missing, folder) for item in chapter.items],
            _in_words(chapter, sources, folder),
        )
        for chapter in CHAPTERS
    ]
    counts = Counter(by_kind(claim for source in sources for claim in source.claims))
    lines = [entry.line for _, entries, _ in chapters for entry in entries]
    counts["without counterpart"] = sum(line.startswith("No counterpart") for line in lines)
    counts["not yet"] = sum(line.startswith("Not yet") for line in lines)
    caught = Counter(
        (name, source.name)
        for source in sources
        for claim in source.claims
        if claim.verdict == REPRODUCED
        for name in claim.fails_for.split("; ")
    )
    told: dict[str, Any] = {"chapters": chapters, "counts": counts, "sources": sources, "missing": missing}
    told |= {"kinds": [counts[kind] for kind in KINDS], "caught": caught.most_common(), "kind_of": kind_of}
    for suffix, name in (("md", "README.md"), ("html", "index.html")):
        (folder / name).write_text(_templates().get_template(f"gallery.{suffix}.jinja").render(told))
    return counts


def _templates() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=select_autoescape(("html.jinja",)),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["cell"] = lambda text: text.replace("|", "\\|").replace("\n", " ")
    environment.filters["fact"] = _fact
    return environment


def _fact(fact: Any) -> str:
    """A fact in a line; benchmarks leave versions as text or by name, and commands with or without backticks."""
    if isinstance(fact, Mapping):
        return ", ".join(f"{name} {value}" for name, value in fact.items())
    return str(fact).replace("`", "")


def _entry(item: Item, chapter: Chapter, sources: Sequence[Source], missing: Sequence[str], folder: Path) -> Entry:
    """An item with the claims that name it first; those that name it later are referred to."""
    named = [(source, claim, places(claim.where)) for source in sources for claim in source.claims]
    here = [(source, claim) for source, claim, where in named if where[:1] == [item.place]]
    elsewhere = sorted({where[0] for _, _, where in named if item.place in where[1:]})
    pictures = [
        _link(source, folder, source.pictures[item.place]) for source in sources if item.place in source.pictures
    ]
    other = _PICTURES.get(item.place)
    if other is not None and not pictures and (folder.parent / other).exists():
        pictures = [f"../{other}"]
    notes = list(dict.fromkeys(_origin(source, folder) for source, _ in here))
    line = ""
    if item.without is not None and not here:
        line = f"No counterpart: {item.without}."
    elif not here and elsewhere:
        line = f"See {' and '.join(elsewhere)}."
    elif not here:
        absent = [name for name in missing if chapter.number in OTHERS.get(name, ())]
        line = f"Not yet: {' and '.join(absent)} has left no claims." if absent else "Not yet: no claim names it."
    return Entry(item, line, [claim for _, claim in here], pictures, notes)


def _in_words(chapter: Chapter, sources: Sequence[Source], folder: Path) -> Entry | None:
    """What a chapter says in words only."""
    here = [(s, c) for s in sources for c in s.claims if not places(c.where) and _chapter_of(c.where) == chapter.number]
    if not here:
        return None
    pictures = [
        _link(source, folder, name)
        for source in dict.fromkeys(source for source, _ in here)
        for place, name in source.pictures.items()
        if not places(place) and _chapter_of(place) == chapter.number
    ]
    notes = list(dict.fromkeys(_origin(source, folder) for source, _ in here))
    return Entry(
        Item("In words", "what has neither table nor figure"), "", [claim for _, claim in here], pictures, notes
    )


def _chapter_of(where: str) -> str | None:
    found = _SECTION.search(where) or _CHAPTER.search(where)
    return found[1] if found else None


def _link(source: Source, folder: Path, name: str) -> str:
    return name if source.path.parent == folder else f"../{name}"


def _origin(source: Source, folder: Path) -> str:
    if source.path.parent == folder:
        return source.note
    return f"From benchmarks/results/{source.name}.md."
