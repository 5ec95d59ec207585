"""Files of MATLAB: vectors that are the columns of a table, and sweeps that are the rows or columns of a matrix."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing import frames, quantities
from isiw.existing.formats import columns
from isiw.existing.formats.contents import Contents, Track, parted
from isiw.existing.layout import COLUMNS, WORDS, Layout, letters
from isiw.existing.names import ALL, key_of_flags, words_of
from isiw.lazy import pd, scipy
from isiw.text.named_code import library

_OF_TRIALS: Final = re.compile(r"^(?!n\b|num|count).*(trial|sweep|frame|idx|ind(ex|ices))")  # that may be one's number


def read(path: Path, layout: Layout) -> Contents:
    """A table of vectors, a recording in vectors, or sweeps beside a vector of their ISIs."""
    source, name, arrays = path.name, layout.channels.get("emg"), _arrays(path)
    numbers = {other: array.item() for other, array in arrays.items() if array.size == 1 and array.dtype.kind in "fiu"}
    _require_no_factor(arrays, numbers, layout, source)
    if name is None:
        return columns.of_frame(_vectors(arrays, layout), source, layout)
    quantities.require_one("array", source, name, arrays)
    rate_hz = columns.required(layout, "rate_hz", f"the sampling rate of {source}")
    for other, number in numbers.items():
        if number > 0 and (word := letters(other.split(".")[-1])) in WORDS["rates"]:
            columns.require_rate(rate_hz, number, f"{other!r} of {source}")
        elif number > 0 and word in WORDS["periods"]:
            columns.require_period(rate_hz, number, None, f"{other!r} of {source}")
    if arrays[name].squeeze().ndim < 2:
        return columns.of_frame(_vectors(arrays, layout), source, layout)
    pulse_at_ms = columns.required(layout, "pulse_at_ms", f"the time of the pulse in a sweep of {source}")
    beside, sweeps = _vectors(arrays, layout), np.asarray(arrays[name], dtype=np.float64)
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
        remedy = "Save the numbers times it, or divided by it, and without it; if they are those at the electrodes, "
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


def _arrays(path: Path) -> dict[str, Any]:
    """The arrays in a file of MATLAB by name, those in structures among them."""
    content = frames.content_of(path)
    if content.startswith(b"MATLAB 7.3"):
        values = library("pymatreader", "import").read_mat(str(path))
    else:
        values = scipy.io.loadmat(cast("Any", io.BytesIO(content)), simplify_cells=True)
    if {"data", "datastart", "dataend", "titles"} <= values.keys():
        remedy = "In LabChart: File, Export, LabChart text (.txt), and a layout: docs/your-data.md."
        raise InvalidValueError("this has LabChart's channels one behind the other", got="data", remedy=remedy)
    paths = dict(_flat({name: value for name, value in values.items() if not name.startswith("__")}))
    last = Counter(path[-1] for path in paths)
    return {path[-1] if last[path[-1]] == 1 else ".".join(path): array for path, array in paths.items()}


def _flat(values: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """The arrays in structures by their path; of a structure for each trial, the values of each of its fields."""
    for name, value in values.items():
        each = list(value) if isinstance(value, list) or (isinstance(value, np.ndarray) and value.ndim == 1) else []
        inner = value if isinstance(value, dict) else {}
        if each and all(isinstance(one, dict) for one in each):
            held = {key: [one.get(key, np.nan) for one in each] for key in each[0]}
            inner = {key: [one if np.size(one) else np.nan for one in values] for key, values in held.items()}
        yield from (((name, *path), array) for path, array in _flat(inner))
        if not inner:
            yield (name,), np.asarray(value)


def _vectors(arrays: Mapping[str, Any], layout: Layout) -> pd.DataFrame:
    """The vectors in a file of MATLAB that are as long as that of the ISIs, or the longest, as columns of a table."""
    squeezed = {name: array.squeeze() if array.size > 1 else array for name, array in arrays.items()}
    squeezed |= {
        name: np.array([one if np.size(one) else "" for one in array], dtype=object)  # of empty cells
        for name, array in squeezed.items()
        if array.ndim == 1 and any(isinstance(one, str) for one in array)
    }
    vectors = {name: array for name, array in squeezed.items()  # but not a cell's arrays, such as one for each ISI
               if array.ndim == 1 and not any(isinstance(one, np.ndarray) for one in array)}  # fmt: skip
    texts = {name: str(array.item()) for name, array in arrays.items() if array.size == 1 and array.dtype.kind in "UO"}
    of_isis = {name for name in vectors if name == layout.columns.get("isi") or letters(name) in COLUMNS["isi"]}
    longest = max((len(vectors[name]) for name in of_isis or vectors), default=0)
    if longest == 0:
        what = "the file has no vectors that could be the columns of a table"
        remedy = "Save vectors: save('P01.mat', 'isi_ms', 'mep_mv', '-v7')."
        raise InvalidValueError(what, got=", ".join(arrays) or "nothing that can be read", remedy=remedy)
    single = {name: array.ravel() for name, array in arrays.items() if array.size == 1}
    alone = {name: array for name, array in single.items() if _OF_TRIALS.search(words_of(name))}
    for name, vector in {**vectors, **alone}.items():
        is_longer = np.any(vector > (name not in alone)) if vector.dtype.kind in "iuf" else False
        if len(vector) != longest and is_longer and key_of_flags(name):
            what = f"the vector {name!r} is not as long as that of the ISIs, as if it had the numbers of some trials"
            remedy = "Save one in its place that has for each trial 1 if it does not count, and 0 if it does: exclude."
            raise InvalidValueError(what, got=vector.tolist()[:5], remedy=remedy)
    units = {name: text for name, text in texts.items() if letters(name).endswith(("unit", "units"))}
    table = pd.DataFrame({**{name: vector for name, vector in vectors.items() if len(vector) == longest}, **units})
    table.attrs["title"] = "\n".join(text for name, text in texts.items() if name not in units)
    return table
