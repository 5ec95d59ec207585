"""What the operator states is used or refused, whatever kind of file it is stated of."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.io

import isiw
from existing.test_waves import EMG_MV, lines, trigger
from existing.writers import ISIS_MS, KNOWN, MEPS_MV, NAMES, as_brainvision, as_edf, as_epochs, epochs, raw
from isiw.errors import IsiwError
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

IMPACT = Layout(reference="impact")
TABLE = pd.DataFrame({"isi_ms": [str(isi) for isi in ISIS_MS], "mep_mv": MEPS_MV, "muscle": ["FCR"] * 4 + ["FDI"]})
IN_COLUMNS = IMPACT.saying(rate_hz=4000.0, channels={"emg": "EMG", "tap": "Hammer", "pulse": "TMS"}, unmarked="alone",
                           units=("mV",))  # fmt: skip


def _text(folder: Path) -> Path:
    TABLE.to_csv(folder / "P01.csv", index=False)
    return folder / "P01.csv"


def _workbook(folder: Path) -> Path:
    TABLE.to_excel(folder / "P01.xlsx", index=False)
    return folder / "P01.xlsx"


def _samples(folder: Path) -> Path:
    head = "Time\tEMG\tHammer\tTMS\n"
    (folder / "P01.txt").write_text(head + lines(EMG_MV, trigger("tap"), trigger("pulse"), first=24_000))
    return folder / "P01.txt"


def _matlab(folder: Path) -> Path:
    sweeps = np.asarray(epochs().get_data(picks=[0], verbose="ERROR"))[:5, 0]
    scipy.io.savemat(folder / "P01.mat", {"emg": 1e3 * sweeps, "isi_ms": ISIS_MS})
    return folder / "P01.mat"


def _log(folder: Path) -> Path:
    space = isiw.DesignSpace(20, 130, reference="impact")
    (person,) = read_people(TABLE, IMPACT)
    return isiw.existing.analysed(person, isiw.make_strategy("nr", space=space)).to_log(folder / "P01.mcap")


SOURCES: dict[str, tuple[Any, Layout]] = {
    "text": (_text, IMPACT),
    "workbook": (_workbook, IMPACT),
    "data frame": (lambda _: TABLE, IMPACT),
    "samples in text": (_samples, IN_COLUMNS),
    "sweeps of MATLAB": (_matlab, IMPACT.saying(rate_hz=4000.0, pulse_at_ms=300.0, channels={"emg": "emg"},
                                                units=("mV",))),
    "EDF": (as_edf, KNOWN),
    "BrainVision": (as_brainvision, KNOWN),
    "epochs": (as_epochs, KNOWN),
    "Raw": (lambda _: raw(), KNOWN),
    "log": (_log, IMPACT),
}  # fmt: skip
QUICK = {"text", "data frame", "EDF", "epochs"}
ODD: dict[str, Any] = {
    "reference": "valve", "columns": {"isi": "elsewhere"}, "where": {"muscle": "FCR"}, "units": ("nV",),
    "alone": "30.0",
    "decimal": ",", "separator": "|", "skip_lines": 3, "names": ("one", "two"), "sheet": "elsewhere",
    "markers": {"pulse": "elsewhere"}, "unmarked": "lost", "channels": {"emg": "elsewhere"}, "rate_hz": 9.0,
    "pulse_at_ms": 9.0, "longest_isi_ms": 9.0, "mep_window_ms": (60.0, 90.0),
}  # fmt: skip
VACUOUS = {("sweeps of MATLAB", "decimal"), ("epochs", "decimal")}  # which is of texts, and their numbers are none
KEYS: dict[str, dict[str, Any]] = {
    "units of ISIs": {"units": ("s",)},
    "a column": {"columns": {"date": "elsewhere"}},
    "a channel of texts": {"channels": {"events": "elsewhere"}},
    "a channel of triggers": {"channels": {"valve": "elsewhere"}},
}


def outcome(source: Any, layout: Layout, **stated: Any) -> str:
    try:
        (person,) = read_people(source, replace(layout, **stated))
    except IsiwError as error:
        return f"{error}"
    return f"{person.reference} {[*person.trials]}"


@pytest.mark.parametrize(
    "kind", [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in SOURCES]
)
def test_no_option_leaves_what_is_read_as_it_would_be_without(kind: str, tmp_path: Path) -> None:
    write, layout = SOURCES[kind]
    source = write(tmp_path)
    before = outcome(source, layout)
    assert "isi_ms=" in before
    assert {*ODD} == {one.name for one in fields(Layout)}
    for stated in ({name: odd} for name, odd in ODD.items() if (kind, name) not in VACUOUS):
        assert outcome(source, layout, **stated) != before, stated
    if kind in {"text", "log"}:
        for name, odd in (("channels", {"tap": "muscle"}), ("unmarked", "lost")):
            assert f"has no use for {name}" in outcome(source, layout, **{name: odd})
    for what, said in KEYS.items():
        assert outcome(source, layout.saying(**said)) != before, what


def test_one_thing_is_stated_once() -> None:
    with pytest.raises(IsiwError, match="two units"):
        Layout(units=("mV", "uV"))
    with pytest.raises(IsiwError, match="both a marker and a channel"):
        Layout(markers=NAMES, channels={"tap": "Hammer"})
    with pytest.raises(IsiwError, match="one channel is stated for two things"):
        Layout(channels={"tap": "TMS", "pulse": "TMS"})
    assert Layout(units=("mV", "s")).saying(units=("uV",)).units == ("uV", "s")
