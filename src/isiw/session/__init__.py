"""A session: the closed loop from the first ask to the decision, and resuming one from its log."""

from isiw.log.kinds import LogKind, imported_sentence
from isiw.session import threshold_loops
from isiw.session.console import PROGRESS_HEADINGS, aligned, progress_row
from isiw.session.judging import estimate_again
from isiw.session.loop import Session
from isiw.session.recorder import Recorder
from isiw.session.resume import open_session, resume
from isiw.session.sink import SessionResult, SessionUpdate
from isiw.session.threshold import ThresholdRecorder, open_threshold, read_threshold, resume_threshold

__all__ = [
    "PROGRESS_HEADINGS",
    "LogKind",
    "Recorder",
    "Session",
    "SessionResult",
    "SessionUpdate",
    "ThresholdRecorder",
    "aligned",
    "estimate_again",
    "imported_sentence",
    "open_session",
    "open_threshold",
    "progress_row",
    "read_threshold",
    "resume",
    "resume_threshold",
    "threshold_loops",
]
