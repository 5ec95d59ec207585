"""Scales of amplitudes: there and back, and what few or odd amplitudes come to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from isiw.models.gp.prior import Standardisation, Transform, expected_mep_mv, scale_of, transformed
from isiw.types import FloatArray

MEPS_MV = np.random.default_rng(1).lognormal(np.log(0.03), 0.8, 200)
TRANSFORMS: list[Transform] = ["log", "sqrt", "none"]


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_many_amplitudes_have_mean_0_and_sd_1(transform: Transform) -> None:
    values = scale_of(MEPS_MV, transform, 0.005).standardised(MEPS_MV)
    assert abs(values.mean().item()) < 1e-12
    assert values.std().item() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("meps_mv", [[], [0.02], [0.0] * 12, [0.05] * 12], ids=["none", "one", "zeros", "equal"])
def test_amplitudes_that_do_not_vary_have_a_scale(transform: Transform, meps_mv: list[float]) -> None:
    scale = scale_of(np.array(meps_mv), transform, 0.005)
    assert scale.unit > 0
    assert torch.isfinite(scale.standardised(np.array([0.0, 0.01, 1.0]))).all()


def test_zero_is_taken_for_the_detection_limit() -> None:
    assert transformed(np.array([0.0]), "log", 0.005)[0] == pytest.approx(np.log(0.005))


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_the_expected_mep_is_the_mean_of_simulated_ones(transform: Transform) -> None:
    level, noise_sd = float(transformed(np.array([0.08]), transform, 0.005)[0]), 0.02
    values = level + noise_sd * np.random.default_rng(2).standard_normal(1_000_000)
    inverses: dict[str, Callable[[FloatArray], FloatArray]] = {"log": np.exp, "sqrt": np.square, "none": np.asarray}
    expected = expected_mep_mv(torch.tensor(level), torch.tensor(noise_sd), transform).item()
    assert expected == pytest.approx(inverses[transform](values).mean(), rel=1e-3)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_the_jacobian_makes_densities_of_log_amplitudes(transform: Transform) -> None:
    scale = Standardisation(transform, 0.005, centre=0.3, unit=0.7)
    high, low = (scale.standardised(np.array([0.04 * np.exp(step)])).item() for step in (1e-6, -1e-6))
    assert scale.log_jacobian(np.array([0.04])) == pytest.approx(np.log((high - low) / 2e-6), abs=1e-6)
