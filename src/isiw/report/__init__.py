"""A session in words, for people."""

from isiw.report.comparison import comparison_sentence, comparison_table
from isiw.report.words import TRIAL_HEADINGS, final_statement, trial_rows, truth_sentence

__all__ = [
    "TRIAL_HEADINGS",
    "comparison_sentence",
    "comparison_table",
    "final_statement",
    "trial_rows",
    "truth_sentence",
]
