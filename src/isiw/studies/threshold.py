"""Searches for the motor threshold of simulated people, logged as those of real ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from isiw.decision import StopDecision
from isiw.devices.info import DeviceInfo
from isiw.errors import ConfigError
from isiw.log.headers import ThresholdHeader
from isiw.session.threshold import ThresholdRecorder, open_threshold
from isiw.session.threshold_loops import at_place
from isiw.strategy.threshold.search import ThresholdSearch
from isiw.subjects.thresholds import StimulatedPerson, threshold_cohort

_SIMULATED = "isiw_threshold"
"""The name under which a log keeps who is simulated."""


def open_simulated(
    search: ThresholdSearch, log: str | Path, *, cohort: str, seed: int, **options: Any
) -> ThresholdRecorder:
    """Open a search for the threshold of a simulated person of a cohort, who is kept in the log."""
    threshold_cohort(cohort, 1, seed)
    config = {_SIMULATED: {"cohort": cohort, "seed": seed}}
    return open_threshold(
        search, log, device=DeviceInfo("a simulated person", "impact", simulated=True), config=config, **options
    )


def simulated_person(header: ThresholdHeader) -> StimulatedPerson | None:
    """The simulated person of a log; None if nobody, or somebody else's person, was simulated."""
    drawn = header.config.get(_SIMULATED) if header.device.simulated else None
    if drawn is None:
        return None
    if not isinstance(drawn, Mapping) or not {"cohort", "seed"} <= set(drawn):
        raise ConfigError("the log does not say who is simulated", got=drawn, expected="a cohort and a seed")
    return threshold_cohort(drawn["cohort"], 1, drawn["seed"])[0]


def run_simulated(recorder: ThresholdRecorder, say: Callable[[str], None]) -> StopDecision:
    """Stimulate the simulated person of a log until the search is over."""
    person = simulated_person(recorder.header)
    if person is None:
        raise ConfigError("the log is of no simulated person", got=recorder.header.device.name)
    responder = person.begin(recorder.header.config[_SIMULATED]["seed"])
    for outcome in recorder.outcomes:  # so that the person's noise goes on where it was
        if outcome.intensity_pct_mso is not None:
            responder.respond(outcome.intensity_pct_mso, *(outcome.place_mm or ()))
    while not (decision := recorder.decision()).stop:
        intensity = recorder.ask()
        mep_mv = responder.respond(intensity, *(recorder.place_mm or ()))
        recorder.tell(mep_mv)
        given = f"Pulse {recorder.given}: {intensity:g} % MSO{at_place(recorder)}"
        say(f"{given}, MEP {mep_mv:.3f} mV. {recorder.estimate()}")
    return decision
