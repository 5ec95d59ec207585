"""Code that is imported when it is needed: what an operator's own configuration names, never a log, and extras."""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from isiw.errors import ConfigError, did_you_mean


def named_code(reference: str, folder: Path | None, key: str) -> Any:
    """The code that a configuration names, imported."""
    module_name, _, name = reference.partition(":")
    with _importable(folder):
        try:
            return getattr(importlib.import_module(module_name), name)
        except (ImportError, AttributeError) as error:
            module, beside = sys.modules.get(module_name), () if folder is None else folder.glob("*.py")
            files = (file.stem for file in beside)
            meant = did_you_mean(module_name, files) if module is None else did_you_mean(name, vars(module))
            where = f"The module is looked for in {folder or 'the installed packages'} first."
            raise ConfigError(
                f"{key} cannot be imported: {error}",
                got=reference,
                expected="module:function, such as mylab.rig:make",
                remedy=f"{meant} {where}".lstrip(),
            ) from error


def library(name: str, extra: str) -> Any:
    """A library of one of isiw's extras, imported."""
    try:
        return importlib.import_module(name)
    except (ImportError, RuntimeError) as error:  # the latter if a shared library that it wraps is missing
        what, remedy = f"{name.partition('.')[0]} is not installed", f'Install it with: pip install "isiw[{extra}]"'
        raise ConfigError(what, got=f"{error}", remedy=remedy) from error


def require_fitting(make: Callable[..., object], settings: Mapping[str, Any], key: str) -> None:
    """Check that a function takes some settings."""
    signature = inspect.signature(make)
    try:
        signature.bind(**settings)
    except TypeError as error:
        parameters = signature.parameters
        meant = next(filter(None, (did_you_mean(name, parameters) for name in settings if name not in parameters)), "")
        takes = f"It takes {', '.join(parameters) or 'no settings'}."
        raise ConfigError(
            f"{key} do not fit the function: {error}", got=dict(settings), remedy=f"{meant} {takes}".lstrip()
        ) from error


@contextmanager
def _importable(folder: Path | None) -> Iterator[None]:
    """Within, a folder's modules are imported first; later, as drivers may be imported late, after all others."""
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
