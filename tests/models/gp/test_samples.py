"""Paths: their windows by the 0.135 rule, their floors, and their distribution."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from botorch.posteriors.gpytorch import GPyTorchPosterior

from isiw.design import DesignSpace
from isiw.excess import window_from_excess
from isiw.models.gp.fit import fit as fit_of
from isiw.models.gp.model import Paths, ProfileSample, draw_paths
from isiw.models.gp.prior import FixedProcess, HyperparameterPrior, ProcessSettings, Standardisation
from isiw.models.shared.history import FloorKind, PersonTrials
from isiw.window import Window
from known import known

SPACE = DesignSpace(0, 320, reference="impact")
GRID_MS = torch.tensor(SPACE.grid_ms)
PATH_ISIS_MS = torch.linspace(0, 320, 81, dtype=torch.float64)


def bump(middle_ms: float, sd_ms: float, height_mv: float) -> torch.Tensor:
    return height_mv * torch.exp(-0.5 * ((PATH_ISIS_MS - middle_ms) / sd_ms).square())


def sample(
    expected_mv: torch.Tensor, *, floor: FloorKind = "subtracted", alone_mv: float = np.nan, present: bool = True
) -> ProfileSample:
    """One person's only path, without noise."""
    level = expected_mv.log()[None, None, :]
    paths = Paths(
        level=level,
        noise_sd=torch.full_like(level, 1e-6),
        alone=torch.full((1, 1), np.log(alone_mv), dtype=torch.float64),
        alone_sd=torch.full((1, 1), 1e-6, dtype=torch.float64),
        present=torch.tensor([[present]]),
    )
    return ProfileSample(PATH_ISIS_MS, paths, "log", floor)


def window(drawn: ProfileSample) -> Window | None:
    return Window.from_mask(SPACE.grid_ms, drawn.window_masks(GRID_MS)[0, 0])


@pytest.mark.parametrize(
    ("middle_ms", "sd_ms", "alone_mv", "within_ms"),
    [
        (160.0, 12.0, np.nan, 4),
        (20.0, 25.0, np.nan, 4),
        (310.0, 25.0, np.nan, 4),
        # The floor that is guessed has some of the tails of a window that fills most of the range.
        (150.0, 57.0, np.nan, 14),
        (150.0, 57.0, 0.01, 1),
    ],
)
def test_the_window_of_a_clean_path_is_that_of_the_rule(
    middle_ms: float, sd_ms: float, alone_mv: float, within_ms: float
) -> None:
    excess_mv = bump(middle_ms, sd_ms, 0.08)
    expected = window_from_excess(SPACE.grid_ms, np.interp(GRID_MS, PATH_ISIS_MS, excess_mv), 0.01)
    got = window(sample(0.01 + excess_mv, alone_mv=alone_mv))
    assert got is not None
    assert expected is not None
    assert abs(got.start_ms - expected.start_ms) <= within_ms
    assert abs(got.end_ms - expected.end_ms) <= within_ms


def test_the_floor_of_a_clean_path_is_found() -> None:
    assert sample(0.01 + bump(160, 25, 0.08)).floor_mv.item() == pytest.approx(0.01, rel=0.02)


def test_two_peaks_make_two_segments_and_a_ripple_makes_none() -> None:
    peaks = 0.01 + bump(80, 12, 0.08) + bump(240, 12, 0.05)
    assert len(known(window(sample(peaks))).segments) == 2
    ripple = 0.01 + bump(80, 12, 0.08) + bump(240, 12, 0.02)
    assert len(known(window(sample(ripple))).segments) == 1


def test_a_path_that_hardly_rises_has_no_window() -> None:
    assert window(sample(0.05 + bump(160, 25, 0.004))) is None
    assert window(sample(0.05 + bump(160, 25, 0.006))) is not None
    assert window(sample(0.001 + bump(160, 25, 0.0015))) is None


def test_where_a_tap_changes_nothing_there_is_no_window() -> None:
    assert window(sample(0.01 + bump(160, 25, 0.08), present=False)) is None


def test_a_told_floor_is_the_floor() -> None:
    drawn = sample(0.02 + bump(160, 25, 0.08), alone_mv=0.03)
    assert drawn.floor_mv.item() == pytest.approx(0.03, rel=1e-6)
    assert known(window(drawn)).width_ms < known(window(sample(0.02 + bump(160, 25, 0.08)))).width_ms


@pytest.mark.parametrize("floor", ["raw", "zeroed"])
def test_a_floor_that_is_not_subtracted_hides_the_edges(floor: FloorKind) -> None:
    drawn = sample(0.02 + bump(160, 25, 0.08), floor=floor)
    assert drawn.floor_mv.item() == 0
    assert window(drawn) == Window(0, 320)
    assert known(window(sample(0.002 + bump(160, 25, 0.08), floor=floor))).width_ms < 110


def test_beyond_the_range_a_profile_is_as_at_its_end() -> None:
    drawn = sample(0.01 + bump(320, 25, 0.08))
    inside, beyond = drawn.expected_mep_mv(torch.tensor([320.0, 329.0]))[0, 0].tolist()
    assert inside == beyond


