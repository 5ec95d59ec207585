"""Pictures: of sessions, of a study, and of the timing of taps. They draw, and compute nothing."""

from isiw.plots.comparison import comparison_figure, prior_figure, save_comparison_plot, save_prior_plot
from isiw.plots.session import save_session_plot, session_figure
from isiw.plots.study import STUDY_PICTURES, save_study_plot, study_figure
from isiw.plots.timeline import save_timing_plot, timing_figure

__all__ = [
    "STUDY_PICTURES",
    "comparison_figure",
    "prior_figure",
    "save_comparison_plot",
    "save_prior_plot",
    "save_session_plot",
    "save_study_plot",
    "save_timing_plot",
    "session_figure",
    "study_figure",
    "timing_figure",
]
