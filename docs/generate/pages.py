"""The pages that are made: results, the reference, and the project's own files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docs.generate import api, commands, configuration, http, topics
from docs.generate.places import DOCS, MADE, RESULTS, ROOT, on_site, relinked

_ALL = """
```{toctree}
:glob:
:hidden:
*
```
"""


def connect(app: Any) -> None:
    """Make them before Sphinx looks for pages, and put the links of all pages right when it reads them."""
    app.connect("builder-inited", lambda _: write())
    app.connect("env-before-read-docs", lambda _app, _env, names: spread(names))
    app.connect("source-read", _read)
    app.connect("html-page-context", _fold, priority=400)  # before the theme lists the pages


def write() -> None:
    """Write all pages that are made; those that are the same stay, so that Sphinx does not read them again."""
    wanted = dict(made())
    for folder in MADE:
        for old in (DOCS / folder).rglob("*"):
            if old.is_file() and old not in wanted:
                old.unlink()
    for path, content in wanted.items():
        if not path.exists() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


def spread(names: list[str]) -> None:
    """Put the tutorials, which run for long, far from each other: a process reads a stretch of the pages."""
    tutorials = [name for name in names if name.startswith("tutorials/")]
    others = [name for name in names if name not in tutorials]
    for number, name in enumerate(tutorials):
        others.insert(number * (len(names) // len(tutorials)), name)
    names[:] = others


def made() -> Iterator[tuple[Path, bytes]]:
    """Path and content of each."""
    yield from _copied()
    for room in (api, commands, configuration, topics, http):
        for name, text in room.pages():
            yield DOCS / "reference" / name, text.encode()


def _copied() -> Iterator[tuple[Path, bytes]]:
    sources = [
        *RESULTS.glob("*.md"),
        *RESULTS.glob("dissertation/*.md"),
        ROOT / "CONTRIBUTING.md",
        ROOT / "CHANGELOG.md",
    ]
    for source in sources:
        shown = on_site(source)
        text = source.read_text("utf-8")
        if not re.match(r"# ", text):  # most results begin with the command that made them
            text = f"# {source.stem.replace('_', ' ').capitalize()}\n\n{text}"
        if source == RESULTS / "README.md":
            text += _ALL
        yield shown, relinked(text, source, shown).encode()
    for picture in [*RESULTS.glob("*.png"), *RESULTS.glob("dissertation/*.png")]:
        yield on_site(picture), picture.read_bytes()


def _read(app: Any, docname: str, content: list[str]) -> None:
    path = Path(app.env.doc2path(docname))
    if path.suffix == ".md" and path.relative_to(DOCS).parts[0] not in MADE:
        content[0] = relinked(content[0], path, path)


def _fold(_app: Any, _page: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    """Have a page's sidebar list the pages of its own section: all of them on all took most of the writing."""
    if (listed := context.get("toctree")) is not None:
        context["toctree"] = lambda **how: listed(**{**how, "collapse": True})
