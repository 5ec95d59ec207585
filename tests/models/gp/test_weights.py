"""Trials that stray from a window's process: how likely they make it, and how little they move it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch

from isiw.design import VALVE_SPACE
from isiw.models.gp.model import GaussianProcess
from isiw.models.gp.places import WindowsPrior
from isiw.models.gp.prior import ProcessSettings
from isiw.models.gp.weights import STRAY, Weights
from isiw.models.protocol import Observation
from known import known

SHARE = 0.1


def told(values: list[float], functions: int = 2) -> Weights:
    """Values of one process with a few random functions and a constant, of noise SD .5."""
    rng = np.random.default_rng(3)
    features = torch.as_tensor(np.column_stack((rng.normal(0, 0.7, (len(values), functions)), np.ones(len(values)))))
    return Weights(
        features[None], torch.tensor([values], dtype=torch.float64), torch.full((1, len(values)), 0.25).double(), 1.0
    )


def evidence_of(weights: Weights) -> float:
    """The exact log evidence: over all sets of strays."""
    terms = []
    for strays in itertools.product((False, True), repeat=weights.values.shape[-1]):
        wide = torch.tensor(strays)
        chance = torch.where(wide, SHARE, 1.0 - SHARE).double().log().sum()
        law = replace(weights, variance=weights.variance * torch.where(wide, STRAY**2, 1.0))
        terms.append(law.log_marginal[0] + chance)
    return float(torch.stack(terms).logsumexp(0))


@pytest.mark.parametrize("values", [[0.1, -0.3, 0.2, 0.4, 0.0], [0.1, -0.3, 3.0, 0.4, 0.0], [0.1, -2.5, 3.0, 0.4, 4.0]])
def test_the_bound_on_the_evidence_is_below_it_and_near(values: list[float]) -> None:
    weights = told(values)
    bound, exact = float(weights.with_strays(SHARE).log_marginal), evidence_of(weights)
    assert exact - 0.5 < bound <= exact
    without = float(weights.log_marginal)
    assert without < exact - 2.0 or abs(max(map(abs, values))) < 1.0  # what strays are for


def test_without_strays_the_law_is_gaussian() -> None:
    weights = told([0.1, -2.5, 3.0])
    assert weights.with_strays(0.0) is weights


def test_one_large_mep_hardly_makes_a_window() -> None:
    quiet = [(float(isi_ms), 0.011 + 0.002 * (n % 3)) for n, isi_ms in enumerate(np.linspace(200, 480, 12))]
    probability = {}
    for stray in (0.0, 0.1):
        model = GaussianProcess(ProcessSettings(profile="window", windows=WindowsPrior(stray=stray)))
        posterior = model.begin(VALVE_SPACE, 1)
        for isi_ms, mep_mv in [*quiet, (305.0, 0.25)]:
            posterior = model.update(posterior, Observation.of([isi_ms], [mep_mv]))
        probability[stray] = known(posterior.estimate().probability)
    assert probability[0.1] < 0.5 < probability[0.0]
