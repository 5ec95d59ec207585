from .facts import first_facts as first_facts
from .page import report_page as report_page
from .page import save_report as save_report
from .words import TRIAL_HEADINGS as TRIAL_HEADINGS
from .words import final_statement as final_statement
from .words import trial_rows as trial_rows
from .words import truth_sentence as truth_sentence
