from __future__ import annotations

from isiw.log.frames import meanings
from isiw.summary import words_of
from isiw.text.stimuli import STIMULI, TAP


def test_sessions_with_one_stimulus_have_its_words_and_sessions_with_both_have_both() -> None:
    assert words_of(["electrical", "electrical"]) == STIMULI["electrical"]
    assert words_of(["tap"]) == words_of([]) == TAP
    both = words_of(["electrical", "tap"])
    assert both.given == "a tap on the tendon or an electrical pulse to the nerve"
    assert both.isi_axis("impact") == "ISI after the impact or electrical pulse [ms]"


def test_isis_count_from_the_electrical_pulse_where_it_takes_the_place_of_the_impact() -> None:
    first = STIMULI["electrical"]
    assert (first.origin("impact"), first.shown("impact"), first.alone) == (
        "electrical pulse", "electrical pulse", "electrical pulse alone",
    )  # fmt: skip
    assert first.origin("valve") == TAP.origin("valve") == "valve command"


def test_the_meaning_of_a_column_is_told_in_the_words_of_the_stimulus() -> None:
    columns = {"t_hit_ms": ("ms", "the {0.moment}, {when}")}
    assert meanings(columns, TAP, when="now") == {"t_hit_ms": ("ms", "the impact, now")}
    assert meanings(columns, STIMULI["electrical"], when="now") == {"t_hit_ms": ("ms", "the electrical pulse, now")}
