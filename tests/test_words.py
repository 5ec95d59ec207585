"""What users read is plain English: `docs/words.md` has the words, and these phrases must not come back."""

from __future__ import annotations

import ast
import re
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


def test_no_page_has_one_of_the_worst_phrases() -> None:
    lines = [(name(path), line) for path in [*PAGES, *SHOWN] for line in path.read_text("utf-8").splitlines()]
    assert [each for each in lines if PHRASES.search(each[1]) or CONTINUING.search(each[1])] == []


@pytest.mark.slow
def test_no_message_has_one_of_the_worst_phrases() -> None:
    said = [(name(path), text) for path in SOURCES for text in read(path)[0]]
    assert [each for each in said if PHRASES.search(each[1]) or CONTINUING.search(each[1])] == []


@pytest.mark.slow
def test_no_name_in_code_has_a_word_that_stands_for_something_else() -> None:
    found = {f"{name(path)}: {each}" for path in SOURCES for each in read(path)[1] - KEPT if NAMES.search(each)}
    assert found == set()


KINDS: dict[type[ast.AST], str] = {
    ast.Name: "id",
    ast.Attribute: "attr",
    ast.arg: "arg",
    ast.keyword: "arg",
    ast.alias: "name",
    **dict.fromkeys((ast.FunctionDef, ast.ClassDef), "name"),
}


@cache
def read(path: Path) -> tuple[list[str], set[str]]:
    """The texts in a module's code without its docstrings, which are for developers, and the names that it has."""
    texts, names, docstrings = [], set(), set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):  # what holds a text comes before it
        if isinstance(node, ast.Expr):
            docstrings.add(node.value)
        elif isinstance(node, ast.Constant):
            if isinstance(node.value, str) and node not in docstrings:
                texts.append(node.value)
        elif (named := KINDS.get(type(node))) is not None:
            names.add(getattr(node, named) or "")
    return texts, names
