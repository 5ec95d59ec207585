"""The pages: everything is linked, every citation has its reference, every decision its date."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
MADE = {"reference", "results", "project"}
PAGES = sorted(path for path in (ROOT / "docs").rglob("*.md") if path.relative_to(ROOT / "docs").parts[0] not in MADE)
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
TEXTS = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
SOURCES = sorted(path for folder in ("src", "benchmarks") for path in (ROOT / folder).rglob("*.py"))
KEY = re.compile(r"\[((?:[A-Z]|ter)[A-Za-z]+[12][0-9]{3})")


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@cache
def texts() -> dict[str, str]:
    """All that may cite, by its name."""
    return {name(path): path.read_text("utf-8") for path in [*SOURCES, *TEXTS]}


@cache
def defined() -> set[str]:
    return set(re.findall(r"^- \*\*\[(\w+)\]\*\*", texts()["docs/references.md"], re.MULTILINE))


def test_every_link_of_a_page_leads_somewhere() -> None:
    targets = [(path, each) for path in TEXTS for each in re.findall(r"\]\((?!http|#)([^)#]+)", texts()[name(path)])]
    assert [
        (name(path), each) for path, each in targets if not (made(path.parent / each) or (path.parent / each).exists())
    ] == []


def made(linked: Path) -> bool:
    """Whether Sphinx makes it, which checks it then."""
    docs, linked = ROOT / "docs", linked.resolve()
    return linked.is_relative_to(docs) and linked.relative_to(docs).parts[0] in MADE


def test_a_decision_has_a_status_and_a_date() -> None:
    head = re.compile(r"# \d+\. .+\n\nStatus: [a-z][^·]+ · Date: \d{4}-\d{2}-\d{2}\n")
    assert [name(path) for path in DECISIONS if not head.match(texts()[name(path)])] == []


def test_what_is_cited_is_among_the_references() -> None:
    assert {
        (where, key) for where, text in texts().items() for key in KEY.findall(text) if key not in defined()
    } == set()


def test_every_reference_is_cited_somewhere() -> None:
    citing = "\n".join(text for where, text in texts().items() if where != "docs/references.md")
    assert {key for key in defined() if f"[{key}" not in citing and f"; {key}" not in citing} == set()


def test_the_picture_of_the_architecture_has_every_room() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    rooms = {room.strip() for layer in layers for room in layer.split("|")}
    picture = (ROOT / "docs" / "images" / "rooms.svg").read_text("utf-8")
    assert {room for room in rooms if f"<!-- {room} -->" not in picture} == set()
    table = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    assert {room for room in rooms if f"`{room}`" not in table} == set()
