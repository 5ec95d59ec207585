from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from benchmarks.dissertation.claims import Claim, by_kind, claims_as_json, places, put_to_test, read_claims

from isiw.errors import InvalidValueError

CLAIM = {
    "where": "Table 6.2",
    "what": "Intervals of 300 ms are produced.",
    "theirs": "300",
    "ours": "299",
    "difference": "−1 ms",
    "verdict": "reproduced",
}


def test_claims_are_read_as_they_were_left(tmp_path: Path) -> None:
    path = tmp_path / "interval.json"
    path.write_text(json.dumps({"facts": {}, "claims": claims_as_json([Claim(**CLAIM)])}))
    assert read_claims(path) == [Claim(**CLAIM)]


@pytest.mark.parametrize("verdict", ["", "yes", "not", "not, because ", "under reading "])
def test_a_verdict_of_another_form_is_an_error(verdict: str) -> None:
    with pytest.raises(InvalidValueError):
        Claim(**CLAIM | {"verdict": verdict})


@pytest.mark.parametrize("verdict", ["under reading open loop", "not, because the text gives no number"])
def test_a_verdict_may_name_a_reading_or_a_reason(verdict: str) -> None:
    assert Claim(**CLAIM | {"verdict": verdict}).verdict == verdict


@pytest.mark.parametrize("verdict", ["by construction: it was put in", "fitted", "cannot fail here: no model was run"])
def test_what_holds_without_saying_anything_is_a_verdict_of_its_own(verdict: str) -> None:
    counts = by_kind([Claim(**CLAIM), Claim(**CLAIM | {"verdict": verdict})])
    assert counts == {"reproduced": 1, "under reading": 0, "not, because": 0, "holds, and could not fail": 1}


def test_a_claim_is_reproduced_only_if_it_fails_for_a_wrong_model() -> None:
    fails, holds = Claim(**CLAIM), Claim(**CLAIM | {"what": "Intervals are positive."})
    wrong = {"a fixed guess": [replace(fails, verdict="not, because it is off"), holds], "other noise": [fails, holds]}
    first, second = put_to_test([fails, holds], wrong)
    assert (first.verdict, first.fails_for) == ("reproduced", "a fixed guess")
    assert second.verdict == "cannot fail here: it holds as well for a fixed guess; other noise"


def test_a_claim_for_which_no_wrong_model_was_run_cannot_fail() -> None:
    (claim,) = put_to_test([Claim(**CLAIM)], {})
    assert claim.verdict == "cannot fail here: no wrong model was run for it"


def test_what_was_put_in_and_what_did_not_come_out_is_put_to_no_test() -> None:
    failed = Claim(**CLAIM | {"what": "It is 2.", "verdict": "not, because it is 1"})
    put_in = {"Intervals of 300": "fitted"}
    assert [claim.verdict for claim in put_to_test([Claim(**CLAIM), failed], {}, put_in)] == ["fitted", failed.verdict]


@pytest.mark.parametrize(
    "content", [[], {}, {"claims": {}}, {"claims": ["no"]}, {"claims": [{**CLAIM, "more": "x"}]}, {"claims": [{}]}]
)
def test_a_file_without_proper_claims_is_an_error(content: Any, tmp_path: Path) -> None:
    path = tmp_path / "vane.json"
    path.write_text(json.dumps(content))
    with pytest.raises(InvalidValueError):
        read_claims(path)


@pytest.mark.parametrize(
    ("where", "named"),
    [
        ("Table 6.2", ["Table 6.2"]),
        ("Fig. 4.31–4.33", ["Fig. 4.31", "Fig. 4.32", "Fig. 4.33"]),
        ("Tables 6.3, 6.4 and Figure 6.9", ["Table 6.3", "Table 6.4", "Fig. 6.9"]),
        ("4.4.8, Fig. 4.34, Table 4.1", ["Fig. 4.34", "Table 4.1"]),
        ("Fig. B.1", ["Fig. B.1"]),
        ("Figs. 5.12 and 5.13 (5.3.2)", ["Fig. 5.12", "Fig. 5.13"]),
        ("Fig. 7.10a", ["Fig. 7.10"]),
        ("5.4.1", []),
    ],
)
def test_a_claim_names_its_tables_and_figures(where: str, named: list[str]) -> None:
    assert places(where) == named
