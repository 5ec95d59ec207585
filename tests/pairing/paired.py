"""An intervention whose window is known by construction, so that a test of it takes no time to learn one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.estimate import WindowEstimate
from isiw.intervention import Arm, Intervention, Plan, sealed
from isiw.models.protocol import Observation
from isiw.session.loop import Session
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Measurement
from isiw.trials import Status, Stimulus, Trial
from isiw.types import Array
from isiw.window import Window
from scripted import ScriptedDevice, WantedIsi

SPACE = DesignSpace(0, 200, reference="valve")
LIMITS = Limits(0, 200, min_iti_s=5.0, max_pulses=400)
BASE_MV, BEST_MS = 0.2, 100.0

EVERY_ARM = tuple(Arm)


@dataclass(frozen=True)
class KnownWindow:
    """A window from 70 to 130 ms, of which two profiles are equally probable."""

    space: DesignSpace
    trials: int = 0

    def estimate(self, person: int = 0) -> WindowEstimate:
        del person
        return WindowEstimate(probability=0.95, window=Window(70.0, 130.0), start_ms=70.0, end_ms=130.0)

    def profiles_mv(self, isi_ms: Array) -> Array:
        off = (np.asarray(isi_ms) - BEST_MS) / np.array([[18.0], [22.0]])
        profiles: Array = (BASE_MV + 1.0 * np.exp(-0.5 * off**2))[None]
        return profiles

    def baselines_mv(self) -> Array:
        return np.full((1, 2), BASE_MV)

    def window_masks(self, isi_ms: Array) -> Array:
        inside = (np.asarray(isi_ms) >= 70.0) & (np.asarray(isi_ms) <= 130.0)
        return np.broadcast_to(inside.astype(float), (1, 2, len(inside)))


@dataclass(frozen=True)
class KnownModel:
    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> KnownWindow:
        del seed, people
        return KnownWindow(space)

    def update(self, posterior: KnownWindow, observation: Observation) -> KnownWindow:
        del observation
        return posterior


def knowing(earlier: int = 0) -> Strategy:
    """A strategy that knows the window, and from so many trials how much MEPs vary."""
    strategy = Strategy(SPACE, KnownModel(), WantedIsi(), Budget(10), seed=4)
    trials = [Trial(k, Status.ACCEPTED, None, isi_ms=BEST_MS, mep_mv=BASE_MV + 1.0) for k in range(earlier)]
    strategy.learn_all(trials)
    return strategy


def planned(**changes: Any) -> Plan:
    """A short plan."""
    usual: dict[str, Any] = {"pairs": 50, "before": 3, "after": 3, "after_min": (0.0, 2.0), "block_pairs": 20}
    return Plan(**{"protocol_code": "2026-17"} | usual | changes)


def intervention(arm: Arm = Arm.WINDOW, arms: tuple[Arm, ...] = EVERY_ARM, **changes: Any) -> Intervention:
    """An intervention with a known arm."""
    return Intervention(planned(arms=arms, **changes), sealed(arm))


def answering(best_ms: Callable[[int], float] = lambda _: BEST_MS) -> Callable[[Stimulus], Measurement]:
    """Answers whose best ISI is a function of the trial; TMS alone evokes the same in each arm."""

    def answer(stimulus: Stimulus) -> Measurement:
        varied = math.exp(0.4 * math.sin(2.3 * stimulus.trial))  # as MEPs do, without which a session pauses
        if stimulus.isi_ms is None:
            return Measurement((0.01 if stimulus.tap_alone else BASE_MV) * varied, None)
        off = (stimulus.isi_ms - best_ms(stimulus.trial)) / 20.0
        return Measurement((BASE_MV + float(np.exp(-0.5 * off**2))) * varied, stimulus.isi_ms)

    return answer


def device(best_ms: Callable[[int], float] = lambda _: BEST_MS, *, simulated: bool = True) -> ScriptedDevice:
    """A device that delivers taps alone, too."""
    made = ScriptedDevice(answering(best_ms), simulated=simulated)
    made.info = DeviceInfo("scripted", "valve", simulated=simulated, tap_alone=True)
    return made


def session(log: Path, given: Intervention | None = None, on: ScriptedDevice | None = None, **options: Any) -> Session:
    """A session of an intervention."""
    strategy = options.pop("strategy", None) or knowing()
    options = dict[str, Any]({"limits": LIMITS, "subject": "P07"}) | options
    return Session(on or device(), strategy, log=log, intervention=given or intervention(), **options)
