"""Files of other programs are read by a process of its own, whose memory, time and files are limited.

It answers in JSON and plain numbers, and in nothing that could be code.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, create_model

from isiw import errors
from isiw.errors import InvalidValueError, IsiwError
from isiw.existing import formats
from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout
from isiw.existing.limits import ReadingLimits, passed, seconds_for
from isiw.sweeps import Channel

_WAITS: Final = 5.0  # by the clock a process may take so many times its processor time: it may wait for a disk
_START_S: Final = 60.0  # so long it may take to start
_BYTES_A_ROW: Final = 10  # a row of a table has hardly less
_CHILD: Final = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from isiw.existing.child import main; main()"
"""What the process runs: it finds what this one finds, and nothing in the folder in which it is started."""
_ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Each thread of a library for matrices takes memory of its own."""
ANSWER: Final = "answer.json"
SAMPLES: Final = "samples.f8"

_KINDS: Final = {one.__name__: one for one in (InvalidValueError, errors.ConfigError, errors.LogError)}


class _Shown(str):
    """A value as it printed in the process that reads."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


@cache
def _person() -> type[BaseModel]:
    """The fields of `Delivered` that are written as JSON for each person."""
    hints, apart = get_type_hints(Delivered), {"sweeps", "files", "unused"}
    known: dict[str, Any] = {one.name: (hints[one.name], ...) for one in fields(Delivered) if one.name not in apart}
    return create_model("Person", __config__=ConfigDict(ser_json_inf_nan="strings"), **known)


class Answer(NamedTuple):
    """The people that were read, and what is said of a file that was looked into."""

    people: list[Delivered]
    said: Mapping[str, Any]


def write_answer(folder: Path, found: Answer, hashes: Mapping[str, str]) -> None:
    """Write what was read into a folder."""
    channels = []
    with (folder / SAMPLES).open("wb") as samples:
        for number, person in enumerate(found.people):
            for trial, sweep in person.sweeps.items():
                for name, one in sweep.items():
                    np.ascontiguousarray(one.values, dtype="<f8").tofile(samples)
                    channels.append([number, trial, name, len(one.values), one.rate_hz, one.unit, one.t0_ms])
    people = [_person().model_construct(**vars(person)).model_dump_json() for person in found.people]
    shared = {"files": hashes, "unused": found.people[0].unused if found.people else ()}  # by all people of a file
    values = {"people": people, "shared": shared, "channels": channels, "said": found.said}
    (folder / ANSWER).write_text(json.dumps(values), encoding="ascii")


def write_error(folder: Path, error: BaseException) -> None:
    """Write why nothing could be read into a folder."""
    values: dict[str, Any] = {"fault": errors.error_text(error), "memory": isinstance(error, MemoryError)}
    if isinstance(error, IsiwError):
        got = None if error.got is None else errors.shortened(error.got)
        said = {"what": error.what, "got": got, "expected": error.expected, "remedy": error.remedy}
        values = {"error": type(error).__name__, "said": said}
    elif isinstance(error, OSError):
        name = None if error.filename is None else str(error.filename)
        values = {"system": [error.errno, error.strerror or str(error), name]}
    (folder / ANSWER).write_text(json.dumps(values), encoding="ascii")


def read_answer(folder: Path) -> Answer | dict[str, Any]:
    """What was read, or what failed in a way that isiw has no words for; an error in words is raised."""
    values: dict[str, Any] = json.loads((folder / ANSWER).read_text(encoding="ascii"))
    if "error" in values:
        said = values["said"]
        said["got"] = None if said["got"] is None else _Shown(said["got"])
        raise _KINDS.get(values["error"], InvalidValueError)(said.pop("what"), **said)
    if "system" in values:
        raise OSError(*values["system"])
    if "people" not in values:
        return values
    samples, end = np.fromfile(folder / SAMPLES, dtype="<f8"), 0
    sweeps: dict[int, dict[int, dict[str, Channel]]] = defaultdict(lambda: defaultdict(dict))
    for person, trial, name, length, *about in values["channels"]:
        begin, end = end, end + length
        sweeps[person][trial][name] = Channel(samples[begin:end], *about)
    shared = {"files": values["shared"]["files"], "unused": tuple(values["shared"]["unused"])}
    own = (dict(_person().model_validate_json(text)) for text in values["people"])
    return Answer([Delivered(**one, **shared, sweeps=sweeps[n]) for n, one in enumerate(own)], values["said"])


def read_apart(
    path: Path,
    layout: Layout,
    subject: str,
    limits: ReadingLimits,
    also: Sequence[str | Path] = (),
    *,
    look: bool = False,
) -> Answer:
    """The people whose trials a file holds, read by a process of its own; or, to `look` into it, what is said of it."""
    is_table = formats.format_of(path).is_table
    seconds = seconds_for(limits, path, table=is_table)
    request = {"path": str(path), "layout": asdict(layout), "subject": subject, "limits": asdict(limits),
               "also": [str(other) for other in also], "look": look}  # fmt: skip
    rows = path.stat().st_size // _BYTES_A_ROW if is_table else 0
    most_s = _START_S + _WAITS * seconds_for(limits, path, table=is_table, rows=rows)
    with tempfile.TemporaryDirectory(prefix="isiw-") as folder:
        status = _run({**request, "answer": folder}, most_s)
        found = read_answer(Path(folder)) if status == 0 else {}
    if isinstance(found, Answer):
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
    try:
        return subprocess.run(  # noqa: S603 - this Python, and words that are isiw's own
            [sys.executable, "-P", "-c", _CHILD, json.dumps([place for place in sys.path if place])],
            input=json.dumps(request).encode(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **_ONE_THREAD},
            timeout=most_s,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired:
        return None
