"""Executors of a study's work: here, in local processes, or on a Dask cluster.

Each result comes when it is finished. What raises, or takes its process down again and again, is a `Failure` among
them.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
import signal
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any, Protocol, TypeVar

from loky import ProcessPoolExecutor, cpu_count
from threadpoolctl import threadpool_limits

from isiw.checks import Checked, Count
from isiw.errors import StudyError
from isiw.text.named_code import library

_THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables from which torch takes its number of threads as it is imported."""


@contextmanager
def one_thread() -> Generator[None, None, None]:
    """Have libraries compute with one thread, without which the same session may come to other numbers, until the end.

    Most strategies do without torch: it is not imported for this, and starts with one thread if a strategy imports it.
    """
    torch = sys.modules.get("torch")
    before = cpu_count() if torch is None else torch.get_num_threads()
    kept = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    if torch is not None:
        torch.set_num_threads(1)
    try:
        with threadpool_limits(1, user_api="blas"):
            yield
    finally:
        for name, value in kept.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
        if (torch := sys.modules.get("torch")) is not None:
            torch.set_num_threads(before)


# Parameters of mallopt(3), from malloc.h, and the value that both begin with.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_USUAL_BYTES = 128 * 1024


@contextmanager
def memory_kept() -> Generator[None, None, None]:
    """Have this process keep what it frees, and give it back at the end; does nothing without glibc."""
    _set_thresholds(1 << 30)
    try:
        yield
    finally:
        _set_thresholds(_USUAL_BYTES)
        with suppress(AttributeError, OSError, TypeError):
            ctypes.CDLL(None).malloc_trim(0)


def _set_thresholds(size_bytes: int) -> None:
    with suppress(AttributeError, OSError, TypeError):  # another C library has no such settings
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_MMAP_THRESHOLD, size_bytes)
        mallopt(_TRIM_THRESHOLD, size_bytes)


_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1")
"""The environment of a worker, which has a core of its own."""


@dataclass(frozen=True)
class Failure:
    """The failure of an item without a result.

    Args:
        error: what was raised, in a line.
        details: the traceback, if there is one.
    """

    error: str
    details: str = ""


class Executor(Protocol):
    """Where work is done."""

    def results(
        self, run: Callable[[_Item], _Result], items: Sequence[_Item]
    ) -> Generator[tuple[_Item, _Result | Failure], None, None]:
        """Each item with its result, or with its failure, in the order of finishing.

        Args:
            run: gives the result of an item; importable if it is to run in another process.
            items: the items.
        """


@dataclass(frozen=True)
class Processes(Checked):
    """This machine: one worker is this process itself; several are processes of loky's, of one torch thread each.

    A worker that dies takes the pool with it. What was running then is run again, each item alone so that the one to
    blame is known; the others go on in a new pool.

    Args:
        workers: how many.
        attempts: an item that has taken its worker down so often is given up.
    """

    workers: Count = 1
    attempts: Count = 3

    def results(
        self, run: Callable[[_Item], _Result], items: Sequence[_Item]
    ) -> Generator[tuple[_Item, _Result | Failure], None, None]:
        """See `Executor`."""
        if self.workers == 1:
            yield from ((item, _attempt(run, item)) for item in items)
            return
        left, deaths = dict(enumerate(items)), Counter[int]()
        while left:
            suspects = [number for number in left if deaths[number]]
            begun: list[int] = []
            try:
                with closing(self._pool(run, left, suspects[:1] or list(left), begun)) as results:
                    for number, result in results:
                        yield left.pop(number), result
            except BrokenProcessPool as error:
                if not begun:
                    raise StudyError("the worker processes cannot be started", got=str(error)) from error
                deaths.update(number for number in begun if number in left)
                for number in [number for number in left if deaths[number] >= self.attempts]:
                    yield left.pop(number), Failure(f"Its worker died {self.attempts} times: {error}")

    def _pool(
        self, run: Callable[[_Item], _Result], items: dict[int, _Item], numbers: Sequence[int], begun: list[int]
    ) -> Generator[tuple[int, _Result | Failure], None, None]:
        waiting, running = iter(numbers), dict[Future[_Result | Failure], int]()
        # The pool hears of a dead worker at the next submission or result: both happen in this thread.
        pool = ProcessPoolExecutor(self.workers, initializer=_serve, initargs=(os.getpid(),), env=_ONE_THREAD)
        try:
            while True:
                # No more are handed out than run at once, so that few are under suspicion when a worker dies.
                for number in islice(waiting, self.workers - len(running)):
                    running[pool.submit(_attempt, run, items[number])] = number
                    begun.append(number)
                if not running:
                    return
                finished = wait(running, return_when=FIRST_COMPLETED).done
                for future in sorted(finished, key=lambda future: future.exception() is not None):
                    yield running.pop(future), future.result()
        finally:
            pool.shutdown(kill_workers=True)


