"""The Pyro program, and that the fast density is nothing else."""

import math
from dataclasses import replace

import pyro
import pytest
import torch

from isiw.design import VALVE_SPACE
from isiw.models.parametric.law import Likelihood, Unknowns, WindowPrior, levels, log_likelihood
from isiw.models.parametric.sampling import WindowProgram
from isiw.models.parametric.tensors import Trials
from known import known

LIKELIHOODS: tuple[Likelihood, ...] = ("gamma", "log-normal", "input-noise")

MEPS_MV = [(0.08, 0.08), (0.02, 0.02), (0.01, 0.01), (0.03, 0.03), (0.0, 0.005), (0.02, math.inf)]
TRIALS = Trials(
    torch.tensor([250.0, 300.0, math.nan, 210.0, 260.0, 240.0], dtype=torch.double),
    torch.tensor([0.0, 0.0, 0.0, 4.0, 0.0, 0.0], dtype=torch.double),
    torch.tensor(MEPS_MV, dtype=torch.double).log(),
)
"""Amplitudes, TMS alone, an uncertain ISI, an amplitude below the detection limit, and a response that was seen."""


def program(likelihood: Likelihood, *, present: bool = True) -> WindowProgram:
    return WindowProgram(WindowPrior(), likelihood, VALVE_SPACE, present=present)


def latents(of: WindowProgram, n: int = 4) -> torch.Tensor:
    return torch.randn((n, of.latents), generator=torch.Generator().manual_seed(2), dtype=torch.double)


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
@pytest.mark.parametrize("present", [True, False])
def test_the_fast_density_is_what_the_trace_of_the_program_sums_to(likelihood: Likelihood, *, present: bool) -> None:
    model = program(likelihood, present=present)
    some = latents(model)
    fast = model.log_density(some, TRIALS)
    for one, expected in zip(some, fast, strict=True):
        conditioned = pyro.poutine.condition(model, data={"latents": one})
        trace = pyro.poutine.trace(conditioned).get_trace(TRIALS)
        torch.testing.assert_close(trace.log_prob_sum(), expected)


def test_an_uncertain_isi_is_integrated_out() -> None:
    # By brute force on 400 quantiles; three nodes are exact up to the fifth power of the SD.
    model = program("log-normal")
    some = latents(model, 300)
    trial = Trials(*(column[3:4] for column in TRIALS))
    got = model.log_likelihood(some, trial)
    shifts_ms = 4.0 * torch.special.ndtri((torch.arange(400, dtype=torch.double) + 0.5) / 400)
    unknowns = model.unknowns(some)
    ends = trial.log_mep.expand(400, -1)
    by_isi = log_likelihood(unknowns, levels(unknowns, 210.0 + shifts_ms), ends, "log-normal")
    expected = torch.logsumexp(by_isi, dim=-1) - math.log(400)
    assert (got - expected).abs().median() < 0.01
    assert (got - expected).abs().quantile(0.95) < 0.1


def test_without_a_window_the_isi_does_not_matter() -> None:
    model = replace(program("gamma"), present=False)
    elsewhere = TRIALS._replace(isi_ms=TRIALS.isi_ms + 100.0)
    some = latents(model)
    here, there = (model.log_density(some, trials) for trials in (TRIALS, elsewhere))
    assert torch.equal(here, there)


def test_the_program_draws_meps_of_its_own_where_those_told_are_set_aside() -> None:
    pyro.set_rng_seed(1)
    model = program("log-normal")
    latent = torch.zeros(model.latents, dtype=torch.double)
    nothing = torch.zeros(4000, dtype=torch.double)
    trials = Trials(nothing + 250.0, nothing, torch.stack((nothing, nothing), dim=-1))
    conditioned = pyro.poutine.condition(pyro.poutine.uncondition(model), data={"latents": latent})
    trace = pyro.poutine.trace(conditioned).get_trace(trials)
    drawn = known(trace.nodes["log_mep"]["value"])
    assert drawn.shape == (4000, 2)
    assert torch.equal(drawn[:, 0], drawn[:, 1])
    unknowns = model.unknowns(latent)
    at_peak_mv = unknowns.baseline_mv + unknowns.amplitude_mv * levels(unknowns, torch.tensor([250.0]))
    assert drawn[:, 0].exp().median().item() == pytest.approx(at_peak_mv.item(), rel=0.2)


def test_the_program_names_what_it_infers() -> None:
    trace = pyro.poutine.trace(program("input-noise")).get_trace(TRIALS)
    names = {"latents", "start_ms", "width_ms", "baseline_mv", "amplitude_mv", "log_mep"}
    assert names <= set(trace.nodes)
    assert isinstance(trace.nodes["_RETURN"]["value"], Unknowns)
