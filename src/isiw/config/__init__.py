"""Configuration files, and the sessions that they describe."""

from isiw.config import resume, session
from isiw.config.run import RunConfig, limits_for, load_config
from isiw.config.session import device_for, session_for

__all__ = ["RunConfig", "device_for", "limits_for", "load_config", "resume", "session", "session_for"]
