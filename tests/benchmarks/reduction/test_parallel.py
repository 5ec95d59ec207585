"""Work in several processes: what an interrupted run goes on from."""

from pathlib import Path

from benchmarks.reduction.parallel import Workers, in_parallel

ASKED: list[int] = []


def square(number: int) -> int:
    """Say that it was asked, and answer."""
    ASKED.append(number)
    return number**2


def test_a_run_that_goes_on_does_not_repeat_what_is_kept(tmp_path: Path) -> None:
    workers = Workers(1, tmp_path)
    assert in_parallel(square, [1, 2], workers, "squares") == [1, 4]
    assert in_parallel(square, [1, 2, 3], workers, "squares") == [1, 4, 9]
    assert ASKED == [1, 2, 3]
