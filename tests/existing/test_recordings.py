"""Recordings that other programs' libraries write are read back to what was put into them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isiw
from existing.writers import ISIS_MS, KNOWN, NAMES, as_brainvision, as_edf, epochs, raw, require_as_written
from isiw.errors import IsiwError
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people


def test_a_comma_that_is_not_coded_in_a_comment_of_brainvision_is_said_with_its_line(tmp_path: Path) -> None:
    path = as_brainvision(tmp_path)
    markers = path.with_suffix(".vmrk")
    whole = markers.read_text()
    for text in ("coil moved, pair repeated", "again, 5", "one, two, three"):
        markers.write_text(f"{whole}Mk99=Comment,{text},500,1,0\n")
        with pytest.raises(IsiwError, match=rf"comma .* of a marker in P01\.vmrk.*Mk99=Comment,{text}.*\\1"):
            read_people(path, KNOWN)
    markers.write_text(
        f"{whole}Mk99=Comment,coil moved\\1 again,500,1,0\nMk100=New Segment,,1,1,0,20131113161403794232\n"
    )
    (person,) = read_people(path, KNOWN)
    require_as_written(person)


@pytest.mark.parametrize("date", [None, 1_700_000_000])
def test_a_recording_that_was_cropped_is_read_as_the_whole_one(date: int | None, tmp_path: Path) -> None:
    made = raw()
    made.set_meas_date(date)
    made.crop(0.5, None).save(tmp_path / "P01_raw.fif.gz")
    for source in (made, tmp_path / "P01_raw.fif.gz"):
        (person,) = read_people(source, KNOWN)
        require_as_written(person)


def test_the_metadata_of_epochs_say_units_and_tms_alone() -> None:
    for cells in ({"ISI (s)": [isi / 1e3 for isi in (*ISIS_MS, np.nan)]}, {"isi_ms": [*map(str, ISIS_MS), "TMS"]}):
        made = epochs(cells)
        require_as_written(read_people(made, KNOWN)[0])
    made.metadata = None
    (person,) = read_people(made, KNOWN)  # the annotations within them say when the stimuli came
    require_as_written(person)
    made.set_annotations(None)
    with pytest.raises(IsiwError, match="isi_ms in their metadata"):
        read_people(made, KNOWN)


def test_what_was_recorded_is_in_the_log_and_in_what_is_exported_and_read_again(tmp_path: Path) -> None:
    (person,) = read_people(as_edf(tmp_path), KNOWN)
    space = isiw.DesignSpace(20, 130, reference="impact")
    log = isiw.existing.analysed(person, isiw.make_strategy(space=space, particles=50)).to_log(tmp_path / "P01.mcap")
    assert len(isiw.read_session(log).waveforms) == 6
    isiw.export.export_logs(log, tmp_path / "bids", "bids")
    (file,) = (tmp_path / "bids").rglob("*_emg.bdf")
    (again,) = read_people(file, Layout(reference="impact"))
    require_as_written(again)


BROKEN: dict[str, tuple[dict[str, Any], str]] = {
    "no reference": ({"reference": None}, "--reference"),
    "no marker": ({"markers": {}}, "--marker pulse=NAME --marker tap=NAME"),
    "no marker of the pulse": ({"markers": {"tap": "S  1"}}, "--marker pulse=NAME"),
    "no marker of the tap": ({"markers": {"pulse": "S  2"}}, "--marker tap=NAME"),
    "a marker that is not there": ({"markers": {"pulse": "S 99"}}, "no event of this name"),
    "one marker for both": ({"markers": {"tap": "S 2", "pulse": "S2"}}, "cannot mark both"),
    "markers swapped": ({"markers": {"tap": "S 2", "pulse": "S 1"}}, "which marker is of the tap"),
    "a channel that is not there": ({"channels": {"emg": "FDI"}}, "no such channel"),
    "no valve": ({"reference": "valve"}, "--marker valve=NAME"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_a_recording_does_not_tell_is_asked_for_by_name(kind: str) -> None:
    said, expected = BROKEN[kind]
    layout = Layout(**{"reference": "impact", "markers": NAMES, "channels": {"emg": "FCR"}, **said})
    with pytest.raises(IsiwError, match=expected) as refused:
        read_people(raw(), layout)
    assert "\n" not in str(refused.value)


def test_several_channels_of_one_kind_are_asked_about() -> None:
    made = raw(kind="eeg")
    made.rename_channels({"FCR": "one"})
    with pytest.raises(IsiwError, match='--channel "emg='):
        read_people(made, Layout(reference="impact", markers=NAMES))


def test_a_clipped_recording_does_not_count() -> None:
    made = raw()
    made.apply_function(lambda values: np.clip(values, -1e-4, 1e-4), picks="all")
    with pytest.raises(IsiwError, match="saturation"):
        read_people(made, KNOWN)


def test_a_unit_that_the_file_does_not_say_is_asked_for(tmp_path: Path) -> None:
    path = as_edf(tmp_path, "", 1e3)
    with pytest.raises(IsiwError, match="--unit"):
        read_people(path, KNOWN)
    (person,) = read_people(path, KNOWN.saying(units=("uV",)))
    require_as_written(person)
