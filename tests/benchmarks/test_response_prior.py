"""The prior that is fitted to recorded single pulses: its laws are the default's, and it finds what made the data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from benchmarks.recorded_people import Bank
from benchmarks.response_evidence import DRAWS, drawn, mixtures
from benchmarks.response_laws import NAMES, Mixture, evoked, log_likelihood, pulses_of
from benchmarks.response_prior import GRID, TODAY, Evidence, Fit, by_person, fitted, main, read_folds
from scipy.integrate import quad

from isiw.models.particles.laws import NoiseShares
from isiw.models.particles.prior import Prior
from isiw.types import FloatArray

KINDS = list(NAMES)
USUAL: Mapping[str, float] = {
    "log_floor": np.log(0.01),
    "log_floor_sd": np.log(0.2),
    "log_ratio": np.log(20.0),
    "log_cv": np.log(0.6),
    "log_bend": 0.0,
    "reliability": 1.0,
    "switched_on": 1.5,
    "switched_off": -3.0,
    "log_slope": np.log(0.25),
    "log_input_sd": np.log(1.7),
    "log_sigma_y": np.log(0.4),
    "rest": -15.0,
    "log_onset": np.log(0.1),
}


def usual(kind: str) -> FloatArray:
    return np.array([[USUAL[name] for name in NAMES[kind]]])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("intensity_pct_rmt", [90.0, 110.0])
def test_a_law_is_a_density_of_the_log_amplitude(kind: str, intensity_pct_rmt: float) -> None:
    def density(log_mv: float) -> float:
        return float(np.exp(log_likelihood(kind, usual(kind), [(intensity_pct_rmt, np.exp([log_mv]))])[0]))

    total, _ = quad(density, np.log(1e-4), np.log(10.0), limit=400, points=[np.log(0.02), np.log(2.0)])
    assert total == pytest.approx(1.0, abs=0.005)


@pytest.mark.parametrize("kind", KINDS)
def test_stronger_pulses_evoke_more_or_more_often(kind: str) -> None:
    weak, strong = (evoked(kind, usual(kind), at) for at in (100.0, 115.0))
    expected = [float((each.probability * each.ratio.mean(1, keepdims=True)).item()) for each in (weak, strong)]
    assert expected[1] > 1.3 * expected[0]


@pytest.mark.parametrize("kind", ["constant_cv", "missing"])
def test_without_a_curve_a_pulse_at_90_percent_evokes_nothing(kind: str) -> None:
    weakest = evoked(kind, usual(kind), 90.0)
    assert float((weakest.probability * weakest.ratio).max()) == 0.0


def bank_of_a_curve(person: int, seed: int) -> Bank:
    """Pulses of a hand's recruitment curve, half of whose largest MEP lies at 114 % RMT."""
    rng = np.random.default_rng(seed)
    levels = np.array([90.0, 100.0, 110.0, 120.0, 130.0])
    drive = 0.23 * (levels[:, None] - 114.0) + 1.65 * rng.standard_normal((5, 12))
    evoked_mv = 1.0 / (1.0 + np.exp(-drive)) * np.exp(0.39 * rng.standard_normal((5, 12)))
    return Bank(person, "a", levels, tuple(evoked_mv + 0.01 * np.exp(0.2 * rng.standard_normal((5, 12)))))


def test_stronger_pulses_than_a_pair_is_worth_are_left_out() -> None:
    assert [level for level, _ in pulses_of(bank_of_a_curve(1, 0))] == [90.0, 100.0, 110.0, 120.0]


@pytest.mark.slow
def test_evidence_does_not_depend_on_the_draws_and_is_that_of_the_prior() -> None:
    kind, pulses = "recruitment", pulses_of(bank_of_a_curve(1, 0))[:1]
    bank, prior = Bank(1, "a", np.array([90.0]), (pulses[0][1],)), mixtures(Prior(muscle="hand"))[kind]
    found = [drawn(kind, bank, prior, np.random.default_rng(seed)).log_evidence(prior) for seed in (1, 2)]
    plain = log_likelihood(kind, prior.sample(10 * DRAWS, np.random.default_rng(3)), pulses)
    assert found == pytest.approx(2 * [float(np.log(np.exp(plain).mean()))], abs=0.15)


