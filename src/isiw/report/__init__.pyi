from . import comparison as comparison
from . import tables as tables
from . import words as words
from .comparison import save_comparison as save_comparison
from .page import report_page as report_page
from .page import save_report as save_report
from .words import final_statement as final_statement
