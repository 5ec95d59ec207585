from __future__ import annotations

import numpy as np
import pytest
from benchmarks.dissertation.examples import verdict_on_one

OURS = np.array([4, 5, 5, 5, 6, 6, 6, 6, 7, 7, 8, 17])


@pytest.mark.parametrize(
    ("theirs", "verdict"), [(6, "reproduced"), (9, "not, because it is outside"), (4, "not"), (30, "not")]
)
def test_one_person_is_held_against_the_middle_half_of_ours(theirs: int, verdict: str) -> None:
    assert verdict_on_one(theirs, OURS).startswith(verdict)
