"""Where work is done: nothing that one item does ends the others."""

from __future__ import annotations

import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
import torch
from threadpoolctl import threadpool_info

from isiw.errors import ConfigError, InvalidValueError
from isiw.studies.execution import DaskCluster, Failure, Processes, _attempt_alone, one_thread
from known import instance
from studies.work import double, double_or_die, double_or_die_once, process_id

posix = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")


def test_one_thread_computes_and_afterwards_as_many_as_before() -> None:
    torch.set_num_threads(2)
    try:
        with one_thread():
            blas = [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]
            assert (torch.get_num_threads(), set(blas)) == (1, {1})
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(1)


def test_torch_is_not_imported_for_the_sake_of_its_threads_and_begins_with_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "torch")
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    with one_thread():
        assert "torch" not in sys.modules
        assert os.environ["OMP_NUM_THREADS"] == "1"
    assert "torch" not in sys.modules
    assert os.environ["OMP_NUM_THREADS"] == "3"


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_what_raises_is_a_failure_among_the_results(workers: int) -> None:
    results = dict(Processes(workers).results(double, range(6)))
    failure = instance(Failure, results.pop(3))
    assert results == {0: 0, 1: 2, 2: 4, 4: 8, 5: 10}
    assert failure.error == "ValueError: three is too many"
    assert "in double" in failure.details


@posix
@pytest.mark.slow
def test_what_takes_its_worker_down_again_and_again_is_given_up_and_the_others_finish() -> None:
    results = dict(Processes(2, attempts=2).results(double_or_die, range(6)))
    failure = instance(Failure, results.pop(3))
    assert results == {0: 0, 1: 2, 2: 4, 4: 8, 5: 10}
    assert "Its worker died 2 times" in failure.error


@posix
@pytest.mark.slow
def test_what_runs_while_a_worker_dies_is_run_again(tmp_path: Path) -> None:
    items = [(number, tmp_path / "witness") for number in range(6)]
    results = [(item[0], result) for item, result in Processes(2).results(double_or_die_once, items)]
    assert sorted(results) == [(number, 2 * number) for number in range(6)]


@pytest.mark.slow
@posix
def test_a_worker_leaves_ctrl_c_to_the_process_that_it_works_for() -> None:
    results = Processes(2).results(process_id, range(20))
    _, first = next(results)
    os.kill(instance(int, first), signal.SIGINT)
    rest = [result for _, result in results]
    assert len(rest) == 19
    assert first in rest


@pytest.mark.slow
def test_stopping_early_leaves_the_rest_undone() -> None:
    results = Processes(2).results(double, range(100))
    next(results)
    results.close()
    assert list(results) == []


@pytest.mark.parametrize("wrong", [{"workers": 0}, {"attempts": 0}])
def test_no_worker_or_attempt_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="at least 1"):
        Processes(**wrong)


def test_a_worker_of_many_threads_runs_one_session_at_a_time() -> None:
    inside, most = [], []

    def run(item: int) -> None:
        inside.append(item)
        most.append(len(inside))
        threading.Event().wait(0.01)
        inside.remove(item)

    threads = [threading.Thread(target=_attempt_alone, args=(run, item)) for item in range(5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1] * 5


def test_without_dask_the_message_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=r"isiw\[dask\]"):
        list(DaskCluster("tcp://127.0.0.1:1").results(double, [1]))
