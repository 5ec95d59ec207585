"""What the process that reads hands back: trials and settings as JSON, samples as plain numbers, errors in words.

Nothing of it can be code: a reader of another library may have been led astray by the file that it reads.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
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
    """The fields of `Delivered` but for its waveforms."""
    hints = get_type_hints(Delivered)
    known: dict[str, Any] = {one.name: (hints[one.name], ...) for one in fields(Delivered) if one.name != "sweeps"}
    return create_model("Person", __config__=ConfigDict(ser_json_inf_nan="strings"), **known)


class Answer(NamedTuple):
    """The people that were read, and what is said of a file that was looked into."""

    people: list[Delivered]
    said: Mapping[str, Any]


def write_answer(folder: Path, found: Answer, hashes: Mapping[str, str]) -> None:
    """Write what was read into a folder."""
    written, channels, unused = [], [], dict[tuple[str, ...], int]()
    with (folder / SAMPLES).open("wb") as samples:
        for number, person in enumerate(found.people):
            for trial, sweep in person.sweeps.items():
                for name, channel in sweep.items():
                    np.ascontiguousarray(channel.values, dtype="<f8").tofile(samples)
                    channels.append([number, trial, name, len(channel.values), channel.rate_hz, channel.unit,
                                     channel.t0_ms])  # fmt: skip
            own = _person().model_construct(**{**vars(person), "files": hashes, "unused": ()}).model_dump_json()
            written.append([own, unused.setdefault(person.unused, len(unused))])  # everybody of a table has the same
    _write(folder, {"people": written, "unused": [*unused], "channels": channels, "said": found.said})


def write_error(folder: Path, error: BaseException) -> None:
    """Write why nothing could be read into a folder."""
    if isinstance(error, IsiwError):
        kind = next((name for name, known in _KINDS.items() if isinstance(error, known)), "InvalidValueError")
        got = None if error.got is None else errors.shortened(error.got)
        said = {"what": error.what, "got": got, "expected": error.expected, "remedy": error.remedy}
        _write(folder, {"error": kind, "said": said})
    elif isinstance(error, OSError):
        name = None if error.filename is None else str(error.filename)
        _write(folder, {"system": [error.errno, error.strerror or str(error), name]})
    else:
        _write(folder, {"fault": errors.error_text(error), "memory": isinstance(error, MemoryError)})


def _write(folder: Path, values: Mapping[str, Any]) -> None:
    (folder / ANSWER).write_text(json.dumps(values), encoding="ascii")


def read_answer(folder: Path) -> Answer | Mapping[str, Any]:
    """What was read, or what failed in a way that isiw has no words for; an error in words is raised."""
    values = json.loads((folder / ANSWER).read_text(encoding="ascii"))
    if "error" in values:
        said = values["said"]
        said["got"] = None if said["got"] is None else _Shown(said["got"])
        raise _KINDS[values["error"]](said.pop("what"), **said)
    if "system" in values:
        raise OSError(*values["system"])
    if "people" not in values:
        return dict(values)
    unused = [tuple(names) for names in values["unused"]]
    people = [
        Delivered(**{**dict(_person().model_validate_json(text)), "unused": unused[which]})
        for text, which in values["people"]
    ]
    return Answer(_with_samples(folder / SAMPLES, people, values["channels"]), values["said"])


def _with_samples(path: Path, people: Sequence[Delivered], channels: Sequence[Any]) -> list[Delivered]:
    samples = np.fromfile(path, dtype="<f8")
    sweeps: list[dict[int, dict[str, Channel]]] = [{} for _ in people]
    ends = np.cumsum([length for _, _, _, length, *_ in channels])
    for (person, trial, name, length, rate_hz, unit, t0_ms), end in zip(channels, ends.tolist(), strict=True):
        channel = Channel(samples[end - length : end], rate_hz, unit, t0_ms)
        sweeps[person].setdefault(trial, {})[name] = channel
    return [replace(person, sweeps=theirs) for person, theirs in zip(people, sweeps, strict=True)]
