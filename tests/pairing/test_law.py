from __future__ import annotations

import numpy as np
import pytest

from isiw.pairing.law import LATENTS, Pulses, curvatures, scores
from isiw.types import FloatArray

FOREARM = np.array([np.log(0.01), np.log(0.2), 104.0, np.log(0.3), np.log(7.0), np.log(0.4), np.log(0.25)])
HAND = np.array([np.log(0.01), np.log(0.2), 117.0, np.log(0.23), np.log(7.0), np.log(0.4), np.log(1.5)])


def drawn(latents: FloatArray, pct_rmt: float, number: int) -> FloatArray:
    """MEPs of the law [mV], drawn without its nodes."""
    rng = np.random.default_rng(1)
    floor, floor_sd, x50, slope, input_sd, output_sd, level = latents
    inputs, outputs, floors = rng.standard_normal((3, number))
    drive = np.exp(slope) * (pct_rmt + np.exp(input_sd) * inputs - x50)
    evoked = np.exp(level + np.exp(output_sd) * outputs) / (1.0 + np.exp(-drive))
    return np.asarray(np.exp(floor + np.exp(floor_sd) * floors) + evoked)


@pytest.mark.parametrize("latents", [FOREARM, HAND])
@pytest.mark.parametrize("pct_rmt", [90.0, 105.0, 125.0])
def test_the_density_is_that_of_meps_drawn_from_the_recruitment_curve(latents: FloatArray, pct_rmt: float) -> None:
    log_mep = np.linspace(-7.0, 4.0, 2201)
    pulses = Pulses(log_mep, np.zeros(len(log_mep), bool), np.full(len(log_mep), pct_rmt))
    below = np.cumsum(np.exp(scores(pulses, np.tile(latents, (len(log_mep), 1))).value)) * (log_mep[1] - log_mep[0])
    assert below[-1] == pytest.approx(1.0, abs=0.01)
    usual = np.log(drawn(latents, pct_rmt, 40_000))
    for share in (0.1, 0.5, 0.9):  # three in a hundred are artefacts, which the drawn ones are not
        assert np.interp(np.quantile(usual, share), log_mep, below) == pytest.approx(share, abs=0.035)


def test_an_mep_of_0_has_the_probability_of_all_below_the_limit() -> None:
    meps_mv, limit_mv = drawn(FOREARM, 95.0, 40_000), 0.02
    hidden = Pulses(np.log([limit_mv]), np.array([True]), np.array([95.0]))
    assert np.exp(scores(hidden, FOREARM[None]).value[0]) == pytest.approx((meps_mv < limit_mv).mean(), abs=0.03)


@pytest.mark.parametrize("latents", [FOREARM, HAND])
def test_derivatives_are_those_of_the_density(latents: FloatArray) -> None:
    log_mep = np.log([0.004, 0.012, 0.02, 0.1, 0.9, 3.0, 0.02])
    pulses = Pulses(log_mep, np.arange(7) == 6, np.linspace(90.0, 130.0, 7))
    at = np.tile(latents, (7, 1))
    steps = 1e-5 * np.eye(len(LATENTS))
    slopes = [(scores(pulses, at + step).value - scores(pulses, at - step).value) / 2e-5 for step in steps]
    assert scores(pulses, at).gradient == pytest.approx(np.stack(slopes, axis=-1), abs=1e-6)
    found = curvatures(pulses, at)
    assert found == pytest.approx(np.swapaxes(found, 1, 2))
