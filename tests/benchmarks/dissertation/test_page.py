from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from benchmarks.dissertation.claims import read_claims
from benchmarks.dissertation.contents import CHAPTERS
from benchmarks.dissertation.page import OTHERS, read_sources, write_page

FIGURES = {"3": 12, "4": 35, "5": 13, "6": 10, "7": 11, "8": 2, "B": 1}
TABLES = {"3": 2, "4": 1, "5": 3, "6": 4, "7": 1, "8": 1, "B": 0}


RESULTS = Path(__file__).parents[3] / "benchmarks" / "results"
PAGES = {name: (RESULTS / "dissertation" / name).read_text("utf-8") for name in ("README.md", "index.html")}


def claim(where: str, verdict: str = "reproduced", **others: str) -> dict[str, str]:
    return {"where": where, "what": "w", "theirs": "1", "ours": "2", "difference": "1", "verdict": verdict} | others


def leave(path: Path, *claims: dict[str, str], **others: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"facts": {"command": "c", "seed": 1}, "claims": claims} | others))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of a gallery with one part of its own, and claims on the vane."""
    leave(
        tmp_path / "gallery" / "events.json",
        claim("Table 3.2, Fig. 3.8", ours="a | b <c>"),
        claim("4.2.2", "not, because the SDs pool to more"),
        claim("3.3.1", "by construction: it was put in"),
        note="Simulated.",
        pictures={"Fig. 3.8": "fig_3_8.png"},
    )
    facts = {"command": "`python x`", "versions": {"isiw": "0.1.0", "numpy": "2"}}
    leave(
        tmp_path / "vane.json",
        claim("Fig. 7.1", "under reading closed valves"),
        claim("Fig. 7.2", "not, because it is a photograph"),
        claim("Fig. 7.9–7.10", fails_for="random ISIs"),
        facts=facts,
    )
    (tmp_path / "trial_reduction_initial.png").write_bytes(b"")
    (tmp_path / "interval.json").write_text("{}")
    return tmp_path / "gallery"


def section(page: str, place: str) -> str:
    return page.split(f"### {place}:")[1].split("\n### ", maxsplit=1)[0]


def test_the_contents_have_every_table_and_figure_once_and_in_order() -> None:
    for chapter in CHAPTERS:
        places = [item.place for item in chapter.items]
        for kind, count in (("Fig.", FIGURES[chapter.number]), ("Table", TABLES[chapter.number])):
            expected = [f"{kind} {chapter.number}.{number}" for number in range(1, count + 1)]
            assert [place for place in places if place.startswith(kind)] == expected


def test_claims_stand_under_the_first_place_that_they_name(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    page = (folder / "README.md").read_text()
    assert "reproduced" in section(page, "Table 3.2")
    assert "Simulated." in section(page, "Table 3.2")
    assert "See Table 3.2." in section(page, "Fig. 3.8")
    assert "![Fig. 3.8](fig_3_8.png)" in section(page, "Fig. 3.8")
    assert "See Fig. 7.9." in section(page, "Fig. 7.10")


def test_what_a_chapter_says_in_words_only_stands_at_its_end(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    chapter = (folder / "README.md").read_text().split("## 4. ")[1].split("\n## ")[0]
    assert "the SDs pool to more" in section(chapter, "In words")


def test_a_drawing_has_no_counterpart_unless_a_claim_names_it(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    page = (folder / "README.md").read_text()
    assert "No counterpart: a photograph." in section(page, "Fig. 3.1")
    assert "under reading closed valves" in section(page, "Fig. 7.1")
    assert "No counterpart" not in section(page, "Fig. 7.1")
    assert "No counterpart: a photograph." in section(page, "Fig. 7.2")
    assert "it is a photograph" not in page


def test_benchmarks_that_have_left_no_claims_are_named(folder: Path) -> None:
    sources, missing = read_sources(folder, ["events", "counts"])
    assert [source.name for source in sources] == ["events", "vane"]
    assert set(missing) == {"counts", *OTHERS} - {"vane"}
    write_page(folder, sources, missing)
    page = (folder / "README.md").read_text()
    assert "interval has left no claims" in section(page, "Table 6.2")
    assert "no claim names it" in section(page, "Fig. 7.11")


def test_command_and_versions_are_told_however_a_benchmark_left_them(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    assert "| vane | python x | – | isiw 0.1.0, numpy 2 |" in (folder / "README.md").read_text()


def test_a_picture_of_another_benchmark_is_shown_where_it_exists(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    page = (folder / "README.md").read_text()
    assert "](../trial_reduction_initial.png)" in section(page, "Fig. 4.31")
    assert "](../" not in section(page, "Fig. 4.28")


def test_verdicts_are_counted(folder: Path) -> None:
    counts = write_page(folder, *read_sources(folder, ["events"]))
    assert (counts["reproduced"], counts["under reading"], counts["not, because"]) == (2, 1, 1)
    assert counts["holds, and could not fail"] == 1
    without = sum(item.without is not None for chapter in CHAPTERS for item in chapter.items)
    assert counts["without counterpart"] == without - 1


def test_text_cannot_break_the_page(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    assert "a \\| b <c>" in (folder / "README.md").read_text()
    assert "a | b &lt;c&gt;" in (folder / "index.html").read_text()


@pytest.mark.parametrize("name", OTHERS)
def test_the_claims_that_the_other_benchmarks_have_left_can_be_read(name: str) -> None:
    assert read_claims(RESULTS / f"{name}.json")


@pytest.mark.parametrize("page", PAGES)
def test_every_picture_of_the_page_exists(page: str) -> None:
    linked = re.findall(r"!\[[^]]*]\(([^)]+)\)|<img[^>]* src=\"([^\"]+)\"", PAGES[page])
    missing = {name for names in linked for name in names if name and not (RESULTS / "dissertation" / name).exists()}
    assert linked
    assert not missing


def test_the_page_gives_four_numbers_and_the_models_that_reproduced_claims_fail_for(folder: Path) -> None:
    write_page(folder, *read_sources(folder, ["events"]))
    for name in PAGES:
        page = (folder / name).read_text()
        assert "2 claims are reproduced, 1 come out under a reading" in page
        assert "1 hold without saying anything" in page.replace("\n", " ")
        assert "random ISIs" in page
