"""Logarithms of normal probabilities against mpmath, over all that priors reach."""

from __future__ import annotations

import math

import mpmath
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from isiw.models.parametric.normal import log_between

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
        assert log_between(*ends).exp().item() == pytest.approx(7.619853024160527e-24, rel=1e-5)
    everything = log_between(torch.tensor([-math.inf]), torch.tensor([math.inf])).exp()
    assert everything.item() == 1.0


def test_the_gradient_of_the_log_of_a_probability_is_finite_in_both_tails() -> None:
    low = torch.tensor([-150.0, -3.0, -1e-3, 0.2, 150.0], dtype=torch.double, requires_grad=True)
    (slope,) = torch.autograd.grad(log_between(low, low + 1.0).sum(), low)
    assert bool(slope.isfinite().all())
