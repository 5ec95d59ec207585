"""Configuration files, and the sessions that they describe."""

from isiw.config.going_on import changes_on_resume, differences_on_resume, read_to_resume
from isiw.config.next_steps import after_end, after_error
from isiw.config.rig import write_rig_template
from isiw.config.run import RunConfig, config_of_log, limits_for, load_config
from isiw.config.session import (
    assumed_space,
    device_for,
    fresh_log_path,
    has_truth,
    require_device,
    session_for,
    subject_for,
    true_window,
)
from isiw.config.taught import require_same_person

__all__ = [
    "RunConfig",
    "after_end",
    "after_error",
    "assumed_space",
    "changes_on_resume",
    "config_of_log",
    "device_for",
    "differences_on_resume",
    "fresh_log_path",
    "has_truth",
    "limits_for",
    "load_config",
    "read_to_resume",
    "require_device",
    "require_same_person",
    "session_for",
    "subject_for",
    "true_window",
    "write_rig_template",
]
