"""The pages: everything is linked, every citation has its reference, every decision its date."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MADE = {"reference", "results", "project"}
PAGES = sorted(path for path in (ROOT / "docs").rglob("*.md") if path.relative_to(ROOT / "docs").parts[0] not in MADE)
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
TEXTS = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
SOURCES = sorted(path for folder in ("src", "benchmarks") for path in (ROOT / folder).rglob("*.py"))
KEY = re.compile(r"\[((?:[A-Z]|ter)[A-Za-z]+[12][0-9]{3})")


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def defined() -> set[str]:
    return set(re.findall(r"^- \*\*\[(\w+)\]\*\*", (ROOT / "docs" / "references.md").read_text("utf-8"), re.MULTILINE))


@pytest.mark.parametrize("path", TEXTS, ids=name)
def test_every_link_of_a_page_leads_somewhere(path: Path) -> None:
    for target in re.findall(r"\]\((?!http|#)([^)#]+)", path.read_text("utf-8")):
        linked = path.parent / target
        made = (
            linked.resolve().is_relative_to(ROOT / "docs")
            and linked.resolve().relative_to(ROOT / "docs").parts[0] in MADE
        )
        assert made or linked.exists(), target  # Sphinx checks what it makes


@pytest.mark.parametrize("path", DECISIONS, ids=name)
def test_a_decision_has_a_status_and_a_date(path: Path) -> None:
    assert re.search(r"\A# \d+\. .+\n\nStatus: [a-z][^·]+ · Date: \d{4}-\d{2}-\d{2}\n", path.read_text("utf-8"))


@pytest.mark.parametrize("path", [*SOURCES, *TEXTS], ids=name)
def test_what_is_cited_is_among_the_references(path: Path) -> None:
    assert set(KEY.findall(path.read_text("utf-8"))) <= defined()


def test_every_reference_is_cited_somewhere() -> None:
    cited = {key for path in [*SOURCES, *TEXTS] if path.name != "references.md" for key in cited_in(path)}
    assert defined() - cited == set()


def cited_in(path: Path) -> set[str]:
    text = path.read_text("utf-8")
    return {key for key in defined() if f"[{key}" in text or f"; {key}" in text}


def test_the_picture_of_the_architecture_has_every_room() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    rooms = {room.strip() for layer in layers for room in layer.split("|")}
    picture = (ROOT / "docs" / "images" / "rooms.svg").read_text("utf-8")
    assert {room for room in rooms if f"<!-- {room} -->" not in picture} == set()
    table = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    assert {room for room in rooms if f"`{room}`" not in table} == set()
