"""Refuses a library that was compiled from other sources than those beside it, as after an update of a checkout."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Final

from isiw.errors import IsiwError
from isiw.native.sources import digest

LONGEST: Final = 200
"""Of a library's statement of how it was made [bytes]."""


def stated(library: ctypes.CDLL) -> list[str]:
    """How a library says that it was made: a word, the digest of its sources, and that of everything else."""
    return (ctypes.c_char * LONGEST).in_dll(library, "isiw_sources").value.decode().split(":")


def require_built_of(library: ctypes.CDLL, folder: Path) -> None:
    """Have a library be of the sources in a folder; an installed package has no such folder, and nothing to compare.

    Raises:
        IsiwError: it was compiled from other sources.
    """
    if not folder.is_dir():
        return
    said, expected = stated(library), digest(folder)
    if expected not in said:
        raise IsiwError(
            "the compiled engine was made of other sources than those beside it",
            got=":".join(said),
            expected=f"isiw-sources:{expected}",
            remedy="Run pip install -e . again, in the folder of isiw.",
        )
