from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from typing import Never

import pytest

from isiw.session.interrupts import DeferredInterrupts

if os.name == "nt":
    pytest.skip("POSIX signals", allow_module_level=True)


@pytest.fixture(autouse=True)
def terminal() -> Iterator[None]:
    """A terminal whose closing is heard, also where the tests themselves run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def interrupt(number: signal.Signals = signal.SIGINT) -> None:
    signal.raise_signal(number)


def test_an_interrupt_waits_until_it_is_allowed() -> None:
    done = []

    def work() -> None:
        with DeferredInterrupts() as interrupts:
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
        with DeferredInterrupts() as interrupts, interrupts.allowed():
            interrupt(number)
            done.append("never")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == []


def test_an_interrupt_that_found_no_moment_comes_at_the_end() -> None:
    done = []

    def work() -> None:
        with DeferredInterrupts():
            interrupt()
            done.append("all")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["all"]


def test_a_second_interrupt_does_not_interrupt_the_cleanup() -> None:
    done = []

    def work() -> None:
        with DeferredInterrupts() as interrupts:
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
        with DeferredInterrupts():
            interrupt()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        work()


def test_the_handlers_are_put_back() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    with DeferredInterrupts():
        assert all(signal.getsignal(n) is not b for n, b in zip(numbers, before, strict=True))
    assert [signal.getsignal(number) for number in numbers] == before


def test_outside_the_main_thread_it_does_nothing() -> None:
    failures = []

    def work() -> None:
        try:
            with DeferredInterrupts() as interrupts, interrupts.allowed():
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
        with DeferredInterrupts() as interrupts, interrupts.allowed():
            interrupt(signal.SIGHUP)
            done.append("all")
    finally:
        signal.signal(signal.SIGHUP, before)
    assert done == ["all"]