@pytest.mark.slow
def test_draws_of_one_prior_say_the_evidence_of_another() -> None:
    bank = bank_of_a_curve(1, 4)
    narrow, wide = (Mixture(m.shares, m.means, factor * m.sds) for factor, m in ((1.0, HAND), (1.3, HAND)))
    draws, own = (drawn("recruitment", bank, prior, np.random.default_rng(1)) for prior in (narrow, wide))
    assert draws.log_evidence(wide) == pytest.approx(own.log_evidence(wide), abs=0.3)
    assert draws.ess(narrow) > 100


HAND = mixtures(Prior(muscle="hand"))["recruitment"]


def made_up(better: float, banks: int = 30) -> Evidence:
    """Evidence of so much more per bank for recruitment curves, of all points of the grid most at a median of −20."""
    by_kind = np.zeros((len(GRID), banks, len(KINDS)))
    by_kind[:, :, KINDS.index("recruitment")] = better - np.abs(GRID - (-20.0, 4.0)).sum(1)[:, None]
    return Evidence(by_kind, np.arange(banks, dtype=np.int64) % 10 + 1)


def test_a_kind_that_all_data_support_gets_what_one_persons_share_of_today_leaves() -> None:
    fit = fitted(made_up(20.0).by_kind)
    today = NoiseShares()
    assert fit.rest_pct == (-20.0, 4.0)
    assert fit.shares[2] == pytest.approx((30 + 3 * today.recruitment) / 33, abs=1e-3)
    assert fit.shares[1] == pytest.approx(3 * today.missing / 33, abs=1e-3)
    assert sum(fit.shares) == pytest.approx(1.0)


def test_data_that_say_nothing_leave_the_shares_of_today() -> None:
    flat = np.zeros((len(GRID), 30, len(KINDS)))
    assert fitted(flat).shares == pytest.approx(astuple(NoiseShares()))


def test_the_fitted_prior_is_the_defaults_but_for_six_numbers() -> None:
    prior, today = Fit((0.1, 0.1, 0.6, 0.1, 0.1), (-20.0, 5.0)).prior(), Prior()
    assert prior.noise == NoiseShares(0.1, 0.1, 0.6, 0.1, 0.1)
    assert [m.rest_pct for m in prior.muscles if m.name == "hand"] == [(-20.0, 5.0, 0.0)]
    assert Fit(astuple(today.noise), TODAY).prior() == today


@pytest.mark.slow
def test_a_person_is_judged_by_a_fit_to_the_others_with_all_coils_left_out() -> None:
    evidence = made_up(5.0)
    evidence.by_kind[:, evidence.persons == 3, KINDS.index("all_or_none")] += 50.0
    folds = {person: fitted(evidence.without(person)) for person in (1, 3)}
    of_all = fitted(evidence.by_kind)
    assert of_all.shares[3] > 0.08 > folds[3].shares[3]
    table = by_person(evidence, folds)
    first, third, _ = table["fitted less today"].tolist()
    assert third < 0 < first
    assert table["banks"].tolist() == [3, 3, 6]


def test_folds_are_read_as_they_were_written() -> None:
    folds = {1: Fit((0.1, 0.1, 0.6, 0.1, 0.1), (-20.0, 5.0))}
    written = {"folds": {str(p): {"shares": list(f.shares), "rest_pct": list(f.rest_pct)} for p, f in folds.items()}}
    assert read_folds(written) == folds


def test_without_the_recordings_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(data=tmp_path / "nowhere", out=tmp_path / "result")
    assert "the recordings are not at hand" in capsys.readouterr().out


@pytest.mark.slow
def test_recruitment_curves_are_recognised() -> None:
    kinds, bank, laws = ("recruitment", "constant_cv", "all_or_none"), bank_of_a_curve(1, 2), mixtures(Prior())
    found = [drawn(kind, bank, laws[kind], np.random.default_rng(1)).log_evidence(laws[kind]) for kind in kinds]
    assert found[0] > max(found[1:]) + 2.0
