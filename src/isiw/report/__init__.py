"""A session in words, for people."""

from isiw.report.words import (
    PROGRESS_HEADINGS,
    TRIAL_HEADINGS,
    final_statement,
    progress_row,
    trial_rows,
    truth_sentence,
)

__all__ = [
    "PROGRESS_HEADINGS",
    "TRIAL_HEADINGS",
    "final_statement",
    "progress_row",
    "trial_rows",
    "truth_sentence",
]
