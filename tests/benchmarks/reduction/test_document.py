"""The report: what is written, and what missing numbers become."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
from benchmarks.reduction.document import Section, Table, write
from benchmarks.reduction.look import panels


def test_a_report_has_facts_prose_tables_figure_and_conclusions(tmp_path: Path) -> None:
    rows = pd.DataFrame({"method": ["NR", "GPR"], "trials": [15.5, float("nan")], "held": [True, False]})
    section = Section("Title", "Prose.", [Table("Caption.", rows)], ("bars", panels(1, 1)[0]), ["It holds."])
    write([section], {"seed": 3}, tmp_path / "report", "A report", "It comes out.", [{"where": "Fig. 1"}])
    told = (tmp_path / "report.md").read_text()
    for part in (
        "\n\nIt comes out.\n\n- seed: 3",
        "## Title",
        "Prose.",
        "Caption.",
        "| NR",
        "15.5",
        "–",
        "(report_bars.png)",
        "- It holds.",
    ):
        assert part in told
    assert told.startswith("# A report\n")
    assert (tmp_path / "report_bars.png").stat().st_size > 1000
    record = json.loads((tmp_path / "report.json").read_text())
    assert record["sections"][0]["tables"][0]["rows"][1] == {"method": "GPR", "trials": None, "held": False}
    assert record["claims"] == [{"where": "Fig. 1"}]
