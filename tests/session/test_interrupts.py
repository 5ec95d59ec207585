from __future__ import annotations

import os
import signal
import threading
import time
from typing import Never

import pytest

from isiw.session.pausing import Interrupts

if os.name == "nt":
    pytest.skip("POSIX signals", allow_module_level=True)
pytestmark = pytest.mark.usefixtures("terminal")


def nothing() -> None:
    pass


def interrupt(number: signal.Signals = signal.SIGINT) -> None:
    signal.raise_signal(number)


def test_an_interrupt_waits_until_it_is_allowed() -> None:
    done = []

    def work() -> None:
        with Interrupts(nothing, nothing) as interrupts:
            interrupt()
            done.append("record")
            with interrupts.allowed():
                done.append("never")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["record"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_where_allowed_it_comes_at_once(number: signal.Signals) -> None:
    done = []

    def work() -> None:
        with Interrupts(nothing, nothing) as interrupts, interrupts.allowed():
            interrupt(number)
            done.append("never")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == []


def test_an_interrupt_that_found_no_moment_comes_at_the_end() -> None:
    done = []

    def work() -> None:
        with Interrupts(nothing, nothing):
            interrupt()
            done.append("all")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["all"]


def test_a_second_interrupt_does_not_interrupt_the_cleanup() -> None:
    done = []

    def work() -> None:
        with Interrupts(nothing, nothing) as interrupts:
            try:
                with interrupts.allowed():
                    interrupt()
            finally:
                interrupt()
                done.append("stopped")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["stopped"]


def test_an_error_is_not_hidden_by_a_waiting_interrupt() -> None:
    def work() -> Never:
        with Interrupts(nothing, nothing):
            interrupt()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        work()


def test_the_handlers_are_put_back() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    with Interrupts(nothing, nothing):
        assert all(signal.getsignal(n) is not b for n, b in zip(numbers, before, strict=True))
    assert [signal.getsignal(number) for number in numbers] == before


def test_outside_the_main_thread_it_does_nothing() -> None:
    failures = []

    def work() -> None:
        try:
            with Interrupts(nothing, nothing) as interrupts, interrupts.allowed():
                pass
        except ValueError as error:
            failures.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert failures == []


def test_what_the_process_ignores_it_goes_on_ignoring() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    done = []
    try:
        with Interrupts(nothing, nothing) as interrupts, interrupts.allowed():
            interrupt(signal.SIGHUP)
            done.append("all")
    finally:
        signal.signal(signal.SIGHUP, before)
    assert done == ["all"]


def test_what_is_acknowledged_has_disarmed_already() -> None:
    done = []

    def slow() -> None:
        time.sleep(0.3)  # the disarming itself is what takes long
        done.append("disarmed")

    with Interrupts(slow, nothing) as interrupts:
        interrupt()
        interrupts.acknowledge()
        assert done == ["disarmed"]
        interrupts.settle()
        done.append("armed again")
    assert done == ["disarmed", "armed again"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_comes_after_it_was_acknowledged_is_not_forgotten_with_it(number: signal.Signals) -> None:
    def work() -> None:
        with Interrupts(nothing, nothing) as interrupts:
            interrupt()
            interrupts.acknowledge()
            interrupt(number)
            interrupts.settle()
            heard.append((interrupts.heard, interrupts.ending))

    heard: list[tuple[bool, bool]] = []
    with pytest.raises(KeyboardInterrupt):
        work()
    assert heard == [(True, number == signal.SIGTERM)]


@pytest.mark.slow
def test_signals_that_come_at_once_do_not_pass_for_a_session_that_does_not_react(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def twice() -> None:
        time.sleep(0.2)  # until the main thread waits
        for _ in range(2):
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)

    monkeypatch.setattr("isiw.session.pausing._REACTION_S", 0.5)
    disarmed, stuck = list[str](), list[str]()

    def disarm() -> None:
        time.sleep(0.1 * len(disarmed))
        disarmed.append("now")

    with Interrupts(disarm, lambda: stuck.append("now")) as interrupts:
        sender = threading.Thread(target=twice)
        sender.start()
        sender.join()  # no handler runs meanwhile
        assert not interrupts.insisted, "the handler ran more than once: they did not come at once"
        interrupts.acknowledge()
        time.sleep(1.0)
        assert disarmed == ["now", "now"]
        interrupts.settle()
        interrupt()
        interrupts.acknowledge()
        assert disarmed == ["now"] * 3, "it was acknowledged before the device was disarmed"
    assert stuck == []


def test_every_signal_disarms_also_where_it_is_not_allowed_to_interrupt() -> None:
    disarmed = threading.Event()

    def work() -> None:
        with Interrupts(disarmed.set, nothing):
            interrupt()
            assert disarmed.wait(60)

    with pytest.raises(KeyboardInterrupt):
        work()
