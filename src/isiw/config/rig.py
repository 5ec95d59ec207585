"""A lab's own rig, named in its own configuration: `[device] factory = "mylab.rig:make"`.

A log never names it: what is imported is what the person at the keyboard has configured.
"""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

from isiw.devices.protocol import Device
from isiw.errors import ConfigError, did_you_mean
from isiw.log.outputs import made_folder

__all__ = ["TEMPLATE_FILES", "device_from_factory", "write_rig_template"]

TEMPLATE_FILES = ("rig.py", "session.toml", "test_rig.py")
"""What `write_rig_template` writes."""


def device_from_factory(factory: str, settings: Mapping[str, Any], folder: Path | None = None) -> Device:
    """The device that a factory makes.

    Args:
        factory: where it is, as `module:function`.
        settings: its keyword arguments.
        folder: where the module is looked for before anything else.

    Raises:
        ConfigError: it cannot be imported, does not take the settings, or makes no device.
    """
    module_name, _, name = factory.partition(":")
    with _importable(folder):
        try:
            make = getattr(importlib.import_module(module_name), name)
        except (ImportError, AttributeError) as error:
            where = f"The module is looked for in {folder or 'the installed packages'} first."
            raise ConfigError(
                f"device.factory cannot be imported: {error}",
                got=factory,
                expected="module:function, such as mylab.rig:make",
                remedy=f"{_meant(module_name, name, folder)} {where}".lstrip(),
            ) from error
    _require_fitting(make, settings)
    device = make(**settings)
    if not isinstance(device, Device):
        raise ConfigError(
            "device.factory makes no device",
            got=type(device).__name__,
            expected="an object with describe, stage, deliver, stop and unstage",
            remedy="See isiw.Device.",
        )
    return device


def _meant(module_name: str, name: str, folder: Path | None) -> str:
    """The function, or the module beside the configuration, that was probably meant, as a question."""
    module = sys.modules.get(module_name)
    if module is not None:
        return did_you_mean(name, vars(module))
    return did_you_mean(module_name, () if folder is None else (file.stem for file in folder.glob("*.py")))


def _require_fitting(make: Callable[..., object], settings: Mapping[str, Any]) -> None:
    parameters = inspect.signature(make).parameters
    try:
        inspect.signature(make).bind(**settings)
    except TypeError as error:
        meant = next(filter(None, (did_you_mean(key, parameters) for key in settings if key not in parameters)), "")
        takes = f"It takes {', '.join(parameters) or 'no settings'}."
        raise ConfigError(
            f"device.settings do not fit the factory: {error}",
            got=dict(settings),
            remedy=f"{meant} {takes}".lstrip(),
        ) from error


@contextmanager
def _importable(folder: Path | None) -> Iterator[None]:
    """Within, modules of a folder can be imported before any others of their name; later, after them.

    Drivers are often imported late, and a lab's file may have the name of a module that isiw imports late.
    """
    if folder is None:
        yield
        return
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        if str(folder) not in sys.path:
            sys.path.append(str(folder))


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
    there = [str(file) for file in files if file.exists()]
    if there:
        raise ConfigError("the files are there already", got=", ".join(there), remedy="Choose another folder.")
    made_folder(target)
    templates = resources.files("isiw.config") / "rig_template"
    for file in files:
        file.write_text((templates / f"{file.name}.txt").read_text(encoding="utf-8"), encoding="utf-8")
    return files
