"""Files of other programs are read by a process of its own, whose memory, time and files are limited."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.existing import answer, formats
from isiw.existing.layout import Layout
from isiw.existing.limits import ReadingLimits, passed, seconds_for

_WAITS: Final = 5.0  # by the clock a process may take so many times its processor time: it may wait for a disk
_START_S: Final = 60.0  # so long it may take to start
_BYTES_A_ROW: Final = 10  # a row of a table has hardly less
_CHILD: Final = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from isiw.existing.child import main; main()"
"""What the process runs: it finds what this one finds, and nothing in the folder in which it is started."""
_ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Each thread of a library for matrices takes memory of its own."""


def read_apart(
    path: Path,
    layout: Layout,
    subject: str,
    limits: ReadingLimits,
    also: Sequence[str | Path] = (),
    *,
    look: bool = False,
) -> answer.Answer:
    """The people whose trials a file holds, read by a process of its own; or, to `look` into it, what is said of it."""
    is_table = formats.format_of(path).is_table
    seconds = seconds_for(limits, path, table=is_table)
    request = {"path": str(path), "layout": asdict(layout), "subject": subject, "limits": asdict(limits),
               "also": [str(other) for other in also], "look": look}  # fmt: skip
    rows = path.stat().st_size // _BYTES_A_ROW if is_table else 0
    most_s = _START_S + _WAITS * seconds_for(limits, path, table=is_table, rows=rows)
    with tempfile.TemporaryDirectory(prefix="isiw-") as folder:
        status = _run({**request, "answer": folder}, most_s)
        found = answer.read_answer(Path(folder)) if status == 0 else {}
    if isinstance(found, answer.Answer):
        return found
    if status is None or status == -getattr(signal, "SIGXCPU", 0):
        raise passed(path.name, "takes too long to read", None, seconds, " s of processor time")
    if found.get("memory") or status == -getattr(signal, "SIGKILL", 0):  # by the system, if memory is short
        raise passed(path.name, "takes too much memory to read", None, limits.memory_mb, " MB")
    what = f"{path.name} cannot be read: {found.get('fault', 'what reads it ended without an answer')}"
    remedy = "Is the file damaged? Save it again, as CSV if there is no other way. If it is large, say --larger 2."
    raise InvalidValueError(what, got=None if found else f"status {status}", remedy=remedy)


def _run(request: Mapping[str, Any], most_s: float) -> int | None:
    """The status with which the process ends; None if it had to be ended."""
    paths = json.dumps([place for place in sys.path if place])
    with subprocess.Popen(  # noqa: S603 - this Python, and words that are isiw's own
        [sys.executable, "-P", "-c", _CHILD, paths],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **_ONE_THREAD},
    ) as process:
        try:
            process.communicate(json.dumps(request).encode(), timeout=most_s)
        except BaseException as error:
            process.kill()
            if isinstance(error, subprocess.TimeoutExpired):
                return None
            raise
    return process.returncode
