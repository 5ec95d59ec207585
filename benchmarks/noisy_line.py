"""A serial line that damages bytes: a pseudo-terminal in front of another one."""

from __future__ import annotations

import os
import select
import threading
from contextlib import suppress
from typing import Self

import numpy as np

__all__ = ["NoisyLine"]


class NoisyLine:
    """Passes bytes on both ways, and flips a bit of some, loses some, and adds some.

    Args:
        behind: the terminal of the instrument.
        seed: of the noise.
        rate: the share of bytes that are damaged.
    """

    def __init__(self, behind: str, seed: int, rate: float = 1 / 3000) -> None:
        import pty  # noqa: PLC0415 - not on Windows
        import tty  # noqa: PLC0415 - same

        self._behind = os.open(behind, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._ours, self._theirs = pty.openpty()
        tty.setraw(self._theirs)
        self.address = os.ttyname(self._theirs)
        self.damaged = 0
        self._rng, self._rate = np.random.default_rng(seed), rate
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._pass_on, name="noisy line", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(5)
        for handle in (self._behind, self._ours, self._theirs):
            os.close(handle)

    def _pass_on(self) -> None:
        other = {self._behind: self._ours, self._ours: self._behind}
        while not self._over.is_set():
            for handle in select.select(list(other), [], [], 0.05)[0]:
                with suppress(OSError):
                    os.write(other[handle], self._with_noise(os.read(handle, 4096)))

    def _with_noise(self, data: bytes) -> bytes:
        passed = bytearray()
        for byte in data:
            if self._rng.random() >= self._rate:
                passed.append(byte)
                continue
            self.damaged += 1
            kind = int(self._rng.integers(3))
            if kind == 0:
                passed.append(byte ^ 1 << int(self._rng.integers(8)))
            elif kind == 1:
                passed += bytes([byte, int(self._rng.integers(256))])
        return bytes(passed)
