from __future__ import annotations

from dataclasses import replace

import pytest

from isiw.pairing import AfterEffect, BlockChange, Delivered, Interval, words

WIDE, NARROW = Interval(1.5, 0.9, 2.4), Interval(1.5, 1.2, 1.9)
CHANGE = BlockChange("all blocks", 20.0, 80, WIDE, NARROW, 0.93, 1.55, (0.7, 1.4))


def effect(factor: Interval, steady: Interval = NARROW, drift_log_sd: float = 0.1) -> AfterEffect:
    """An after-effect with a pooled change."""
    return AfterEffect((), replace(CHANGE, factor=factor, steady=steady), 30, drift_log_sd, 0.5)


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (NARROW, "TMS alone evokes more than before: × 1.50 (90 % interval × 1.20 to × 1.90)."),
        (Interval(0.5, 0.3, 0.8), "TMS alone evokes less than before: × 0.50 (90 % interval × 0.30 to × 0.80)."),
        (WIDE, "No change is shown: TMS alone evokes × 1.50 (90 % interval × 0.90 to × 2.40) of what it did before."),
    ],
)
def test_a_change_is_said_only_where_the_interval_holds_none_of_1(factor: Interval, said: str) -> None:
    assert words.answer(effect(factor)) == said


def test_a_change_that_a_drift_would_explain_is_said_to_be_one_only_without_it() -> None:
    assert "only if the level did not drift" in words.drift(effect(WIDE))
    assert "Without one it is × 1.20 to × 1.90." in words.drift(effect(NARROW))


def test_a_statement_has_the_ratio_what_is_needed_and_that_one_person_shows_no_cause() -> None:
    said = " ".join(words.statement(effect(NARROW)))
    assert "without an effect nine of ten visits have × 0.70 to × 1.40" in said
    assert "control arm" in said
    assert "pulses before" in said
    assert "No number of pulses" in words.needed(effect(NARROW, drift_log_sd=0.5))


def test_the_dose_names_pairs_and_probes_apart() -> None:
    pairs = [Delivered(80.0 + place % 2, 30.0 * place, 0.1, probe=place % 5 == 0) for place in range(11)]
    assert words.dose(pairs) == "8 pairs at 80–81 ms and 3 probes of the window at 80–81 ms in 5 min."
    assert words.dose([]) == "No pair of stimuli was delivered."
