"""A process that dies at any one of its file operations, as by kill -9 or by a power cut."""

from __future__ import annotations

import builtins
import enum
import os
import stat
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Self

import pytest

from forked import fork

DIED = 77


class Ending(enum.StrEnum):
    """What becomes of what was not synced when the process dies."""

    KILLED = "all of it stays"
    TORN = "half of the bytes stay, and all names"
    POWER_CUT = "none of the bytes stays, and no name"


@dataclass
class Disk:
    """Counts the file operations in a folder, and lets the process die at one of them.

    Args:
        folder: the folder; its files are synced.
        shadow: a folder beside it, for what the disk would still have.
        last: the operation to die at, counted from 0: its beginning is an even number, its end the odd one behind.
        ending: what becomes of what was not synced.
    """

    folder: Path
    shadow: Path
    last: int
    ending: Ending
    steps: int = 0
    _sizes: dict[int, int] = field(default_factory=dict)
    _names: dict[str, int] = field(default_factory=dict)

    def install(self, patch: pytest.MonkeyPatch) -> None:
        """Watch what this process does from here on."""
        self._sizes = {path.stat().st_ino: path.stat().st_size for path in self.folder.iterdir()}
        self._remember_names()
        for name in ("rename", "replace", "link", "unlink"):
            patch.setattr(os, name, partial(self._step, getattr(os, name)))
        patch.setattr(os, "fsync", partial(self._step, partial(self._fsync, os.fsync)))
        patch.setattr(Path, "open", self._opening(Path.open))
        patch.setattr(builtins, "open", self._opening(open))

    def _opening(self, usual: Callable[..., Any]) -> Callable[..., Any]:
        def opened(path: Path, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
            if mode == "rb":
                return usual(path, mode, *args, **kwargs)
            return _Watched(self._step(usual, path, mode, *args, **kwargs), self._step)

        return opened

    def _step(self, act: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        self._die_if_due()
        result = act(*args, **kwargs)
        self._die_if_due()
        return result

    def _die_if_due(self) -> None:
        if self.steps == self.last:
            self._forget()
            os._exit(DIED)
        self.steps += 1

    def _fsync(self, usual: Callable[[int], None], handle: int) -> None:
        usual(handle)
        found = os.fstat(handle)
        if stat.S_ISDIR(found.st_mode):
            self._remember_names()
        else:
            self._sizes[found.st_ino] = found.st_size

    def _remember_names(self) -> None:
        self._names = {path.name: path.stat().st_ino for path in self.folder.iterdir()}
        for name, inode in self._names.items():
            if not (kept := self.shadow / str(inode)).exists():
                _link(self.folder / name, kept)

    def _forget(self) -> None:
        if self.ending is Ending.POWER_CUT:
            for path in self.folder.iterdir():
                _unlink(path)
            for name, inode in self._names.items():
                _link(self.shadow / str(inode), self.folder / name)
        if self.ending is not Ending.KILLED:
            for path in self.folder.iterdir():
                synced, size = self._sizes.get(path.stat().st_ino, 0), path.stat().st_size
                os.truncate(path, synced if self.ending is Ending.POWER_CUT else (synced + size) // 2)


_link, _unlink = os.link, os.unlink


class _Watched:
    """An open file whose flushing and closing are steps."""

    def __init__(self, file: Any, step: Callable[..., Any]) -> None:
        self._file, self._step = file, step

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def flush(self) -> None:
        self._step(self._file.flush)

    def close(self) -> None:
        self._step(self._file.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def run_until(step: int, ending: Ending, folder: Path, shadow: Path, act: Callable[[], object]) -> int | None:
    """Do something in a process that dies at a step; None where it died, else how many steps it took."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forking beside idle threads
        child = fork()
    if child == 0:
        disk = Disk(folder, shadow, step, ending)
        try:
            with pytest.MonkeyPatch.context() as patch:
                disk.install(patch)
                act()
            os.write(writing, str(disk.steps).encode())
        except BaseException as error:  # noqa: BLE001 - told to the parent
            os.write(writing, f"{type(error).__name__}: {error}".encode())
        finally:
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        said = pipe.read().decode()
    _, status = os.waitpid(child, 0)
    if os.waitstatus_to_exitcode(status) == DIED:
        return None
    assert said.isdigit(), said
    return int(said)
