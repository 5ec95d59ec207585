"""What users read is plain English: `docs/words.md` has the words, and these phrases must not come back."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PHRASES = re.compile(
    r"\b(?:(?:is|are|be|been|was|were) told|(?:is|are|was|were|been) believed|"
    r"(?:believes|believed) (?:to|that|of|about)|anew|asks? for what|tells? most|"
    r"not known to be one|whatever became|knows? of it|hardly anything|said so|believed after|"
    r"where nothing is known|where it is known|nobody's own)\b",
    re.IGNORECASE,
)
NAMES = re.compile(r"belie[fv]|anew|somebody|(?<![a-z])told_|_told(?![a-z])", re.IGNORECASE)
KEPT = {"belief_version", "min_told"}
"""Names of logs and settings."""
CONTINUING = re.compile(r"\b(?:go|goes|went|going) on with\b", re.IGNORECASE)
PAGES = [
    path
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("[dlt]*/*.md")]
    if path.name != "words.md"
]
SOURCES = sorted((ROOT / "src").rglob("*.py"))
SHOWN = [path for path in (ROOT / "src").rglob("*") if path.suffix in {".html", ".js", ".txt"}]
"""What pages and a new rig's files say."""


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", [*PAGES, *SHOWN], ids=name)
def test_a_page_has_none_of_the_worst_phrases(path: Path) -> None:
    assert [
        line for line in path.read_text("utf-8").splitlines() if PHRASES.search(line) or CONTINUING.search(line)
    ] == []


def test_no_message_has_one_of_the_worst_phrases() -> None:
    said = [(name(path), text) for path in SOURCES for text in messages(path)]
    assert [each for each in said if PHRASES.search(each[1]) or CONTINUING.search(each[1])] == []


@cache
def parsed(path: Path) -> ast.Module:
    """A module's code, which both tests read."""
    return ast.parse(path.read_text("utf-8"))


def messages(path: Path) -> Iterator[str]:
    """The texts in a module's code; docstrings are for developers."""
    tree = parsed(path)
    bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in bare:
            yield node.value


def test_no_name_in_code_has_a_word_that_stands_for_something_else() -> None:
    found = {f"{name(path)}: {each}" for path in SOURCES for each in identifiers(path) - KEPT if NAMES.search(each)}
    assert found == set()


def identifiers(path: Path) -> set[str]:
    """The names that a module gives or uses."""
    kinds = {ast.Name: "id", ast.Attribute: "attr", ast.arg: "arg", ast.keyword: "arg", ast.alias: "name"}
    kinds |= dict.fromkeys((ast.FunctionDef, ast.ClassDef), "name")
    nodes = ast.walk(parsed(path))
    return {getattr(node, kinds[type(node)]) or "" for node in nodes if type(node) in kinds}
