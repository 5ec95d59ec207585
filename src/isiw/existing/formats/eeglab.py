"""EEGLAB's files (.set, with or without .fdt): continuous ones with their boundaries, and epochs with their events."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.formats.columns import require_rate
from isiw.existing.formats.contents import Contents, Track, events_of, part_of, parted, text_of, timed
from isiw.existing.layout import EMG_UNITS, Layout
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.types import FloatArray

_ASSUMED: Final = "Files of EEGLAB say no unit, and µV are usual. If another is right, say --unit mV or --unit V."


def read(path: Path, layout: Layout) -> Contents:
    """The channels and events of an EEGLAB file."""
    found = library("pymatreader", "import").read_mat(str(path))
    eeg = found.get("EEG", found)
    if not {"data", "srate", "nbchan", "pnts"} <= eeg.keys():
        raise InvalidValueError("the file has no data of EEGLAB", got=", ".join(list(eeg)[:9]))
    rate_hz, samples, trials = float(eeg["srate"]), int(eeg["pnts"]), int(eeg.get("trials") or 1)
    times_ms = np.ravel(eeg.get("times", ()))
    if times_ms.size > 1 and times_ms.dtype.kind == "f":
        found_hz = 1e3 * (times_ms.size - 1) / float(times_ms[-1] - times_ms[0])
        require_rate(rate_hz, found_hz, f"EEG.times of {path.name}", "Correct EEG.srate or EEG.times, and save again.")
    noted = [(text_of(one.get("type")), float(one["latency"]) - 1.0, _number(one.get("duration")) / rate_hz)
             for one in _listed(eeg.get("event")) if not _empty(one.get("latency"))]  # fmt: skip
    pauses = {math.ceil(at): lasts_s for name, at, lasts_s in noted if name == "boundary"} if trials == 1 else {}
    cuts: Iterable[int] = range(samples, trials * samples, samples) if trials > 1 else pauses
    stretches = parted(cuts, trials * samples, rate_hz, pauses)
    tracks, count, data, places = [], int(eeg["nbchan"]), eeg["data"], _listed(eeg.get("chanlocs"))
    whole = None if isinstance(data, str) else np.reshape(data, (count, -1), order="F")
    for n in range(count):
        place = places[n] if n < len(places) else {}
        kind = place["type"].casefold() if isinstance(place.get("type"), str) else ""
        part = partial(_beside, path, data, count, n) if whole is None else partial(part_of, whole[n])
        tracks.append(Track(str(place.get("labels") or f"channel {n + 1}"), rate_hz, stretches, part, "uV", kind))
    bad = [("BAD epoch", n * samples, samples / rate_hz) for n in _rejected(eeg.get("reject"), trials)]
    events = events_of(timed((one for one in (*noted, *bad) if one[0] != "boundary"), stretches, rate_hz))
    notes = () if layout.unit_of(EMG_UNITS) else (_ASSUMED,)
    return Contents(path.name, tuple(tracks), events, unit_is_usual=True, notes=notes).with_bids(path)


def _rejected(reject: Any, trials: int) -> list[int]:
    """The epochs that EEGLAB has marked, and not removed yet."""
    fields = reject.items() if isinstance(reject, Mapping) else ()
    marks = [np.ravel(value) for key, value in fields if str(key).startswith("rej") and np.size(value) == trials > 1]
    marked = [np.flatnonzero(np.nan_to_num(mark)) for mark in marks if mark.dtype.kind in "biuf"]
    return sorted({n for each in marked for n in each.tolist()})


def _beside(path: Path, name: str, count: int, channel: int, first: int, last: int) -> FloatArray:
    """Numbers of a channel, of so many, in the file beside this one."""
    beside = path.with_name(Path(name.replace("\\", "/")).name)  # a folder of another computer is not meant
    with opened(beside if beside.exists() else path.parent / name) as file:
        file.seek(4 * count * first)
        whole = np.frombuffer(file.read(4 * count * (last - first)), "<f4")
    return whole[channel::count].astype(np.float64)


def _listed(value: Any) -> list[Mapping[str, Any]]:
    """Structures one by one: a list of them, one alone, or a structure whose fields are lists."""
    if isinstance(value, Mapping):
        lists = {key: each for key, each in value.items() if isinstance(each, list | np.ndarray)}
        longest = max(map(len, lists.values()), default=0)
        if not lists or any(len(each) != longest for each in lists.values()) or len(lists) < len(value):
            return [value]
        return [{key: each[n] for key, each in lists.items()} for n in range(longest)]
    return [one for one in value if isinstance(one, Mapping)] if isinstance(value, list | np.ndarray) else []


def _empty(value: Any) -> bool:
    return value is None or np.size(value) == 0


def _number(value: Any) -> float:
    return 0.0 if _empty(value) or isinstance(value, str) or not math.isfinite(float(value)) else float(value)
