"""Where the work of a study is done: here, in local processes, or on a Dask cluster, behind one interface.

An executor maps a function over items and gives each result as it is finished. What raises, and what takes its process
down with it again and again, comes back as a `Failure` among the results: nothing ends the others.
"""

from __future__ import annotations

import importlib
import threading
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from joblib import Parallel, delayed, parallel_config

from isiw.errors import InvalidValueError, StudyError

__all__ = ["DaskCluster", "Executor", "Failure", "Processes"]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class Failure:
    """What became of an item without a result.

    Args:
        error: what was raised, in a line.
        details: the traceback, where there is one.
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
            run: gives the result of an item; importable where it is to run in another process.
            items: the items.
        """


@dataclass(frozen=True)
class Processes:
    """This machine: one worker is this process itself; several are processes of joblib's, of one torch thread each.

    A worker that dies takes the pool with it. What was running then is run again, each item alone so that the one to
    blame is known; the others go on in a new pool.

    Args:
        workers: how many.
        attempts: an item that has taken its worker down so often is given up.

    Raises:
        InvalidValueError: fewer than one worker or attempt.
    """

    workers: int = 1
    attempts: int = 3

    def __post_init__(self) -> None:
        if self.workers < 1 or self.attempts < 1:
            raise InvalidValueError("there is at least one worker and one attempt", got=(self.workers, self.attempts))

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
        def work() -> Iterator[Any]:
            for number in numbers:
                begun.append(number)
                yield delayed(_numbered)(run, number, items[number])

        with parallel_config(backend="loky", inner_max_num_threads=1):
            # No more are handed out than run at once, so that few are under suspicion when a worker dies.
            pool = Parallel(
                n_jobs=self.workers, return_as="generator_unordered", batch_size=1, pre_dispatch=self.workers
            )
        results = pool(work())
        try:
            for result in results:  # noqa: UP028 - `yield from` would close it before the finally
                yield result
        finally:
            with warnings.catch_warnings():
                # Whoever stops early knows that work is lost.
                warnings.filterwarnings("ignore", message=".*have been cancelled", category=UserWarning)
                results.close()


@dataclass(frozen=True)
class DaskCluster:
    """A Dask cluster: a scheduler's address, or a `distributed.Client`, whose workers have isiw installed.

    Args:
        scheduler: the address, such as `"tcp://10.0.0.1:8786"`, or the client.
        attempts: how often a task is tried that the cluster itself could not carry out.
    """

    scheduler: Any
    attempts: int = 3

    def results(
        self, run: Callable[[_Item], _Result], items: Sequence[_Item]
    ) -> Generator[tuple[_Item, _Result | Failure], None, None]:
        """See `Executor`.

        Raises:
            StudyError: Dask is not installed, or the scheduler is not reached or lost.
        """
        dask = _distributed()
        with ExitStack() as stack:
            client = (
                stack.enter_context(_client(dask, self.scheduler)) if _is_address(self.scheduler) else self.scheduler
            )
            futures = client.map(_attempt_alone, [run] * len(items), items, pure=False, retries=self.attempts - 1)
            stack.callback(client.cancel, futures)
            item_of = {future.key: item for future, item in zip(futures, items, strict=True)}
            for future in dask.as_completed(futures):
                yield item_of[future.key], _result_of(future)
                future.release()


def _is_address(scheduler: Any) -> bool:
    return isinstance(scheduler, str)


def _distributed() -> Any:
    try:
        return importlib.import_module("distributed")
    except ModuleNotFoundError as error:
        raise StudyError("Dask is not installed", remedy='Install it with: pip install "isiw[dask]"') from error


def _client(dask: Any, address: str) -> Any:
    try:
        return dask.Client(address)
    except (OSError, ValueError) as error:
        raise StudyError(
            "the Dask scheduler cannot be reached", got=address, remedy="Check its address, and that it is running."
        ) from error


def _result_of(future: Any) -> Any:
    """What a Dask future came to; the death of its workers is its failure, the loss of the cluster an error."""
    if future.status in {"cancelled", "lost"}:
        raise StudyError("the Dask scheduler was lost", remedy="Run the study again: what is finished is kept.")
    error = future.exception()
    return future.result() if error is None else Failure(_line(error))


def _attempt(run: Callable[[_Item], _Result], item: _Item) -> _Result | Failure:
    try:
        return run(item)
    except Exception as error:  # noqa: BLE001 - one that fails must not end the others; it is reported
        return Failure(_line(error), traceback.format_exc())


def _numbered(run: Callable[[_Item], _Result], number: int, item: _Item) -> tuple[int, _Result | Failure]:
    return number, _attempt(run, item)


_ONE_AT_A_TIME = threading.Lock()


def _attempt_alone(run: Callable[[_Item], _Result], item: _Item) -> _Result | Failure:
    """One session at a time in each worker process, however many threads it has: torch and Pyro share global state."""
    with _ONE_AT_A_TIME:
        return _attempt(run, item)


def _line(error: BaseException) -> str:
    return " ".join(traceback.format_exception_only(error)[-1].split())
