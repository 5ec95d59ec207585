"""Configuration files, and the sessions that they describe."""

from isiw.config.going_on import changes_on_resume, differences_on_resume
from isiw.config.rig import write_rig_template
from isiw.config.run import (
    RunConfig,
    config_of_log,
    device_for,
    fresh_log_path,
    has_truth,
    limits_for,
    load_config,
    require_same_person,
    session_for,
    subject_for,
    true_window,
)

__all__ = [
    "RunConfig",
    "changes_on_resume",
    "config_of_log",
    "device_for",
    "differences_on_resume",
    "fresh_log_path",
    "has_truth",
    "limits_for",
    "load_config",
    "require_same_person",
    "session_for",
    "subject_for",
    "true_window",
    "write_rig_template",
]
