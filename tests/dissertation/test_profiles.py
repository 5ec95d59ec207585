"""The form of a profile: the curve that made it is chosen, and values that are not normal are told as such."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm, shapiro

from isiw.dissertation.profiles import ProfileFit, best_fit, normality, profile_fits
from isiw.errors import InvalidValueError
from isiw.types import FloatArray

ISIS_MS = np.arange(30.0, 111.0, 2.0)


def bell(mean_ms: float, sd_ms: float) -> FloatArray:
    return np.asarray(np.exp(-0.5 * ((ISIS_MS - mean_ms) / sd_ms) ** 2))


PROFILES = {
    "1 Gaussian": 0.5 + 0.8 * bell(70, 10),
    "2 Gaussians": 0.5 + 0.8 * bell(85, 7) - 0.3 * bell(50, 6),
    "3 Gaussians": 0.5 + 0.8 * bell(95, 4) - 0.4 * bell(65, 5) + 0.5 * bell(42, 4),
}


@pytest.fixture(scope="module", params=PROFILES)
def made(request: pytest.FixtureRequest) -> tuple[str, FloatArray, tuple[ProfileFit, ...]]:
    name: str = request.param
    noise_mv = 0.02 * np.random.default_rng(4).standard_normal(len(ISIS_MS))
    return name, PROFILES[name], profile_fits(ISIS_MS, PROFILES[name] + noise_mv, most=4)


@pytest.mark.slow
def test_the_curve_that_made_a_profile_is_chosen(made: tuple[str, FloatArray, tuple[ProfileFit, ...]]) -> None:
    name, profile_mv, fits = made
    chosen = best_fit(fits)
    assert chosen.name == name
    np.testing.assert_allclose(chosen.mean_mv(ISIS_MS), profile_mv, atol=0.04)


def test_more_gaussians_leave_less_unexplained(made: tuple[str, FloatArray, tuple[ProfileFit, ...]]) -> None:
    _, _, fits = made
    rms_mv = [fit.rms_mv for fit in fits[:-1]]
    assert rms_mv == sorted(rms_mv, reverse=True)
    assert [fit.parameters for fit in fits[:-1]] == [5, 8, 11, 14]
    assert 3 < fits[-1].parameters < len(ISIS_MS)


def test_a_depression_is_a_gaussian_below_the_baseline() -> None:
    fit = profile_fits(ISIS_MS, PROFILES["2 Gaussians"], most=2)[1]
    amplitudes, means, sds = fit.gaussians[fit.gaussians[:, 1].argsort()].T
    np.testing.assert_allclose(amplitudes, [-0.3, 0.8], atol=1e-3)
    np.testing.assert_allclose(means, [50, 85], atol=0.01)
    np.testing.assert_allclose(np.abs(sds), [6, 7], atol=0.02)


def test_trials_at_one_isi_count_by_their_mean() -> None:
    profile_mv = PROFILES["1 Gaussian"]
    twice = np.concatenate([profile_mv - 0.1, profile_mv + 0.1])
    once, both = profile_fits(ISIS_MS, profile_mv, most=1), profile_fits(np.tile(ISIS_MS, 2), twice, most=1)
    np.testing.assert_allclose(once[0].gaussians, both[0].gaussians, rtol=1e-6)


def test_criteria_are_those_of_normal_residuals() -> None:
    noise_mv = 0.02 * np.random.default_rng(4).standard_normal(len(ISIS_MS))
    fit = profile_fits(ISIS_MS, PROFILES["1 Gaussian"] + noise_mv, most=1)[0]
    n, p = len(ISIS_MS), 5
    residuals_mv = PROFILES["1 Gaussian"] + noise_mv - fit.mean_mv(ISIS_MS)
    sd_mv = math.sqrt((residuals_mv**2).mean())
    log_likelihood = norm.logpdf(residuals_mv, scale=sd_mv).sum()
    constant = n * math.log(2 * math.pi) + n
    assert fit.aicc + constant == pytest.approx(2 * p - 2 * log_likelihood + 2 * p * (p + 1) / (n - p - 1))


@pytest.mark.slow
def test_a_curve_with_as_many_parameters_as_isis_is_never_chosen() -> None:
    fits = profile_fits(ISIS_MS[:8], PROFILES["1 Gaussian"][:8], most=3)
    assert [math.isinf(fit.aicc) for fit in fits[:-1]] == [False, True, True]


@pytest.mark.parametrize(
    ("isi_ms", "mep_mv", "most", "said"),
    [
        ([1, 2, 3, 4, 5], [1, 2, 3, 4], 1, "one ISI and one MEP"),
        ([1, 2, 3, 4, 5], [1, 2, math.nan, 4, 5], 1, "finite"),
        ([1, 1, 2, 3, 4], [1, 2, 3, 4, 5], 1, "too few ISIs"),
        ([1, 2, 3, 4, 5], [1, 2, 3, 4, 5], 0, "number of Gaussians"),
    ],
)
def test_what_is_no_profile_is_refused(isi_ms: list[float], mep_mv: list[float], most: int, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        profile_fits(isi_ms, mep_mv, most)


def test_normal_values_pass_and_skewed_ones_fail() -> None:
    rng = np.random.default_rng(2)
    assert normality(rng.standard_normal(40)).normal
    skewed = rng.exponential(size=40)
    found = normality(skewed)
    assert not found.normal
    assert (found.statistic, found.p_value) == pytest.approx(tuple(shapiro(skewed)))


@pytest.mark.parametrize(
    ("values", "said"),
    [([1.0, 2.0], "at least three"), ([1.0, 2.0, math.inf], "finite"), ([1.0, 1.0, 1.0], "all the same")],
)
def test_what_cannot_be_tested_is_refused(values: list[float], said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        normality(values)


def test_the_level_of_a_test_lies_between_0_and_1() -> None:
    with pytest.raises(InvalidValueError, match="level"):
        normality([1.0, 2.0, 4.0], level=1.0)
