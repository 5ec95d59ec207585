"""Places in the repository, and on the site, which shows more of it than `docs`."""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
RESULTS = ROOT / "benchmarks" / "results"
MADE = ("reference", "results", "project")
"""Folders of `docs` that hold what is made, and that git ignores."""

_HOME = DOCS / "index.md"
_PAGES = {
    ROOT / "README.md": _HOME,
    DOCS / "README.md": _HOME,
    ROOT / "CONTRIBUTING.md": DOCS / "project" / "contributing.md",
    ROOT / "CHANGELOG.md": DOCS / "project" / "changelog.md",
    DOCS / "decisions": DOCS / "decisions.md",
}
_PICTURE = re.compile(r'<picture><source media="[^"]*" srcset="([^"]+)"><img alt="([^"]+)" src="([^"]+)"></picture>')
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\((?!https?:|#)([^)\s#]+)(#[^)\s]*)?\)")


def on_site(path: Path) -> Path:
    """Where the site has a file of the repository; the file itself if the site only offers it for download."""
    if path in _PAGES:
        return _PAGES[path]
    if path.is_relative_to(RESULTS) and path.suffix in {".md", ".png"}:
        shown = DOCS / "results" / path.relative_to(RESULTS)
        return shown.with_name("index.md") if shown.name == "README.md" else shown
    return path


def relinked(text: str, source: Path, shown: Path) -> str:
    """A page's text with its links as they are from where the site shows it."""

    def replace(found: re.Match[str]) -> str:
        mark, words, target, anchor = found.groups()
        path = Path(os.path.normpath(source.parent / target))
        if path.is_dir() and path not in _PAGES:
            return words
        link = os.path.relpath(on_site(path), shown.parent)
        return f"{mark}[{words}]({link}{anchor or ''})"

    return _LINK.sub(replace, _PICTURE.sub(r"![\2](\3){.only-light}![\2](\1){.only-dark}", text))
