"""The main comparison played alone: which verdicts its sessions change."""

from __future__ import annotations

from dataclasses import replace

import pytest
from benchmarks.dissertation.claims import NONE, Claim
from benchmarks.reduction.rows import again

BEFORE = Claim("Fig. 4.24", "PF with accelerometer needs 190 trials.", "190", "120.0", "-70", "reproduced", "a guess")


@pytest.mark.parametrize(
    ("was", "now", "verdict", "fails_for"),
    [
        ("reproduced", "reproduced", "reproduced", "a guess"),
        ("cannot fail here: it holds as well", "reproduced", "cannot fail here: it holds as well", NONE),
        ("not, because", "reproduced", "cannot fail here: no wrong model was run for it with so many sessions", NONE),
        ("reproduced", "not, because it is less", "not, because it is less", NONE),
        (
            "not, because none of 6 readings",
            "not, because … no reading was tried for it",
            "not, because none of 6 readings",
            NONE,
        ),
        ("reproduced", "not, because … no reading was tried for it", "not, because it comes out otherwise", NONE),
        ("under reading base", "not, because it is less", "under reading base", NONE),
        ("reproduced", "cannot fail here: its own error", "cannot fail here: its own error", NONE),
    ],
)
def test_a_claim_gets_new_numbers_and_no_verdict_for_which_nothing_was_run(
    was: str, now: str, verdict: str, fails_for: str
) -> None:
    before = replace(BEFORE, verdict=was + (" x" if was == "not, because" else ""))
    before = before if was == "reproduced" else replace(before, fails_for=NONE)
    found = again(before, replace(BEFORE, ours="147.0", difference="-43", verdict=now, fails_for=NONE))
    assert (found.verdict, found.fails_for) == (verdict, fails_for)
    assert found.ours == "147.0"


def test_a_claim_about_something_else_stays_as_it_was() -> None:
    assert again(BEFORE, BEFORE) is BEFORE
