"""What becomes of a write where a disk has no room left."""

from __future__ import annotations

import errno
import os
from typing import Never


def no_room(_: object) -> Never:
    """In place of a call of the operating system that writes."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
