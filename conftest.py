"""What holds for all tests before any library is imported, and in the processes that they start."""

from __future__ import annotations

import os
import sys

# Workers share the cores, and matrices are small: more threads only wait for each other.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# Workers and the commands that tests start would otherwise compile the modules of isiw again, each of them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
