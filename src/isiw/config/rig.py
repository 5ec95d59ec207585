"""A lab's own rig, named in its own configuration: `[device] factory = "mylab.rig:make"`.

A log never names it: what is imported is what the person at the keyboard has configured.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from isiw.devices.protocol import Device
from isiw.errors import ConfigError
from isiw.log.outputs import write_output
from isiw.text.named_code import named_code, require_fitting

TEMPLATE_FILES = ("rig.py", "session.toml", "test_rig.py")
"""What `write_rig_template` writes."""


def device_from_factory(factory: str, settings: Mapping[str, Any], folder: Path | None = None) -> Device:
    """The device that a factory makes."""
    make = named_code(factory, folder, "device.factory")
    require_fitting(make, settings, "device.settings")
    device = make(**settings)
    if not isinstance(device, Device):
        raise ConfigError(
            "device.factory makes no device",
            got=type(device).__name__,
            expected="an object with describe, stage, deliver, stop and unstage",
            remedy="See isiw.Device.",
        )
    return device


def write_rig_template(folder: str | Path) -> tuple[Path, ...]:
    """Write a commented starting point for a rig: device, configuration and test. It runs as it is, on made-up EMG.

    Args:
        folder: where to; it is made where it does not exist.

    Returns:
        The files.

    Raises:
        ConfigError: one of the files exists already; nothing is written.
        InvalidValueError: the folder cannot be made.
    """
    target = Path(folder)
    files = tuple(target / name for name in TEMPLATE_FILES)
    there = [str(file) for file in files if os.path.lexists(file)]
    if there:
        raise ConfigError("the files are there already", got=", ".join(there), remedy="Choose another folder.")
    templates = resources.files("isiw.config") / "rig_template"
    for file in files:
        write_output(file, (templates / f"{file.name}.txt").read_bytes())
    return files
