"""What a process leaves on the disk that dies at any one of its file operations, as by kill -9 or by a power cut."""

from __future__ import annotations

import builtins
import enum
import os
import stat
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Self

import pytest


class Ending(enum.StrEnum):
    """What becomes of what was not synced when the process dies."""

    KILLED = "all of it stays"
    TORN = "half of the bytes stay, and all names"
    POWER_CUT = "none of the bytes stays, and no name"


Left = tuple[tuple[str, bytes], ...]
"""Names and bytes of the files in a folder."""


@dataclass
class Disk:
    """Notes at each file operation in a folder what would be left if the process died there.

    A file holds what was written to the operating system: what waits in a buffer of the process dies with it.

    Args:
        folder: the folder; its files are synced.
        shadow: a folder beside it, for what the disk would still have.
        outside: what no ending reaches, and is noted with the rest.
    """

    folder: Path
    shadow: Path
    outside: Callable[[], bytes]
    steps: int = 0
    left: dict[tuple[Left, bytes], None] = field(default_factory=dict)
    """What an ending leaves in the folder and outside it, in the order of the operations."""
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
        self._note()
        result = act(*args, **kwargs)
        self._note()
        return result

    def _note(self) -> None:
        for ending in Ending:
            self.left[self._after(ending), self.outside()] = None
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

    def _after(self, ending: Ending) -> Left:
        files = {path.name: path for path in self.folder.iterdir()}
        if ending is Ending.POWER_CUT:
            files = {name: self.shadow / str(inode) for name, inode in self._names.items()}
        return tuple((name, self._kept(files[name], ending)) for name in sorted(files))

    def _kept(self, path: Path, ending: Ending) -> bytes:
        content, synced = path.read_bytes(), self._sizes.get(path.stat().st_ino, 0)
        if ending is Ending.KILLED:
            return content
        size = synced if ending is Ending.POWER_CUT else (synced + len(content)) // 2
        return content[:size].ljust(size, b"\0")


_link = os.link


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
