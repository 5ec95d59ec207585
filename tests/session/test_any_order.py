"""Whatever happens to a session, in whatever order, nothing is lost, given twice, or asked differently."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from benchmarks.faulty_device import Fired, check_ledger
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from isiw.devices.clock import VirtualClock
from isiw.devices.limits import Limits
from isiw.errors import DeviceError, NotDelivered
from isiw.log.record import read_session
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.session.resuming import resume
from isiw.session.rig import Safeguards
from isiw.session.sink import SessionUpdate
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from known import known
from scripted import SPACE, ScriptedDevice, scripted_strategy

Fire: TypeAlias = Callable[[Stimulus], Measurement]
Answers: TypeAlias = Callable[[Stimulus, Fire], Measurement]

TRIALS = 40
LIMITS = Limits.of_space(SPACE, max_pulses=TRIALS)


class KilledError(Exception):
    """The process ends here; what is on disk is all that is left."""


class SessionsInAnyOrder(RuleBasedStateMachine):
    """One session, run, disturbed, killed, resumed, and looked at."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.log, self.clock = self.folder / "s.mcap", VirtualClock()
        self.ledger: list[Fired] = []
        self.excluded: set[int] = set()
        self.read: list[bytes] = []
        self.trials = 0

    def teardown(self) -> None:
        shutil.rmtree(self.folder)

    def go_on(
        self, answer: Answers, *, pause_at: int | None = None, on_pause: Callable[[str], bool] | None = None
    ) -> None:
        """Run or resume with a device that answers so, until something ends it."""

        def fire(stimulus: Stimulus) -> Measurement:
            # What is fired has its intent on disk already.
            last = read_session(self.log).intents[-1]
            assert (last.trial, last.isi_ms) == (stimulus.trial, stimulus.isi_ms)
            self.ledger.append(Fired(stimulus.trial, stimulus.isi_ms, self.clock.now_s()))
            return Measurement(0.01 + known(stimulus.isi_ms) / 1e4, stimulus.isi_ms)

        def on_trial(update: SessionUpdate) -> None:
            if update.trial.index == pause_at:
                session.pause("a break")

        device = ScriptedDevice(lambda stimulus: answer(stimulus, fire))
        arguments: dict[str, Any] = {
            "clock": self.clock,
            "limits": LIMITS,
            "on_trial": on_trial,
            "safeguards": Safeguards(retries=1, on_pause=on_pause),
        }
        strategy = scripted_strategy(TRIALS)
        if self.log.exists() or self.log.with_name("s.mcap.part").exists():
            session = resume(self.log, device, strategy, **arguments)
        else:
            session = Session(device, strategy, log=self.log, **arguments)
        with suppress(DeviceError, KilledError):
            session.run()
        assert device.calls[-2:] == (["stop", "unstage"] if device.calls else [])
        assert device.calls or self.next_trial >= TRIALS  # what is over arms nothing

    @property
    def next_trial(self) -> int:
        files = [path.read_bytes() for path in (self.log, self.log.with_name("s.mcap.part")) if path.exists()]
        if files != self.read:  # it is asked for before each rule
            self.read, self.trials = files, len(read_session(self.log).table) if files else 0
        return self.trials

    @rule(trials=st.integers(1, 4))
    def deliver(self, trials: int) -> None:
        """Deliver some trials, then pause where nobody is there to go on."""
        self.go_on(lambda stimulus, fire: fire(stimulus), pause_at=self.next_trial + trials - 1)

    @rule(trials=st.integers(1, 3))
    def pause_and_go_on(self, trials: int) -> None:
        """Pause, go on where the operator says so, and fail later."""
        first = self.next_trial

        def answer(stimulus: Stimulus, fire: Fire) -> Measurement:
            if stimulus.trial == first + trials + 1:
                raise DeviceError("unplugged")
            return fire(stimulus)

        self.go_on(answer, pause_at=first + trials - 1, on_pause=lambda _: True)

    @rule(fired=st.booleans(), trials=st.integers(0, 3))
    def fault(self, *, fired: bool, trials: int) -> None:
        """Fail before or after firing; the outcome is unknown."""
        last = self.next_trial + trials

        def answer(stimulus: Stimulus, fire: Fire) -> Measurement:
            if stimulus.trial == last:
                if fired:
                    fire(stimulus)
                raise DeviceError("unplugged")
            return fire(stimulus)

        self.go_on(answer)

    @rule(refusals=st.integers(1, 3), trials=st.integers(0, 2))
    def refuse(self, refusals: int, trials: int) -> None:
        """Refuse before firing: once is tried again, twice ends the session."""
        at, left = self.next_trial + trials, [refusals]

        def answer(stimulus: Stimulus, fire: Fire) -> Measurement:
            if stimulus.trial == at and left[0]:
                left[0] -= 1
                raise NotDelivered("charging")
            if stimulus.trial == at + 1:
                raise DeviceError("unplugged")
            return fire(stimulus)

        self.go_on(answer)

    @rule(fired=st.booleans(), trials=st.integers(0, 3))
    def kill(self, *, fired: bool, trials: int) -> None:
        """End the process in the middle of a delivery: only what was synced is left."""
        last, part, kept = self.next_trial + trials, self.log.with_name("s.mcap.part"), self.folder / "kept"

        def answer(stimulus: Stimulus, fire: Fire) -> Measurement:
            if stimulus.trial == last:
                if fired:
                    fire(stimulus)
                shutil.copy(part, kept)
                raise KilledError
            return fire(stimulus)

        self.go_on(answer)
        if kept.exists():
            self.log.unlink()
            kept.rename(part)

    @precondition(lambda self: self.next_trial > 0)
    @rule(data=st.data())
    def exclude(self, data: st.DataObject) -> None:
        """Exclude a trial that counts."""
        told = [trial.index for trial in read_session(self.log).table.told]
        if told:
            trial = data.draw(st.sampled_from(told))
            exclude(self.log, trial, "sneezed")
            self.excluded.add(trial)

    @invariant()
    def nothing_is_lost_or_given_twice(self) -> None:
        if self.next_trial:
            record = read_session(self.log)
            assert record.losses == ()
            check_ledger(self.ledger, record, LIMITS)
            assert {trial.index for trial in record.table if trial.excluded} == self.excluded

    @invariant()
    def every_ask_is_the_same_again(self) -> None:
        if self.next_trial:
            resume(self.log, ScriptedDevice(), scripted_strategy(TRIALS))  # raises where it asks differently


TestSessionsInAnyOrder = pytest.mark.slow(SessionsInAnyOrder.TestCase)
TestSessionsInAnyOrder.settings = settings(
    max_examples=10, stateful_step_count=6, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
)
