"""What torch computes on a GPU is what it computes on a processor. Without a GPU these tests are skipped."""

from __future__ import annotations

from dataclasses import replace
from itertools import starmap
from operator import methodcaller
from typing import Any

import pytest
import torch

from isiw.design import VALVE_SPACE
from isiw.models.particles import ParticleModel
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.protocol import Observation
from isiw.strategy.catalogue import make_strategy
from models.particles.test_engine import TARGETS, generator, history, in_double

DEVICE = "cuda"

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("known_log_sd", [None, 0.0, 0.8])
def test_the_likelihood_is_that_of_the_processor(name: str, known_log_sd: float | None) -> None:
    target, draws = TARGETS[name], generator(1)
    latents = target.prior.sample(4, 200, draws, target.space)
    person = target.person(latents)
    told = history(person, 30, draws)
    if known_log_sd is not None:
        around = told.around.clone()
        around[..., 0] = 0.05 * torch.rand(told.isi_ms.shape, generator=draws)
        around[..., 1], around[..., 2] = 0.2 * around[..., 0], known_log_sd
        told = replace(told, circumstances=around)
    there = in_double(target.person(latents.each(methodcaller("to", DEVICE))))
    got, expected = (
        total_log_likelihood(one, told.to(device, torch.double))
        for one, device in ((there, DEVICE), (in_double(person), "cpu"))
    )
    torch.testing.assert_close(got.cpu(), expected, atol=1e-3, rtol=1e-5)


@pytest.mark.parametrize("strategy", ["default", "even", "random"])
def test_a_session_on_a_gpu_finds_what_one_on_the_processor_finds(strategy: str) -> None:
    windows = [session_on(device, strategy).estimate().window for device in ("cpu", DEVICE)]
    expected, window = windows
    assert expected is not None
    assert window is not None
    assert window.start_ms == pytest.approx(expected.start_ms, abs=25.0)
    assert window.end_ms == pytest.approx(expected.end_ms, abs=25.0)


def session_on(device: str, strategy: str) -> Any:
    """A window of 200 to 260 ms and hardly any noise; one MEP below the detection limit, a tap alone, a change."""
    one: Any = make_strategy(strategy, VALVE_SPACE, 3, device=device, detection_limit_mv=0.005)
    for trial in range(30):
        isi_ms = one.ask()
        mep_mv = (0.2 if 200.0 < isi_ms < 260.0 else 0.012) * 1.001**trial
        one.tell(isi_ms, 0.0 if trial == 7 else mep_mv)
        if trial == 3:
            one.learn_tap(100.0, 0.006)
        if trial == 20:
            one.note_change()
    return one


def test_people_side_by_side_on_a_gpu_learn_what_a_processor_would() -> None:
    trials = list(starmap(Observation.of, [([100.0, 230.0], [0.01, 0.2]), ([230.0, 400.0], [0.2, 0.01])] * 4))
    probabilities = []
    for device in ("cpu", DEVICE):
        model = ParticleModel(engine="torch", device=device)
        posterior = model.begin(VALVE_SPACE, 1, people=2)
        for observation in trials:
            posterior = model.update(posterior, observation)
        probabilities.append([posterior.estimate(person).probability for person in range(2)])
    assert probabilities[0] == pytest.approx(probabilities[1], abs=0.06)
