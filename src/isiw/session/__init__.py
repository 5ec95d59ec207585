"""A session: the closed loop from the first ask to the decision, and going on with one from its log."""

from isiw.session.loop import Session
from isiw.session.recorder import Recorder, open_session
from isiw.session.resume import exclude, resume
from isiw.session.updates import SessionResult, SessionUpdate

__all__ = ["Recorder", "Session", "SessionResult", "SessionUpdate", "exclude", "open_session", "resume"]
