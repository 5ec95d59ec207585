from __future__ import annotations

import pandas as pd
from benchmarks.reduction.before import FIXED, in_words


def test_what_there_is_before_any_trial_is_said_cohort_by_cohort() -> None:
    found = pd.DataFrame({"cohort": ["a", "b"], "default": [0.41, 0.5], FIXED: [0.52, 0.6]})
    assert in_words(found) == (
        "Before any trial the default's F1 is 0.41 on `a`, 0.50 on `b`; "
        "one fixed window for everybody has 0.52 on `a`, 0.60 on `b`."
    )
