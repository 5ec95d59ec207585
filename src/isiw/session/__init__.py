"""A session: the closed loop from the first ask to the decision, and going on with one from its log."""

from isiw.session.loop import Session
from isiw.session.progress import PROGRESS_HEADINGS, aligned, progress_row
from isiw.session.recorder import Recorder, open_session
from isiw.session.resume import exclude, include, resume
from isiw.session.updates import SessionResult, SessionUpdate

__all__ = [
    "PROGRESS_HEADINGS",
    "Recorder",
    "Session",
    "SessionResult",
    "SessionUpdate",
    "aligned",
    "exclude",
    "include",
    "open_session",
    "progress_row",
    "resume",
]
