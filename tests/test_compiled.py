"""The first call of kernels: one process compiles, says so, and the others wait for it."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
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


def doubled(values: Any) -> None:
    for i in range(len(values)):
        values[i] *= 2.0


def middle_flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "truncated": lambda content: content[: len(content) // 2],
    "garbage": lambda content: bytes(range(256)) * (len(content) // 256 + 1),
    "a bit of it flipped": middle_flipped,
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where compiled loops are kept, with one of them."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    compiled.kernel(doubled)(np.ones(3))
    return tmp_path


def called() -> Any:
    """A loop that a new process would call."""
    loop, values = compiled.kernel(doubled), np.ones(3)
    loop(values)
    assert values.tolist() == [2.0, 2.0, 2.0]
    return loop.stats  # type: ignore[attr-defined] # Numba's


@pytest.mark.parametrize("how", DAMAGE)
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_loop_whose_file_is_damaged_is_compiled_again_aloud_and_kept(kind: str, how: str, folder: Path) -> None:
    (file,) = folder.rglob(f"*.{kind}")
    file.write_bytes(DAMAGE[how](file.read_bytes()))
    if (kind, how) == ("nbi", "a bit of it flipped"):  # then it may be of another version, of which nothing is used
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            called()
    else:
        with pytest.warns(RuntimeWarning, match="Compiled loops that isiw keeps in .* are damaged") as said:
            called()
        assert len(said) == 1
    assert sum(called().cache_hits.values()) == 1


def test_a_loop_that_cannot_be_kept_is_compiled_all_the_same(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    for file in folder.rglob("*.nb?"):
        file.unlink()
    monkeypatch.setattr(compiled._Files, "_save_data", full)  # noqa: SLF001 - as a full disk does
    assert not called().cache_hits
    monkeypatch.undo()


@pytest.mark.slow
def test_where_numba_may_not_compile_torch_computes() -> None:
    script = (
        "import isiw; from isiw.compiled import version; print(version()); "
        "s = isiw.make_strategy(space=isiw.DesignSpace(0, 300, 5, reference='impact'), particles=50, thinned=20); "
        "s.tell(s.ask(), 0.1); s.tell(s.ask(), 0.0); s.note_change(); s.tell(s.ask(), 0.2); "
        "print(s.estimate().probability)"
    )
    ended = subprocess.run(  # noqa: S603 - a script of this test
        [sys.executable, "-c", script],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    said, probability = ended.stdout.split()
    assert said == "torch"
    assert 0.0 < float(probability) < 1.0
