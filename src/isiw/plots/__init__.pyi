from .comparison import STUDY_PICTURES as STUDY_PICTURES
from .comparison import comparison_figure as comparison_figure
from .comparison import prior_figure as prior_figure
from .comparison import study_figure as study_figure
from .session import save_session_plot as save_session_plot
from .session import session_figure as session_figure
from .style import save_figure as save_figure
from .timeline import timing_figure as timing_figure
