"""Work that ends well or badly; a worker that does it need not load isiw, which takes it a second."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def double(number: int) -> int:
    if number == 3:
        raise ValueError("three is too many")
    return 2 * number


def double_or_die(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * number


def double_or_die_once(item: tuple[int, Path]) -> int:
    """Dies with number 3 the first time that somebody tries."""
    number, witness = item
    if number == 3 and not witness.exists():
        witness.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * number


def process_id(_number: int) -> int:
    """After a moment, in which another worker has something to do, too."""
    time.sleep(0.02)
    return os.getpid()
