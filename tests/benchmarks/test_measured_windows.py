from __future__ import annotations

import pandas as pd
from benchmarks.measured_windows import verdicts

from isiw.subjects.measured import MEASURED_KIM


def test_the_sweeps_that_show_no_window_are_told_beside_the_widths() -> None:
    table = pd.DataFrame(
        {
            "subject": range(1, 12),
            "width: text": [person.width_ms for person in MEASURED_KIM],
            "width: mean": [person.width_ms for person in MEASURED_KIM],
            "difference %": 4.0,
            "no window": [0.0, 0.1, 0.0, 0.35, *[0.0] * 7],
            "peak µV": [1e3 * person.peak_mv for person in MEASURED_KIM],
            "peak µV: read": [1e3 * person.peak_mv for person in MEASURED_KIM],
            "TMS alone crosses %": 0.0,
        }
    )
    assert "of the sweeps that show a window (worst 4.0 %; of subject 4, 35 % show none)" in verdicts(table)[0]
