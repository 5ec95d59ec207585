"""Files of MATLAB: vectors that are the columns of a table, and sweeps that are the rows or columns of a matrix."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing import frames, quantities
from isiw.existing.formats import columns
from isiw.existing.formats.contents import Contents, Track, events_of, parted
from isiw.existing.layout import EMG_UNITS, WORDS, Layout, letters
from isiw.lazy import pd


def read(path: Path, layout: Layout) -> Contents:
    """A table of vectors, a recording in vectors, or sweeps beside a vector of their ISIs."""
    source, name = path.name, layout.channels.get("emg")
    arrays = frames.read_arrays(path)
    if {"data", "datastart", "dataend", "titles"} <= arrays.keys():
        return _of_labchart(arrays, source)
    if name is None:
        return columns.read(path, layout)
    quantities.require_one("array", source, name, arrays)
    rate_hz = columns.required(layout, "rate_hz", f"the sampling rate of {source}")
    for other, array in arrays.items():
        number, word = (
            float(array.item()) if array.size == 1 and array.dtype.kind in "fiu" else 0.0,
            letters(other.rpartition(".")[2]),
        )
        if number and word in WORDS["rates"]:
            columns.require_rate(rate_hz, number, f"{other!r} of {source}")
        if number > 0 and word in WORDS["periods"]:
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
    said = "".join([name, *(f" ({unit})" for unit in quantities.units_beside("emg", name, beside).values())])
    flat = (sweeps if sweeps.shape[0] == count else sweeps.T).ravel()
    stretches = parted(range(0, flat.size, flat.size // count), flat.size, rate_hz)
    track = Track.of_values(name, rate_hz, stretches, flat, quantities.unit_said(said, EMG_UNITS) or "")
    return Contents(source, (track,), trials=beside, pulse_at_s=pulse_at_ms / 1e3)


def _of_labchart(arrays: Mapping[str, np.ndarray], source: str) -> Contents:
    """The channels and comments that LabChart exports: all samples in a row, those of each channel block by block."""
    titles = [str(title).strip() for title in np.atleast_1d(arrays["titles"])]
    usual = {"scaleunits": 1.0, "scaleoffset": 0.0}  # of whole numbers
    begins, ends, rates, of_units, scales, offsets = (
        np.broadcast_to(np.asarray(arrays.get(name, usual.get(name)), np.float64), arrays["datastart"].shape).reshape(
            len(titles), -1
        )
        for name in ("datastart", "dataend", "samplerate", "unittextmap", *usual)
    )
    units, tracks = ["", *map(str, np.atleast_1d(arrays["unittext"]))], []
    for n, title in enumerate(titles):
        spans = zip(begins[n].astype(int), ends[n].astype(int), offsets[n], scales[n], strict=True)  # -1 of none
        parts = [(arrays["data"].ravel()[max(a - 1, 0) : max(b, 0)] + offset) * scale for a, b, offset, scale in spans]
        cuts = np.cumsum([*map(len, parts)]).tolist()
        unit = units[max(int(of_units[n, 0]), 0)].strip()
        tracks.append(
            Track.of_values(title, rates[n, 0], parted(cuts, cuts[-1], rates[n, 0]), np.concatenate(parts), unit)
        )
    texts, ticks_hz, blocks = (
        np.atleast_1d(arrays.get("comtext", ())),
        np.ravel(arrays["tickrate"]),
        tracks[0].stretches,
    )
    rows = [(str(texts[int(text) - 1]).strip(), blocks[int(n) - 1].start_s + at / ticks_hz[int(n) - 1], 0.0)
            for _, n, at, _, text in np.reshape(arrays.get("com", ()), (-1, 5))]  # fmt: skip
    return Contents(source, tuple(tracks), events_of(rows))


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
