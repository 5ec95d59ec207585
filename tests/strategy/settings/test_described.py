"""What people are told about a strategy's settings."""

from __future__ import annotations

import pytest

from isiw.strategy.catalogue import list_settings, list_strategies, settings_for
from isiw.strategy.settings.common import as_toml, settings_values


@pytest.mark.parametrize("name", list_strategies())
def test_every_setting_has_a_meaning_and_the_value_that_the_name_stands_for(name: str) -> None:
    entries = {entry.key: entry for entry in list_settings(name)}
    assert [key for key, entry in entries.items() if not entry.meaning] == []
    for key, value in settings_values(settings_for(name)).items():
        assert entries[key].group if isinstance(value, dict) else as_toml(entries[key].value) == value


def test_a_unit_is_taken_from_the_name_and_left_out_of_the_meaning() -> None:
    entries = {entry.key: entry for entry in list_settings("nr")}
    assert (entries["min_width_ms"].unit, entries["stop_variance_ms2"].unit) == ("ms", "ms²")
    assert (entries["threshold_mv"].unit, entries["peaks"].unit) == ("mV", "")
    assert entries["max_width_ms"].meaning == "the widest."


def test_a_group_comes_before_its_members_which_are_named_after_it() -> None:
    entries = list_settings("default")
    keys = [entry.key for entry in entries]
    group = keys.index("moves")
    assert keys[group : group + 2] == ["moves", "moves.sweeps"]
    assert (entries[group].group, entries[group].value) == (True, None)
    assert not entries[group + 1].group


def test_numbers_that_belong_together_are_named() -> None:
    ratio = next(entry for entry in list_settings("default") if entry.key == "prior.switch.reliability")
    assert ratio.parts == ("median", "sd", "tail")
