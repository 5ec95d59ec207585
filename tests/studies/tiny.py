"""A study that takes a second or two, and functions that end badly."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import pandas as pd

from isiw.studies import Study, StudyStrategy
from isiw.studies.sessions import TIMES

FEW = {"particles": 40}

TOML = """\
strategies = [{ name = "even", settings = { particles = 40 } }, "incremental"]
cohorts = ["gaussian"]
people = 12
trials = 4
marks = [2, 4]
stopping = "ignored"
"""


def tiny(**changed: Any) -> Study:
    """Two strategies, two cohorts, three people."""
    usual: dict[str, Any] = {
        "strategies": (StudyStrategy("even", FEW), StudyStrategy("incremental")),
        "cohorts": ("gaussian", "nonresponder"),
        "people": 3,
        "trials": 4,
        "marks": (2, 4),
    }
    return Study(**(usual | changed))


def timeless(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows without what differs each time."""
    return rows.drop(columns=list(TIMES))


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
