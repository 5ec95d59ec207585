"""The same study on a Dask cluster gives identical rows."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
import pytest

from isiw.errors import StudyError
from isiw.studies import DaskCluster, Failure, conduct
from known import instance
from studies.tiny import timeless, tiny
from studies.work import double, double_or_die

if TYPE_CHECKING:
    from distributed import Client, LocalCluster


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    import dask  # noqa: PLC0415 - it takes half a second, which only the worker with these tests need spend
    from distributed import LocalCluster  # noqa: PLC0415 - same

    few = {"distributed.scheduler.allowed-failures": 1}  # the death of a worker takes seconds
    with dask.config.set(few), LocalCluster(2, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield cluster


@pytest.fixture(scope="module")
def client(cluster: LocalCluster) -> Iterator[Client]:
    from distributed import Client  # noqa: PLC0415 - same

    with Client(cluster) as client:
        yield client


@pytest.mark.slow
def test_a_study_has_identical_rows_on_a_cluster(tmp_path: Path, cluster: LocalCluster) -> None:
    here = conduct(tiny(), tmp_path / "here")
    there = conduct(tiny(), tmp_path / "there", DaskCluster(cluster.scheduler_address))
    pd.testing.assert_frame_equal(timeless(there.rows()), timeless(here.rows()))


@pytest.mark.slow  # as all that share the cluster
def test_what_raises_on_a_cluster_is_a_failure_among_the_results(client: Client) -> None:
    results = dict(DaskCluster(client).results(double, range(5)))
    assert instance(Failure, results.pop(3)).error == "ValueError: three is too many"
    assert results == {0: 0, 1: 2, 2: 4, 4: 8}


@pytest.mark.slow
def test_what_takes_workers_of_a_cluster_down_is_given_up_and_the_others_finish(client: Client) -> None:
    results = dict(DaskCluster(client).results(double_or_die, range(5)))
    failure = results.pop(3)
    assert isinstance(failure, Failure)
    assert "KilledWorker" in failure.error
    assert results == {0: 0, 1: 2, 2: 4, 4: 8}


@pytest.mark.slow
def test_stopping_early_leaves_the_cluster_free_for_others(client: Client) -> None:
    results = DaskCluster(client).results(double, range(20))
    next(results)
    results.close()
    assert client.submit(double, 21).result(timeout=10) == 42


def test_a_scheduler_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("distributed.Client", lambda address: (_ for _ in ()).throw(OSError(f"timed out: {address}")))
    with pytest.raises(StudyError, match=r"cannot be reached; got 'tcp://127.0.0.1:1'"):
        list(DaskCluster("tcp://127.0.0.1:1").results(double, [1]))


def test_the_loss_of_the_scheduler_ends_the_study_with_the_way_out() -> None:
    from distributed import Client, LocalCluster  # noqa: PLC0415 - same

    with LocalCluster(n_workers=1, processes=False, dashboard_address=":0") as lost, Client(lost) as client:
        results = DaskCluster(client).results(double, [1] * 50)
        next(results)
        lost.close()
        with pytest.raises(StudyError, match="scheduler was lost"):
            list(results)
