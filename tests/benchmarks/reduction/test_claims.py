"""Claims: how a verdict is found, and that the text's own numbers reproduce every claim about its methods."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from benchmarks.reduction.claims import Statement, about, between, number, share, told
from benchmarks.reduction.comparison import WORDS
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.method_claims import method_claims, star_claims
from benchmarks.reduction.part_claims import initial_claims
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.significance import no_power

from benchmarks.reduction import dissertation as text

TRIALS = Statement[float]("Fig. 4.24", "NR needs 16 trials.", "16", lambda trials: share(trials, 16.0))


def dissertations_own() -> pd.DataFrame:
    """A comparison with the dissertation's numbers as ours."""
    return pd.DataFrame(
        [
            {
                "method": NAMES[method],
                "accelerometer": word,
                "sessions": 300,
                "trials": float(text.TRIALS[word][method]),
                "SE": 0.1,
                "F1 SE": 0.001,
                "F1: measured": text.F1[word][method],
                "r: measured": text.CORRELATION[method],
                "converged %": 100 * text.CONVERGED[word][method],
            }
            for word in WORDS.values()
            for method in text.METHODS
        ]
    )


def changed(method: str, column: str, value: float) -> pd.DataFrame:
    table = dissertations_own()
    table.loc[(table["method"] == method) & (table["accelerometer"] == "without"), column] = value
    return table


@pytest.mark.parametrize(
    ("trials", "verdict"),
    [
        ({"base": 17.0, "raw": 40.0}, "reproduced"),
        ({"base": 40.0, "raw": 17.0}, "under reading raw"),
        ({"base": 40.0, "a": 16.0, "b": 16.0, "c": 16.0, "d": 16.0}, "under reading a; b; c and 1 more"),
        ({"base": 40.0, "raw": 30.0}, "not, because none of 2 readings comes near enough; the closest, raw, has 30.0"),
    ],
)
def test_a_verdict_is_that_of_the_base_or_names_the_readings(trials: dict[str, float], verdict: str) -> None:
    claim = told(TRIALS, trials)
    assert claim.verdict == verdict
    assert claim.ours == f"{trials['base']:.1f}"


def test_a_claim_is_a_flat_record_of_strings() -> None:
    claim = told(TRIALS, {"base": 20.0})
    assert list(asdict(claim)) == ["where", "what", "theirs", "ours", "difference", "verdict", "fails_for"]
    assert (claim.theirs, claim.difference) == ("16", "+4.0 (+25 %)")


def test_a_reason_that_is_known_is_given() -> None:
    silent = Statement[None]("Fig. 1", "Marks.", "*", lambda _: about(holds=False, ours="n.s."), "they cannot be read")
    assert told(silent, {"base": None}).verdict == "not, because they cannot be read"


def test_a_number_with_errors_on_both_sides_holds_within_two_of_the_difference() -> None:
    assert [between(n, 16.0, 1.5).holds for n in (12.9, 13.1, 18.9, 19.1)] == [False, True, True, False]
    assert between(17.0, 16.0, 2.0).difference == "+1.0 (-3.0 to +5.0), +0.5 standard errors"


def test_a_number_whose_own_error_could_hold_a_fifth_of_the_texts_says_nothing() -> None:
    said = Statement[float](
        "Fig. 4.24", "PF needs 190 trials.", "190", lambda own: between(150.0, 190.0, 40.0, own=own)
    )
    assert told(said, {"base": 10.0}).verdict == "reproduced"
    assert told(said, {"base": 35.0}).verdict.startswith("cannot fail here: its own error of 70.0 could hold a fifth")
    far = Statement[float]("Fig. 4.24", "PF", "190", lambda own: between(150.0 if own else 400.0, 190.0, 40.0, own=own))
    assert told(far, {"base": 0.0, "few": 35.0}).verdict.startswith("not, because")


def test_not_significant_by_a_test_without_power_says_nothing() -> None:
    rng = np.random.default_rng(1)
    noisy, still = (pd.Series(rng.normal(0.0, sd, 11)) for sd in (0.3, 0.02))
    assert "with a power of 0." in no_power(noisy)
    assert no_power(still) == ""