def test_drawn_paths_have_the_mean_and_the_covariance_of_the_process() -> None:
    # 20,000 paths: means within 5 and variances within 8 standard errors.
    rng = np.random.default_rng(0)
    told = PersonTrials(rng.uniform(0, 320, 12), rng.lognormal(-4, 0.8, 12), np.empty(0))
    prior, scale = HyperparameterPrior(p_window=1.0), Standardisation("log", 0.005, -4.0, 0.7)
    fit = fit_of(ProcessSettings("rbf", prior=prior, fixed=FixedProcess(40.0, 1.1, 0.6, -4.0, 0.7)), scale, told)
    isi_ms = torch.linspace(0, 320, 9, dtype=torch.float64)
    level = draw_paths(fit, isi_ms, 20_000, rng).level
    with torch.no_grad():
        posterior = fit.regression(torch.tensor(0)).posterior(isi_ms[:, None])
    assert isinstance(posterior, GPyTorchPosterior)
    mean, covariance = -4.0 + 0.7 * posterior.mean[:, 0], 0.49 * posterior.distribution.covariance_matrix
    error = covariance.diagonal().sqrt() / 20_000**0.5
    assert ((level.mean(0) - mean).abs() < 5 * error).all()
    variance = covariance.diagonal()
    bound = 8 * torch.outer(variance, variance).sqrt() / 20_000**0.5
    assert ((torch.cov(level.T) - covariance).abs() < bound).all()


@pytest.mark.parametrize("alone", [1, 4])
def test_the_floor_is_drawn_with_its_path_from_what_all_trials_tell(alone: int) -> None:
    # The joint Gaussian of all trials, path and constant by hand; the baselines lie a unit below the other trials.
    # 20,000 paths: means within 5 and covariances within 8 standard errors.
    rng = np.random.default_rng(0)
    isis_ms = np.concatenate((rng.uniform(0, 320, 40), np.zeros(alone), np.linspace(0, 320, 9), np.zeros(1)))
    amplitude = np.repeat([1.1, 0.0, 1.1, 0.0], [40, alone, 9, 1])
    values = np.concatenate((rng.normal(0.5, 0.6, 40), rng.normal(-0.5, 0.1, alone)))
    steps = 5**0.5 / 30.0 * np.abs(isis_ms[:, None] - isis_ms)
    shared = 1.0 + amplitude[:, None] * amplitude * (1 + steps + steps**2 / 3) * np.exp(-steps)
    n = len(values)
    gain = np.linalg.solve(shared[:n, :n] + 0.36 * np.eye(n), shared[:n, n:]).T
    mean, covariance = -4.0 + 0.7 * gain @ values, 0.49 * (shared[n:, n:] - gain @ shared[:n, n:])

    meps_mv = np.exp(-4.0 + 0.7 * values)
    told, fixed = PersonTrials(isis_ms[:40], meps_mv[:40], meps_mv[40:]), FixedProcess(30.0, 1.1, 0.6, -4.0, 0.7)
    settings = ProcessSettings("matern", prior=HyperparameterPrior(p_window=1.0), fixed=fixed)
    fit = fit_of(settings, Standardisation("log", 0.005, -4.0, 0.7), told)
    paths = draw_paths(fit, torch.as_tensor(isis_ms[n:-1]), 20_000, rng)
    drawn = np.column_stack((paths.level, paths.alone))
    sd = covariance.diagonal() ** 0.5
    assert (np.abs(drawn.mean(0) - mean) < 5 * sd / 20_000**0.5).all()
    assert (np.abs(np.cov(drawn.T) - covariance) < 8 * np.outer(sd, sd) / 20_000**0.5).all()


def test_constant_paths_have_the_posterior_of_the_constant() -> None:
    # Nearly certain that the tap changes nothing: conjugate mean and variance of a constant with a unit prior.
    rng = np.random.default_rng(0)
    told = PersonTrials(rng.uniform(0, 320, 12), rng.lognormal(-4, 0.3, 12), rng.lognormal(-4, 0.3, 4))
    fixed = FixedProcess(40.0, 1.1, 0.6, -4.5, 0.7)
    settings = ProcessSettings("rbf", prior=HyperparameterPrior(p_window=1e-9), fixed=fixed)
    fit = fit_of(settings, Standardisation("log", 0.005, -4.5, 0.7), told)
    paths = draw_paths(fit, PATH_ISIS_MS, 20_000, rng)
    values = (np.log(np.concatenate((told.mep_mv, told.baseline_mv))) + 4.5) / 0.7
    precision = 1 + 16 / 0.36
    mean, sd = -4.5 + 0.7 * values.sum() / 0.36 / precision, 0.7 * precision**-0.5
    assert not paths.present.any()
    assert (paths.level == paths.level[:, :1]).all()
    assert paths.level[:, 0].mean().item() == pytest.approx(mean, abs=5 * sd / 20_000**0.5)
    assert paths.level[:, 0].std().item() == pytest.approx(sd, rel=0.03)


def test_the_mass_of_outcomes_is_that_of_gaussian_noise() -> None:
    level = torch.tensor([[[0.0, 0.0], [2.0, 2.0]]])
    noise = torch.full_like(level, 0.5)
    nobody = torch.full((1, 2), torch.nan)
    drawn = ProfileSample(
        torch.tensor([0.0, 320.0]), Paths(level, noise, nobody, nobody, torch.ones(1, 2).bool()), "log", "subtracted"
    )
    mass = drawn.outcome_mass(torch.tensor([100.0]))[0, :, 0]
    values = torch.linspace(-1.25, 3.25, mass.shape[-1])
    torch.testing.assert_close(mass.sum(-1), torch.ones(2))
    torch.testing.assert_close(mass @ values, torch.tensor([0.0, 2.0]), rtol=0, atol=0.02)
    spread = (mass @ values.square() - (mass @ values).square()).sqrt()
    torch.testing.assert_close(spread, torch.full((2,), 0.5), rtol=0, atol=0.03)
