"""Pictures: of sessions, of a study, and of the timing of taps. They draw, and compute nothing."""

from isiw.plots.comparison import comparison_figure, prior_figure
from isiw.plots.session import save_session_plot, session_figure
from isiw.plots.study import STUDY_PICTURES, study_figure
from isiw.plots.style import save_figure
from isiw.plots.timeline import timing_figure

__all__ = [
    "STUDY_PICTURES",
    "comparison_figure",
    "prior_figure",
    "save_figure",
    "save_session_plot",
    "session_figure",
    "study_figure",
    "timing_figure",
]
