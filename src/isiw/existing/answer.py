"""What the process that reads hands back: JSON and plain numbers, and nothing that could be code."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, create_model

from isiw import errors
from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.sweeps import Channel

ANSWER: Final = "answer.json"
SAMPLES: Final = "samples.f8"

_KINDS: Final[Mapping[str, type[IsiwError]]] = {
    kind.__name__: kind for kind in (errors.InvalidValueError, errors.ConfigError, errors.LogError)
}


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
    _write(folder, {"people": people, "shared": shared, "channels": channels, "said": found.said})


def write_error(folder: Path, error: BaseException) -> None:
    """Write why nothing could be read into a folder."""
    if isinstance(error, IsiwError):
        got = None if error.got is None else errors.shortened(error.got)
        said = {"what": error.what, "got": got, "expected": error.expected, "remedy": error.remedy}
        _write(folder, {"error": type(error).__name__, "said": said})
    elif isinstance(error, OSError):
        name = None if error.filename is None else str(error.filename)
        _write(folder, {"system": [error.errno, error.strerror or str(error), name]})
    else:
        _write(folder, {"fault": errors.error_text(error), "memory": isinstance(error, MemoryError)})


def _write(folder: Path, values: Mapping[str, Any]) -> None:
    (folder / ANSWER).write_text(json.dumps(values), encoding="ascii")


def read_answer(folder: Path) -> Answer | dict[str, Any]:
    """What was read, or what failed in a way that isiw has no words for; an error in words is raised."""
    values: dict[str, Any] = json.loads((folder / ANSWER).read_text(encoding="ascii"))
    if "error" in values:
        said = values["said"]
        said["got"] = None if said["got"] is None else _Shown(said["got"])
        raise _KINDS.get(values["error"], errors.InvalidValueError)(said.pop("what"), **said)
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