@pytest.mark.slow
def test_a_direction_that_is_smaller_than_its_errors_is_no_improvement() -> None:
    what = "The accelerometer improves SVMR: no more trials, and no lower F1."
    clear, vague = dissertations_own(), dissertations_own().assign(**{"SE": 20.0, "F1 SE": 0.2})
    verdicts = [{c.what: c.verdict for c in method_claims({"own": table})}[what] for table in (clear, vague)]
    assert verdicts[0] == "reproduced"
    assert verdicts[1].startswith("not, because")


def test_trials_hold_within_thirty_percent_and_shares_within_a_tenth() -> None:
    assert [share(n, 100.0).holds for n in (69.0, 70.0, 130.0, 131.0)] == [False, True, True, False]
    assert [number(f1, 0.8).holds for f1 in (0.69, 0.7, 0.9, 0.91)] == [False, True, True, False]
    near = number(0.75, 0.8)
    assert (near.ours, near.difference) == ("0.75", "-0.05")
    assert near.off == pytest.approx(-0.05)


def test_the_texts_own_numbers_reproduce_every_claim_about_its_methods() -> None:
    broken = {claim.what for claim in method_claims({"own": dissertations_own()}) if claim.verdict != "reproduced"}
    assert not broken


@pytest.mark.slow
def test_an_order_that_is_turned_round_fails_and_a_reading_brings_it_back() -> None:
    worse = changed("PF", "F1: measured", 0.9)
    what = "The methods' order by F1, without accelerometer."
    verdict = {c.what: c.verdict for c in method_claims({"base": worse, "PF: ± 50 ms": dissertations_own()})}
    assert verdict[what] == "under reading PF: ± 50 ms"
    assert verdict["NR without accelerometer needs 16 trials."] == "reproduced"


def test_readings_of_the_particle_filter_say_nothing_about_others() -> None:
    verdict = {
        c.what: c.verdict
        for c in method_claims({"base": changed("NR", "trials", 99.0), "PF: ± 50 ms": dissertations_own()})
    }
    assert verdict["NR without accelerometer needs 16 trials."].startswith("not, because")


def test_initial_observations_are_judged_on_either_kind_of_people() -> None:
    errors = {"F1 SE": 0.01, "trials SE": 0.1}
    rows = [
        {"cohort": cohort, "method": method, "accelerometer": word, "initial": n, "F1": f1, "trials": 20.0, **errors}
        for cohort, peak in ((PEOPLE, 3), ("gaussian", 6))
        for method in ("nr", "svmr", "gpr")
        for word in WORDS.values()
        for n in range(2, 10)
        for f1 in [1.0 - 0.1 * abs(n - peak)]
    ]
    verdict = {claim.what: claim for claim in initial_claims(pd.DataFrame(rows))}
    assert verdict["SVMR with accelerometer: F1 is best at 3."].verdict == "reproduced"
    best = verdict["GPR without accelerometer: F1 is best at 6."]
    assert (best.ours, best.verdict) == (
        "best at 3 (1.00); 0.70 where the text has it",
        "under reading constant-CV noise",
    )


@pytest.mark.slow
def test_the_marks_of_significance_are_of_paired_tests_over_people() -> None:
    rng = np.random.default_rng(1)
    correlation = {"nr": 0.4, "svmr": 0.6, "gpr": 0.9, "pf": 0.6, "incremental": 0.5}
    rows = pd.DataFrame(
        [
            {
                "method": method,
                "person": person,
                "accelerometer": False,
                "correlation, measured": r + 0.05 * rng.standard_normal(),
                "f1, measured": 0.7 + 0.05 * rng.standard_normal(),
                "trials": (500.0 if method == "incremental" else 20.0) + rng.standard_normal(),
            }
            for method, r in correlation.items()
            for person in range(11)
        ]
    )
    verdict = {claim.what: claim.verdict for claim in star_claims(rows)}
    assert verdict["GPR correlates significantly better than NR."] == "reproduced"
    assert verdict["NR needs significantly fewer trials than the conventional sweep."] == "reproduced"
    assert verdict["SVMR and PF do not differ significantly in correlation."] == "reproduced"
    assert verdict["SVMR and GPR do not differ significantly in correlation."].startswith("not, because here")
