"""Which modules does a trial pass on its way? One trial of a session is profiled, and its modules are listed in order.

    python -m benchmarks.trial_way

Counted are the modules of isiw in which a function runs from the moment at which the device has answered with a sweep
until the strategy has learnt the trial, besides those of `models` and `acquisition`, which is the science. With
`--whole` it is from the end of one trial to the end of the next, with estimate, decision, and the ask. The trial is an
ordinary one of the default; earlier ones have loaded what is loaded when it is used first.

Then come the rooms that the session hands the trial to, in order, and how often the way returns to each: it enters a
room again after another one. The session itself, which goes from room to room, is none of them, nor are rooms of values
(`VALUES`), of which all others are made.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
from collections import Counter
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

VALUES = {"change", "decision", "design", "estimate", "excess", "figures", "findings", "summary", "sweeps", "trials"}
VALUES |= {"checks", "errors", "files", "lazy", "text", "types", "visit", "window"}
"""Rooms that hold values, or what all rooms use."""


class Way:
    """The modules in which functions run while it is open, in any thread, in the order of their first one."""

    def __init__(self, *, whole: bool) -> None:
        self.modules: list[str] = []
        self.rooms: list[str] = [] if whole else ["devices"]
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
        name = _module(frame)
        if not (self.is_open and event == "call" and name.startswith("isiw.")):
            return
        if name not in self.modules:
            self.modules.append(name)
        room = name.split(".")[1]
        if room not in VALUES | {"session"} and _handed_over(frame) and self.rooms[-1:] != [room]:
            self.rooms.append(room)

    @property
    def returns(self) -> dict[str, int]:
        """How often the way returns to each room."""
        return {room: times - 1 for room, times in Counter(self.rooms).items()}


def _module(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", ""))


def _handed_over(frame: FrameType) -> bool:
    """Whether the session made a call, or the thread that works for it: no other room is between."""
    caller = frame.f_back
    while caller is not None and not _module(caller).startswith("isiw."):
        caller = caller.f_back
    return caller is None or _module(caller).startswith("isiw.session.")


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


def way_of_a_trial(*, whole: bool) -> Way:
    """The way of a trial.

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
    return way


def main() -> None:
    """Print the modules and the rooms in order, how many modules there are, and how often the way returns."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--whole", action="store_true")
    way = way_of_a_trial(whole=parser.parse_args().whole)
    modules = way.modules
    shell = [name for name in modules if not name.startswith(SCIENCE)]
    print("\n".join(shell))
    print(f"{len(shell)} modules, and {len(modules) - len(shell)} of models and acquisition")
    returns = ", ".join(f"{times} to {room}" for room, times in way.returns.items())
    print(f"Rooms: {' → '.join(way.rooms)}\nReturns: {returns}")


if __name__ == "__main__":
    understood("trial_way", prints=True)
    main()
