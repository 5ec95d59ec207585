"""The digest of the engine's sources, by which a library says what it was made of.

The build loads this file by its path, where nothing is installed yet: it imports nothing of isiw.
"""

from __future__ import annotations

import hashlib
from pathlib import Path


def digest(folder: Path) -> str:
    """The digest of the C sources in a folder, of their names and of each byte."""
    state = hashlib.blake2b(digest_size=8)
    for file in sorted(folder.glob("*.[ch]"), key=lambda file: file.name):
        content = file.read_bytes()
        state.update(f"{file.name} {len(content)}\n".encode() + content)
    return state.hexdigest()