@dataclass(frozen=True)
class DaskCluster:
    """A Dask cluster: a scheduler's address, or a `distributed.Client`, whose workers have isiw installed.

    Dask itself hands out again what ran on a worker that died, as often as its setting `allowed-failures` says. What
    was there each time is run once more at the end, alone, since it may be another's fault.

    Args:
        scheduler: the address, such as `"tcp://10.0.0.1:8786"`, or the client.
        attempts: an item whose result was lost on the cluster so often is given up.
    """

    scheduler: Any
    attempts: int = 3

    def results(
        self, run: Callable[[_Item], _Result], items: Sequence[_Item]
    ) -> Generator[tuple[_Item, _Result | Failure], None, None]:
        """See `Executor`."""
        dask = library("distributed", "dask")
        with ExitStack() as stack:
            address = self.scheduler if isinstance(self.scheduler, str) else None
            client = self.scheduler if address is None else stack.enter_context(_client(dask, address))
            running, suspects = dask.as_completed(loop=client.loop), list[_Item]()
            held: dict[str, tuple[_Item, Any, int]] = {}  # items, their futures, and how often they were lost

            @stack.callback
            def cancel() -> None:
                if client.status == "running":
                    client.cancel([future for _, future, _ in held.values()])

            def hand_out(item: _Item, losses: int = 0) -> None:
                future = client.submit(_attempt_alone, run, item, pure=False)
                held[future.key] = (item, future, losses)
                running.add(future)

            for item in items:
                hand_out(item)
            for future in running:
                item, _, losses = held.pop(future.key)
                if future.status == "error" and isinstance(future.exception(), dask.KilledWorker):
                    suspects.append(item)
                elif (result := _result_of(future, client)) is not _LOST:
                    yield item, result
                elif losses + 1 < self.attempts:
                    hand_out(item, losses + 1)
                else:
                    yield item, Failure(f"Its result was lost on the cluster {self.attempts} times.")
            for item in suspects:
                hand_out(item)
                held.pop((future := next(running)).key)
                result = _result_of(future, client)
                lost = Failure("Its result was lost on the cluster.")
                yield item, lost if result is _LOST else result


_LOST = object()
"""A result that went down with the worker, or the cluster, that held it."""


def _client(dask: Any, address: str) -> Any:
    try:
        return dask.Client(address)
    except (OSError, ValueError) as error:
        raise StudyError(
            "the Dask scheduler cannot be reached", got=address, remedy="Check its address, and that it is running."
        ) from error


def _result_of(future: Any, client: Any) -> Any:
    """The result of a Dask future; what took its workers down is a failure."""
    try:
        error = future.exception()
        return future.result() if error is None else Failure(_line(error))
    except (asyncio.CancelledError, CancelledError):
        if client.status != "running":  # nothing more will come
            raise StudyError("the Dask scheduler was lost", remedy="Run again: what is finished is kept.") from None
        return _LOST


def _attempt(run: Callable[[_Item], _Result], item: _Item) -> _Result | Failure:
    try:
        with memory_kept():
            return run(item)
    except Exception as error:  # noqa: BLE001 - one that fails must not end the others; it is reported
        return Failure(_line(error), traceback.format_exc())


def _serve(parent: int) -> None:
    """End this worker with its parent, who alone fetches what it computes, and not before, at a terminal's Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


_ONE_AT_A_TIME = threading.Lock()


def _attempt_alone(run: Callable[[_Item], _Result], item: _Item) -> _Result | Failure:
    """One session at a time in each worker process, however many threads it has: torch and Pyro share global state."""
    with _ONE_AT_A_TIME:
        return _attempt(run, item)


def _line(error: BaseException) -> str:
    return " ".join(traceback.format_exception_only(error)[-1].split())
