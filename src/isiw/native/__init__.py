"""The compiled engine: C sources in `source`, and the library that was made of them when isiw was installed."""

from __future__ import annotations

import ctypes
import platform
from functools import cache
from pathlib import Path
from typing import Final

from isiw.errors import IsiwError
from isiw.native.stamp import require_built_of

_FILE: Final = {"Darwin": "_engine.dylib", "Windows": "_engine.dll"}.get(platform.system(), "_engine.so")


@cache
def library() -> ctypes.CDLL:
    """The library, loaded once.

    Raises:
        IsiwError: it is not there, cannot be loaded, or was compiled from other sources.
    """
    file = Path(__file__).with_name(_FILE)
    try:
        loaded = ctypes.CDLL(str(file))
    except OSError as error:
        raise IsiwError(
            "the compiled engine cannot be loaded",
            got=str(error),
            expected=str(file),
            remedy="Install isiw again; in a checkout: pip install -e .",
        ) from error
    require_built_of(loaded, file.with_name("source"))
    return loaded
