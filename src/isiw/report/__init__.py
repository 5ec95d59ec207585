"""A session in words, and as a page, for people."""

from isiw.report.facts import first_facts
from isiw.report.page import report_page, save_report
from isiw.report.words import TRIAL_HEADINGS, final_statement, trial_rows, truth_sentence

__all__ = [
    "TRIAL_HEADINGS",
    "final_statement",
    "first_facts",
    "report_page",
    "save_report",
    "trial_rows",
    "truth_sentence",
]
