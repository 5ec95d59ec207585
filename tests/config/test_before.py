"""What was given in a visit before a session: all of it counts, and is learnt as the search had learnt it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isiw
from isiw.config.given import Before, given_before
from isiw.config.run import RunConfig, load_config
from isiw.config.session import device_for, earlier_trials, intervention_for, left_out, session_for
from isiw.devices.protocol import info_of
from isiw.errors import InvalidValueError
from isiw.session.sink import SessionUpdate

CONFIG = """
seed = 7
[visit]
subject = "P7"
intensity_pct_rmt = 90.0
[space]
reference = "impact"
low_ms = 0
high_ms = 300
[strategy.settings]
particles = 100
max_trials = 5
[limits]
max_pulses = 90
[intervention]
changes_the_person = true
protocol_code = "2026-17"
before = 5
pairs = 50
after = 5
after_min = [0]
"""


def known_before(config: RunConfig) -> Before:
    return earlier_trials(config, info_of(device_for(config)), given_before(config))


@pytest.fixture
def config(tmp_path: Path) -> RunConfig:
    """Of a visit in which thirty pulses over the curve came first, and then a search."""
    rng = np.random.default_rng(1)
    rows = [f"{pct},{0.02 * 1.12 ** (pct - 85) * rng.lognormal(0, 0.4):.4f}" for pct in (90, 100, 110) * 10]
    (tmp_path / "curve.csv").write_text("\n".join(["intensity_pct_rmt,mep_mv", *rows]))
    (tmp_path / "visit.toml").write_text(CONFIG)
    config = load_config(tmp_path / "visit.toml")
    searched = config.with_overrides(log=tmp_path / "search.mcap", earlier=[tmp_path / "curve.csv"])
    session_for(searched).run(progress=False)
    return config


def test_pulses_before_the_search_count_for_what_follows_it(config: RunConfig, tmp_path: Path) -> None:
    search = tmp_path / "search.mcap"
    after = config.with_overrides(log=tmp_path / "pair.mcap", earlier=[search])
    given, own = known_before(after).trials, len(isiw.read_session(search).table)
    assert len(given) == 30 + own
    with pytest.raises(InvalidValueError, match=f"{30 + own} given before"):
        intervention_for(after).require_effect()


def test_pulses_that_are_named_again_count_once(config: RunConfig, tmp_path: Path) -> None:
    both = config.with_overrides(earlier=[tmp_path / "curve.csv", tmp_path / "search.mcap"])
    alone = config.with_overrides(earlier=[tmp_path / "search.mcap"])
    assert known_before(both) == known_before(alone)


def test_trials_that_a_later_session_had_learnt_count_once_whatever_the_order(
    config: RunConfig, tmp_path: Path
) -> None:
    first, second = tmp_path / "search.mcap", tmp_path / "again.mcap"
    session_for(config.with_overrides(log=second, earlier=[first])).run(progress=False)
    own = sum(len(isiw.read_session(log).table) for log in (first, second))
    alone = known_before(config.with_overrides(earlier=[second]))
    assert len(alone.trials) == 30 + own
    assert len(alone.changed_after) == 2
    for named in ([first, second], [second, first], [tmp_path / "curve.csv", second]):
        assert known_before(config.with_overrides(earlier=named)) == alone


def test_a_change_that_was_noted_in_the_search_is_known_afterwards_and_on_resuming(tmp_path: Path) -> None:
    (tmp_path / "visit.toml").write_text(CONFIG)
    config = load_config(tmp_path / "visit.toml").with_overrides(log=tmp_path / "search.mcap")
    described = session_for(config)

    def noting(update: SessionUpdate) -> None:
        if update.trial.index == 3:
            searching.note_change("the coil moved")

    searching = isiw.Session(
        device_for(config),
        described.strategy,
        log=tmp_path / "search.mcap",
        limits=described.header.limits,
        visit=config.visit.noted(),
        on_trial=noting,
        subject="P7",
    )
    searching.run(progress=False)
    after = config.with_overrides(log=tmp_path / "next.mcap", earlier=[tmp_path / "search.mcap"])
    assert known_before(after).changed_after == {3}
    strategy = session_for(after).strategy
    assert strategy.earlier_changed == (3,)
    assert strategy.restarted().estimate().probability == strategy.estimate().probability


@pytest.mark.parametrize(
    ("said", "left"),
    [
        ({"earlier": ["c.csv"]}, "a.csv, {0}/b.csv:"),
        ({"earlier": ["c.csv", "b.csv"]}, "a.csv:"),
        ({"after": ["other.mcap"]}, "day1.mcap:"),
        ({"prior": "other.toml"}, "lab.toml:"),
        ({"after": ["day1.mcap", "day2.mcap"], "seed": 3}, None),
        ({}, None),
    ],
)
def test_files_whose_place_options_take_are_named(tmp_path: Path, said: dict[str, Any], left: str | None) -> None:
    stated = 'prior = "lab.toml"\nafter = ["day1.mcap"]\nearlier = ["a.csv", "b.csv"]'
    (tmp_path / "visit.toml").write_text(stated)
    config = load_config(tmp_path / "visit.toml")
    named = {key: [tmp_path / file for file in value] for key, value in said.items() if isinstance(value, list)}
    found = left_out(config, config.with_overrides(**said | named))
    assert (found is None) == (left is None)
    assert left is None or f"in the place of {tmp_path}/{left.format(tmp_path)} nothing is learnt" in str(found)
