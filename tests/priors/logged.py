"""Logs of simulated people, written without a strategy: ISIs in a fixed order over the range."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.log.headers import Header, StrategyRecipe
from isiw.log.writer import LogWriter
from isiw.signals.limits import SignalLimits
from isiw.subjects.cohorts import cohort
from isiw.subjects.responses import GainResponse, PeakProfile
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import Status, Trial
from isiw.types import Conditioning
from isiw.visit import Visit
from known import instance

EARLY_MS = 20.0


def gaussian_person(number: int = 0) -> SimulatedSubject:
    """A person whose MEPs tell much."""
    return cohort("gaussian", number + 1, 1)[number]


def person(start_ms: float = EARLY_MS, gain: float = 3.0) -> SimulatedSubject:
    """A person whose MEPs tell much, with the window elsewhere."""
    usual = gaussian_person()
    response = instance(GainResponse, usual.response)
    profile = replace(instance(PeakProfile, usual.profile), start_ms=start_ms, width_ms=110.0)
    return replace(usual, profile=profile, response=replace(response, gain_mv=gain * response.gain_mv))


def write_log(
    path: Path,
    person: SimulatedSubject | None = None,
    *,
    subject: str = "P1",
    trials: int = 25,
    space: DesignSpace = VALVE_SPACE,
    seed: int = 1,
    simulated: bool = False,
    created: str = "2026-11-21T10:00:00+00:00",
    hit_delay_ms: tuple[float, float] | None = None,
    conditioning: Conditioning = "tap",
    visit: Visit | None = None,
) -> Path:
    """The log of a session with ISIs all over the range."""
    header = Header(
        isiw_version="0.1.0",
        created=created,
        subject=subject,
        seed=seed,
        strategy=StrategyRecipe(name="", seed=seed),
        space=space,
        limits=Limits.of_space(space),
        device=DeviceInfo(
            "bench", space.reference, simulated=simulated, hit_delay_ms=hit_delay_ms, conditioning=conditioning
        ),
        signals=SignalLimits(),
        visit=visit or Visit(),
    )
    responder = (person or gaussian_person()).begin(seed)
    order = np.random.default_rng(seed).permutation(trials)
    with LogWriter.create(path, header) as log:
        for trial, place in enumerate(order.tolist()):
            isi_ms = space.snap(space.low_ms + (place + 0.5) * (space.high_ms - space.low_ms) / trials)
            mep_mv = responder.respond(isi_ms, space.reference).mep_mv
            log.append(Trial(trial, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv))
    return path
