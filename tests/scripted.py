"""A strategy without a real model that remembers all it was told, and devices that misbehave on command."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.estimate import WindowEstimate
from isiw.models.protocol import Observation
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from isiw.types import Array
from isiw.window import Window
from known import instance

SPACE = DesignSpace(0, 200, reference="valve")

ALONE_MS = -1.0
"""What TMS alone is remembered as."""


@dataclass(frozen=True)
class RememberingPosterior:
    """Remembers every trial; its next ISI depends on all of them."""

    space: DesignSpace
    seed: int
    told: tuple[tuple[float, float], ...] = ()
    changes: tuple[int, ...] = ()

    def noting_change(self) -> RememberingPosterior:
        return replace(self, changes=(*self.changes, len(self.told)))

    @property
    def trials(self) -> int:
        return len(self.told)

    def estimate(self, person: int = 0) -> WindowEstimate:
        del person
        middle = 60.0 + len(self.told)
        grid = self.space.grid_ms
        profile = 0.05 * np.exp(-(((grid - middle) / 20) ** 2))
        return WindowEstimate(
            probability=0.9 if self.told else 0.5,
            window=Window(middle - 30, middle + 30),
            start_ms=middle - 30,
            end_ms=math.inf,
            grid_ms=grid,
            edge_samples_ms=np.array([[middle - 35, math.inf], [middle - 30, 150.0], [middle - 25, math.inf]]),
            profile_quantiles_mv=np.stack([0.5 * profile, profile, 2 * profile]) + 0.01,
        )

    @property
    def wanted_ms(self) -> float:
        scrambled = math.fsum((k + 1) * (isi + 1e3 * mep) for k, (isi, mep) in enumerate(self.told)) + sum(self.changes)
        return self.space.low_ms + (37.0 * self.seed + 53.0 + 7.0 * scrambled) % (
            self.space.high_ms - self.space.low_ms
        )


@dataclass(frozen=True)
class RememberingModel:
    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> RememberingPosterior:
        assert people == 1
        return RememberingPosterior(space, seed)

    def update(self, posterior: RememberingPosterior, observation: Observation) -> RememberingPosterior:
        alone = math.isnan(observation.isi_ms[0])
        trial = (ALONE_MS if alone else float(observation.isi_ms[0]), float(observation.mep_mv[0]))
        return replace(posterior, told=(*posterior.told, trial))


@dataclass(frozen=True)
class WantedIsi:
    needs: tuple[type, ...] = ()

    def __call__(self, posterior: RememberingPosterior, isi_ms: Array) -> Array:
        scores: Array = -np.abs(isi_ms - posterior.wanted_ms)[None]
        return scores


class ScriptedDevice:
    """Answers by a formula, or as a function of the stimulus says; counts what happens to it."""

    def __init__(self, answer: Callable[[Stimulus], object] | None = None, *, simulated: bool = True) -> None:
        self.answer = answer or (lambda stimulus: Measurement(0.01 + (stimulus.isi_ms or 0) / 1e4, stimulus.isi_ms))
        self.info = DeviceInfo("scripted", "valve", simulated=simulated)
        self.delivered: list[Stimulus] = []
        self.calls: list[str] = []

    def describe(self) -> DeviceInfo:
        return self.info

    def stage(self) -> None:
        self.calls.append("stage")

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Any:
        assert timeout_s > 0
        self.delivered.append(stimulus)
        return self.answer(stimulus)

    def stop(self) -> None:
        self.calls.append("stop")

    def unstage(self) -> None:
        self.calls.append("unstage")


class FakeRealClock:
    """What a session takes for a real clock, without the waiting."""

    def __init__(self) -> None:
        self.time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, duration_s: float) -> None:
        self.time_s += max(0.0, duration_s)


def told_to(strategy: Strategy) -> tuple[tuple[float, float], ...]:
    return instance(RememberingPosterior, strategy.posterior).told


def scripted_strategy(max_trials: int = 6, seed: int = 0, space: DesignSpace = SPACE) -> Strategy:
    return Strategy(space, RememberingModel(), WantedIsi(), Budget(max_trials), seed=seed)
