"""Configuration files, and the sessions that they describe."""

from isiw.config.rig import write_rig_template
from isiw.config.run import (
    RunConfig,
    config_of_log,
    device_for,
    fresh_log_path,
    has_truth,
    load_config,
    require_same_person,
    session_for,
    subject_for,
    true_window,
)

__all__ = [
    "RunConfig",
    "config_of_log",
    "device_for",
    "fresh_log_path",
    "has_truth",
    "load_config",
    "require_same_person",
    "session_for",
    "subject_for",
    "true_window",
    "write_rig_template",
]
