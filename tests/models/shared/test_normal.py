"""Logarithms of normal probabilities against mpmath, over all that priors reach, in torch and in the engine."""

from __future__ import annotations

import math
import mpmath
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from isiw.design import DesignSpace
from isiw.models.particles.engine import Compiled
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.noise import LEAST_MASS
from isiw.models.particles.prior import Prior
from isiw.models.shared.history import History
from isiw.models.shared.normal import between, log_between
from isiw.models.shared.start import Span, StartPrior
from isiw.native.engine import elementary

FURTHEST = 200.0
"""No MEP is further from what a particle expects [SD]: 1 µV to 30 mV are ten units of the log, .05 is a small SD."""

ends = st.floats(-FURTHEST, FURTHEST)
widths = st.floats(1e-3, 2 * FURTHEST)


def exact(low: float, high: float) -> float:
    """Log of the probability between two ends."""
    with mpmath.workdps(40):
        if low > 0:
            low, high = -high, -low
        mass = mpmath.ncdf(high) - mpmath.ncdf(low)
        return float(mpmath.log(mass))


@given(low=ends, width=widths)
def test_the_log_of_a_probability_between_two_ends_is_that_of_mpmath(low: float, width: float) -> None:
    with mpmath.workdps(40 + int(FURTHEST**2 / 4)):  # or the difference of two that are nearly 0 or 1 has no digits
        expected = exact(low, low + width)
    got = log_between(torch.tensor([low], dtype=torch.double), torch.tensor([low + width], dtype=torch.double)).item()
    assert got == pytest.approx(expected, rel=1e-11, abs=1e-9)


@pytest.mark.parametrize(("low", "high"), [(-math.inf, -10.0), (10.0, math.inf)])
def test_a_tail_is_not_nothing(low: float, high: float) -> None:
    for dtype in (torch.double, torch.float32):
        ends = torch.tensor([low], dtype=dtype), torch.tensor([high], dtype=dtype)
        assert between(*ends).item() == pytest.approx(7.619853024160527e-24, rel=1e-5)
    everything = between(torch.tensor([-math.inf]), torch.tensor([math.inf]))
    assert everything.item() == 1.0


def test_the_gradient_of_the_log_of_a_probability_is_finite_in_both_tails() -> None:
    low = torch.tensor([-150.0, -3.0, -1e-3, 0.2, 150.0], dtype=torch.double, requires_grad=True)
    (slope,) = torch.autograd.grad(log_between(low, low + 1.0).sum(), low)
    assert bool(slope.isfinite().all())


def test_the_engine_has_the_probability_between_two_ends_wherever_its_log_is_taken() -> None:
    rng = np.random.default_rng(1)
    ends = rng.uniform(-60.0, 60.0, 300) * rng.random(300) ** 2
    low, high = (x.astype(np.float32) for x in (ends, ends + 10.0 ** rng.uniform(-2.0, 2.0, 300)))
    found = elementary("between", low, high)
    expected = [max(exact(float(a), float(b)), math.log(LEAST_MASS)) for a, b in zip(low, high, strict=True)]
    np.testing.assert_allclose(np.log(np.maximum(found, LEAST_MASS)), expected, atol=1e-3)


def test_torch_in_single_precision_has_an_interval_above_all_that_a_particle_expects() -> None:
    target = WindowTarget(Prior(), DesignSpace(0, 300, reference="impact"))
    latents = target.prior.sample(1, 400, torch.Generator().manual_seed(1), target.space)
    isi_ms = torch.full((1, 3), math.nan)
    low = torch.tensor([[0.05, 0.5, 5.0]]).log()
    told = History(isi_ms, torch.zeros_like(isi_ms), low, torch.full_like(low, math.inf), torch.zeros_like(low))
    ours = Compiled(target).log_likelihood(latents, told)
    theirs = total_log_likelihood(target.person(latents), told)
    assert float((ours - theirs).abs().max()) < 2e-3


def test_where_no_start_can_be_none_is_usual() -> None:
    prior, space = StartPrior((Span(1.0, 0.0, 100.0),), p_anywhere=0.0), DesignSpace(0, 3000, 10, reference="impact")
    usual = prior.usual(torch.tensor([50.0, 2500.0]), space)
    assert usual.tolist() == [1.0, 0.0]
