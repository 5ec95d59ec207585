"""The first call of kernels: one process compiles, says so, and the others wait for it."""

from __future__ import annotations

import ast
import threading
from pathlib import Path

import pytest
from filelock import FileLock
from numba import njit

from isiw import compiled


@pytest.fixture(autouse=True)
def nothing_called(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "_CALLED", set())


def test_compiling_is_said_once_and_loading_is_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    timers = list[threading.Timer]()

    class Timer(threading.Timer):
        def cancel(self) -> None:  # as if it had been slow
            timers.append(self)
            self.function(*self.args, **self.kwargs)
            super().cancel()

    monkeypatch.setattr(threading, "Timer", Timer)
    with compiled.first_of("nothing"):
        pass
    assert capsys.readouterr().err == ""
    for family in ("one", "another"):
        with compiled.first_of(family):
            njit(lambda x: x + 1)(1)
    assert capsys.readouterr().err.count("isiw compiles its loops, once on this machine") == 1
    assert len(timers) == 3


def test_a_process_waits_for_another_that_compiles() -> None:
    entered = threading.Event()

    def call() -> None:
        with compiled.first_of("one"):
            entered.set()

    thread = threading.Thread(target=call)
    with FileLock(compiled._lock_file()):  # noqa: SLF001 - as the other process does
        thread.start()
        assert not entered.wait(0.2)
    assert entered.wait(30.0)
    thread.join()


def test_kernels_are_compiled_again_where_constants_change_that_they_have_compiled_in() -> None:
    folder = Path(compiled.__file__).parent
    imported = set[str]()
    for file in (*folder.glob("models/particles/kernels/*.py"), folder / "acquisition" / "information.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            constants = isinstance(node, ast.ImportFrom) and any(
                a.name.isupper() or "Kind" in a.name for a in node.names
            )
            if constants and isinstance(node, ast.ImportFrom) and node.module and "kernels" not in node.module:
                imported.add(node.module)
    known = {"isiw.compiled", "isiw.window", *(f"isiw.models.{name.replace('/', '.')}" for name in compiled._CONSTANTS)}  # noqa: SLF001
    assert imported <= known
