"""Sessions that were run earlier, logged as a lab has them: what `isiw.priors` learns from."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import isiw
from isiw.subjects import SimulatedSubject


def logged_session(subject: SimulatedSubject, name: str, seed: int, trials: int, folder: Path) -> Path:
    """Run a session of so many trials with the default, from the valve command, and return its log.

    Args:
        subject: the person.
        name: the person's identifier.
        seed: of the trials and the strategy.
        trials: how many.
        folder: where the log is written.
    """
    respond = partial(subject.begin(seed).respond, reference="valve")
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(respond, "valve"))
    never = {"stop_width_ms": 1e-3, "stop_no_window": 1.0, "stop_expected_f1": 1.0, "stop_gain": 0.0}
    strategy = isiw.make_strategy(seed=seed, max_trials=trials, **never)
    return isiw.Session(device, strategy, log=folder / f"{name}.mcap", subject=name).run().log
