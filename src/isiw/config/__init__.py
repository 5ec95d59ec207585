"""Configuration files, and the sessions that they describe."""

from isiw.config.resume import (
    Truth,
    after_end,
    after_error,
    changes_on_resume,
    device_of_log,
    differences_on_resume,
    read_to_resume,
    run_of_log,
    truth_of,
)
from isiw.config.run import RunConfig, limits_for, load_config
from isiw.config.session import (
    assumed_space,
    device_for,
    fresh_log_path,
    require_device,
    require_same_person,
    session_for,
    subject_for,
    told_imported,
    write_rig_template,
)

__all__ = [
    "RunConfig",
    "Truth",
    "after_end",
    "after_error",
    "assumed_space",
    "changes_on_resume",
    "device_for",
    "device_of_log",
    "differences_on_resume",
    "fresh_log_path",
    "limits_for",
    "load_config",
    "read_to_resume",
    "require_device",
    "require_same_person",
    "run_of_log",
    "session_for",
    "subject_for",
    "told_imported",
    "truth_of",
    "write_rig_template",
]
