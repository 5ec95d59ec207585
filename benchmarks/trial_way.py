"""Which modules does a trial pass on its way? One trial of a session is profiled, and its modules are listed in order.

    python -m benchmarks.trial_way

Counted are the modules of isiw in which a function runs from the moment at which the device has answered with a sweep
until the strategy has learnt the trial, besides those of `models` and `acquisition`, which is the science. With
`--whole` it is from the end of one trial to the end of the next, with estimate, decision, and the ask. The trial is an
ordinary one of the default; earlier ones have loaded what is loaded when it is used first.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import isiw
from benchmarks.quick import understood
from isiw.models.protocol import Observation
from isiw.strategy.course import Course

PROFILED = 10
"""The number of the trial; by then the initial ISIs of the default are over."""

SCIENCE = ("isiw.models", "isiw.acquisition")


class Way:
    """The modules in which functions run while it is open, in any thread, in the order of their first one."""

    def __init__(self, *, whole: bool) -> None:
        self.modules: list[str] = []
        self.whole, self.is_open = whole, False

    @contextmanager
    def looked_at(self) -> Iterator[None]:
        """Within, functions are seen, in this thread and those that begin."""
        threading.setprofile(self._seen)
        sys.setprofile(self._seen)
        try:
            yield
        finally:
            sys.setprofile(None)
            threading.setprofile(None)

    def _seen(self, frame: FrameType, event: str, _: object) -> None:
        name = frame.f_globals.get("__name__", "")
        if self.is_open and event == "call" and name.startswith("isiw.") and name not in self.modules:
            self.modules.append(name)


class Watched:
    """A rig that records EMG and knows the time of the hit; a way may begin when one of its deliveries is over."""

    def __init__(self, way: Way) -> None:
        self._way, self._noise = way, np.random.default_rng(1)

    def describe(self) -> isiw.DeviceInfo:
        """What it is."""
        return isiw.DeviceInfo("a rig with EMG", "impact", simulated=True)

    def stage(self) -> None:
        """Get ready."""

    def deliver(self, stimulus: isiw.Stimulus, timeout_s: float) -> isiw.Sweep:
        """EMG with a response of 25 ms latency; what happens in the rig is none of the way."""
        del timeout_s
        was, self._way.is_open = self._way.is_open, False
        times_ms = np.arange(-100.0, 100.0, 0.25)
        response = np.exp(-(((times_ms - 25.0) / 3.0) ** 2)) * np.sin(times_ms - 25.0)
        emg_mv = self._noise.normal(0.0, 0.003, times_ms.size) + (0.3 + 0.1 * (stimulus.trial % 3)) * response
        emg = isiw.Channel(emg_mv, 4000.0, "mV", -100.0)
        sweep = isiw.Sweep({"emg": emg}, t_tms_ms=0.0, t_hit_ms=-(stimulus.isi_ms or 0.0))
        self._way.is_open = was or (not self._way.whole and stimulus.trial == PROFILED)
        return sweep

    def stop(self) -> None:
        """Disarm."""

    def unstage(self) -> None:
        """Let go."""


def way_of_a_trial(*, whole: bool) -> list[str]:
    """The modules that a trial passes, in order.

    Args:
        whole: whether from one trial's end to the next one's, and not only from the device to the posterior.
    """
    way, update = Way(whole=whole), Course.after

    def updated(course: Course, observation: Observation) -> Course:
        after = update(course, observation)
        if course.told == PROFILED and not whole:
            way.is_open = False
        return after

    def on_trial(seen: isiw.session.SessionUpdate) -> None:
        if seen.trial.index in {PROFILED - 1, PROFILED}:
            way.is_open = whole and seen.trial.index < PROFILED

    Course.after = updated  # type: ignore[assignment, method-assign]
    try:
        with tempfile.TemporaryDirectory() as folder, way.looked_at():
            isiw.Session(
                Watched(way),
                isiw.make_strategy(space=isiw.IMPACT_SPACE, seed=1),
                log=Path(folder, "way.mcap"),
                limits=isiw.Limits.of_space(isiw.IMPACT_SPACE, max_pulses=PROFILED + 2),
                on_trial=on_trial,
            ).run()
    finally:
        Course.after = update  # type: ignore[method-assign]
    return way.modules


def main() -> None:
    """Print the modules in order, and how many there are."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--whole", action="store_true")
    modules = way_of_a_trial(whole=parser.parse_args().whole)
    shell = [name for name in modules if not name.startswith(SCIENCE)]
    print("\n".join(shell))
    print(f"{len(shell)} modules, and {len(modules) - len(shell)} of models and acquisition")


if __name__ == "__main__":
    understood("trial_way", prints=True)
    main()
