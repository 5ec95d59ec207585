"""What holds for all tests before any library is imported, and in the processes that they start."""

from __future__ import annotations

import os

# Workers share the cores, and matrices are small: more threads only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")
