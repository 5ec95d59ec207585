"""A study that takes a second or two."""

from __future__ import annotations

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
