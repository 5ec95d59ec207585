"""Files of MATLAB: vectors that are the columns of a table, and sweeps that are the rows or columns of a matrix."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing import frames, quantities
from isiw.existing.formats import columns
from isiw.existing.formats.contents import Contents, Track, parted
from isiw.existing.layout import WORDS, Layout, letters
from isiw.existing.names import ALL
from isiw.lazy import pd


def read(path: Path, layout: Layout) -> Contents:
    """A table of vectors, a recording in vectors, or sweeps beside a vector of their ISIs."""
    source, name, arrays = path.name, layout.channels.get("emg"), frames.read_arrays(path)
    numbers = {other: array.item() for other, array in arrays.items() if array.size == 1 and array.dtype.kind in "fiu"}
    _require_no_factor(arrays, numbers, layout, source)
    if name is None:
        return columns.read(path, layout)
    quantities.require_one("array", source, name, arrays)
    rate_hz = columns.required(layout, "rate_hz", f"the sampling rate of {source}")
    for other, number in numbers.items():
        if number > 0 and (word := letters(other.split(".")[-1])) in WORDS["rates"]:
            columns.require_rate(rate_hz, number, f"{other!r} of {source}")
        elif number > 0 and word in WORDS["periods"]:
            columns.require_period(rate_hz, number, None, f"{other!r} of {source}")
    if arrays[name].squeeze().ndim < 2:
        return columns.read(path, layout)
    pulse_at_ms = columns.required(layout, "pulse_at_ms", f"the time of the pulse in a sweep of {source}")
    beside, sweeps = frames.of_vectors(arrays, layout), np.asarray(arrays[name], dtype=np.float64)
    if sweeps.ndim != 2 or (count := len(beside)) not in sweeps.shape:
        what = f"the sweeps of {source} are not as many as its ISIs, in a matrix"
        got = f"{' × '.join(map(str, sweeps.shape))} samples and {len(beside)} ISIs"
        raise InvalidValueError(what, got=got, remedy="Save a row or a column for each ISI.")
    for other, array in arrays.items():
        if array.size == sweeps.size // count != count:
            _require_zero(other, array.ravel(), rate_hz, pulse_at_ms, source)
    flat = (sweeps if sweeps.shape[0] == count else sweeps.T).ravel()
    stretches = parted(range(0, flat.size, flat.size // count), flat.size, rate_hz)
    track = Track.of_values(name, rate_hz, stretches, flat, quantities.unit_of(name, beside))
    track = replace(track, said=columns.of_emg(beside.attrs["title"]))
    return Contents(source, (track,), trials=beside, pulse_at_s=pulse_at_ms / 1e3)


def _require_no_factor(arrays: Mapping[str, Any], numbers: Mapping[str, float], layout: Layout, source: str) -> None:
    """Raise if a number beside amplitudes or EMG is a gain, or beside whole numbers of samples what scales them."""
    name = layout.channels.get("emg", "")
    are_steps = name in arrays and arrays[name].dtype.kind in "iu"
    for other, number in numbers.items():
        words = {*re.findall(r"[^\W\d_]+", other.casefold())} & WORDS["gains"]
        if not words or number in {0, 1} or not (are_steps or "gain" in words) or {*arrays} & layout.where.keys():
            continue
        what = f"{other!r} of {source} says a factor, and nothing is read of it"
        remedy = (
            "Save the numbers times it, or divided by it, and without it; if they are those at the electrodes already, "
        )
        remedy += f'say --where "{name or "NAME"}={ALL}"{"" if name else " with the name of the amplitudes"}.'
        raise InvalidValueError(what, got=f"{number:g}", remedy=remedy)


def _require_zero(name: str, times: Any, rate_hz: float, pulse_at_ms: float, source: str) -> None:
    """Raise if times of a sweep's samples say another rate than the layout, or are 0 elsewhere than at the pulse."""
    if (clock := columns.clock_of(pd.Series(times), name, rate_hz)) is None:
        return
    columns.require_rate(rate_hz, clock[0], f"{name!r} of {source}")
    zero_ms = 1e3 / clock[0] * -times[0] * (len(times) - 1) / (times[-1] - times[0])
    if zero_ms > 0 and abs(zero_ms - pulse_at_ms) > 1.5e3 / rate_hz:
        what = f"the pulse does not come where {name!r} of {source} is 0"
        remedy = "Correct pulse_at_ms in the layout; if it is right, leave that vector out of the file."
        expected = f"{zero_ms:g} ms after the first sample"
        raise InvalidValueError(what, got=f"{pulse_at_ms:g} ms", expected=expected, remedy=remedy)
