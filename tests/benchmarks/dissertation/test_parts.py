from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType

import pytest
from benchmarks.dissertation.claims import Claim, places, read_claims
from benchmarks.dissertation.contents import CHAPTERS
from benchmarks.dissertation.parts import Told, keep, kept, verdict
from benchmarks.dissertation.size import FEW, FULL, Size
from matplotlib.figure import Figure

from benchmarks.dissertation import events, excitability, precision, traces

PLACES = {item.place for chapter in CHAPTERS for item in chapter.items}


def told(_size: Size, seed: int) -> Told:
    claim = Claim("Fig. 3.8", "w", "1", str(seed), "0", "reproduced")
    return Told("Simulated.", [claim], {"Fig. 3.8": Figure()})


def test_a_part_is_kept_with_its_claims_pictures_and_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["dissertation"])
    path = tmp_path / "gallery" / "events.json"
    keep(told, path, FEW, 7)
    assert [claim.ours for claim in read_claims(path)] == ["7"]
    content = json.loads(path.read_text())
    assert (path.parent / content["pictures"]["Fig. 3.8"]).exists()
    assert content["facts"]["command"] == "python -m benchmarks.dissertation"
    assert "numpy" in content["facts"]["versions"]


def test_only_a_part_of_the_same_size_and_seed_is_done(tmp_path: Path) -> None:
    path = tmp_path / "events.json"
    assert not kept(path, FEW, 7)
    keep(told, path, FEW, 7)
    assert kept(path, FEW, 7)
    assert not kept(path, FEW, 8)
    assert not kept(path, FULL, 7)


def test_a_comparison_that_does_not_hold_says_why() -> None:
    assert verdict(holds=True, otherwise="not, because it is late") == "reproduced"
    assert verdict(holds=False, otherwise="not, because it is late") == "not, because it is late"


def check(part: Told) -> None:
    """Every picture stands beside a table, a figure or a section, and every claim names where it is from."""
    assert part.note
    assert part.claims
    assert all(set(places(claim.where)) <= PLACES for claim in part.claims)
    assert all(place in PLACES or place == excitability.SECTION for place in part.pictures)


@pytest.mark.slow
def test_one_persons_traces_are_told() -> None:
    check(traces.tell(FEW, 5))


@pytest.mark.slow
@pytest.mark.parametrize("part", [events, precision])
def test_the_robots_timing_is_told(part: ModuleType) -> None:
    check(part.tell(Size(taps=4, sweeps=1, runs=1, people=1), 5))


@pytest.mark.slow
def test_people_whom_pairs_change_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(excitability, "STRATEGIES", ("gpr",))
    part = excitability.tell(Size(taps=1, sweeps=1, runs=1, people=2), 5)
    check(part)
    assert len(part.claims) == 1
