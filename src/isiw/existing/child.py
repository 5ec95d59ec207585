"""The process that reads one file: it takes a request, limits itself, reads, and writes an answer."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from isiw.errors import ConfigError
from isiw.existing import answer, formats
from isiw.existing.gate import Gate, require_no_links
from isiw.existing.layout import Layout
from isiw.existing.limits import ReadingLimits, limit_memory, limit_time, seconds_for
from isiw.existing.look import seen_in
from isiw.existing.reading import contents_in, people_of_contents
from isiw.lazy import pd
from isiw.text.named_code import library
from isiw.text.toml_files import checked


def main() -> None:
    """Answer the request that stands at the standard input."""
    request = json.loads(sys.stdin.buffer.read())
    folder = Path(request["answer"])
    try:
        _answer(request, folder)
    except BaseException as error:  # noqa: BLE001 - whatever a library fails with is the answer
        answer.write_error(folder, error)


def _answer(request: Mapping[str, Any], folder: Path) -> None:
    path, limits = Path(request["path"]), ReadingLimits(**request["limits"])
    layout = checked(Layout, request["layout"], "the layout")
    own = _load_libraries(path)
    csv.field_size_limit(2**31 - 1)  # a cell that is too long is refused in words later
    limit_memory(limits.memory_mb)
    limit_time(seconds_for(limits, path, table=formats.format_of(path).is_table))
    gate = Gate(path, [Path(other) for other in request["also"]], own)
    sys.addaudithook(gate)
    try:
        require_no_links(path)
        contents = contents_in(path, layout, limits)
        if contents.trials is not None:  # for so many rows, of which trials are made, there is more time
            limit_time(seconds_for(limits, path, table=True, rows=len(contents.trials)))
        if request["look"]:
            found = seen_in(contents, path, layout, limits)
        else:
            found = answer.Answer(people_of_contents(contents, path, layout, request["subject"], limits), {})
    finally:
        gate.require_nothing_refused()
    answer.write_answer(folder, found, gate.hashes())


def _load_libraries(path: Path) -> list[Path]:
    """Load what takes long to load before the time of reading begins; the files of settings that it reads later on."""
    pd.DataFrame  # noqa: B018 - which loads pandas
    needed = formats.format_of(path).library
    if needed == "mne":
        mne = library("mne", "import")
        mne.io.read_raw  # noqa: B018 - which loads its readers
        return [Path(mne.get_config_path())]
    if needed:
        with suppress(ConfigError):  # whoever reads the file says it
            library(needed, "import")
    return []
