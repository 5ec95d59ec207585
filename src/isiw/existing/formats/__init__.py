"""The formats of files that can be read: a row each, with the module that yields what such a file holds."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from isiw.errors import ConfigError, InvalidValueError
from isiw.existing.formats import acq, columns, edf, eeglab, installed, matlab, mne_files, nwb, smr, statistics, xdf
from isiw.existing.formats.contents import Contents
from isiw.existing.frames import TEXTS, WORKBOOKS
from isiw.existing.layout import Layout


class Format(NamedTuple):
    """A format: what files of it are called, how and by which library, and the shortest way in if one cannot be."""

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, Layout], Contents]
    way_in: str
    library: str = ""
    is_table: bool = False
    options: tuple[str, ...] = ()  # what of a layout is of such files alone


_TABLE: Final = "Save it as CSV, with the columns' names in the first line."
_EEGLAB: Final = "In EEGLAB: File, Save current dataset as; its .fdt stays beside it."
_BRAINVISION: Final = "Are the .eeg and .vmrk beside it, under the names that it says?"
_MNE: Final = "Are all of its files in one folder? Otherwise export it as EDF+ or BrainVision."
_XDF: Final = "Record again with LabRecorder, or save the streams as EDF+."
_ACQ: Final = "In AcqKnowledge: File, Save As, text (.txt) or MATLAB (.mat), and a layout."

FORMATS: Final = (
    Format("text", TEXTS, columns.read, _TABLE, is_table=True, options=("skip_lines", "names", "separator")),
    Format(
        "Excel", WORKBOOKS, columns.read, _TABLE, "openpyxl", is_table=True, options=("skip_lines", "names", "sheet")
    ),
    Format("Parquet", (".parquet",), columns.read, _TABLE, "pyarrow", is_table=True),
    Format("MATLAB", (".mat",), matlab.read, "In MATLAB: save('P01.mat', 'isi_ms', 'mep_mv', '-v7').", is_table=True),
    Format("EDF and BDF", (".edf", ".bdf"), edf.read, "Export it again, as EDF+."),
    Format("EEGLAB", (".set",), eeglab.read, _EEGLAB, "pymatreader"),
    Format("BrainVision", (".vhdr",), mne_files.read, _BRAINVISION, "mne"),
    Format("FIF", (".fif", ".fif.gz"), mne_files.read, _MNE, "mne"),
    Format("XDF", (".xdf", ".xdfz"), xdf.read, _XDF, "pyxdf"),
    Format("AcqKnowledge", (".acq",), acq.read, _ACQ, "bioread"),
    Format("Spike2", (".smr",), smr.read, installed.SMRX, "neo"),
    Format("NWB", (".nwb",), nwb.read, "Is it a file of NWB 2, and complete?", "pynwb"),
    Format("SPSS and Stata", (".sav", ".zsav", ".por", ".dta"), statistics.read, _TABLE, "pyreadstat", is_table=True),
    Format("Signal", (".cfs",), installed.cfs, installed.CFS),
    Format("Spike2 from version 8 on", (".smrx",), installed.smrx, installed.SMRX),
    Format("LabChart", (".adicht",), installed.adicht, installed.ADICHT),
    Format("CNT, GDF and MFF", (".cnt", ".gdf", ".mff"), mne_files.read, _MNE, "mne"),
)


def format_of(path: Path) -> Format:
    """The format of a file, by its name."""
    name = path.name.casefold()
    found = next((one for one in FORMATS if name.endswith(one.suffixes)), None)
    if path.is_dir() and not name.endswith(".mff"):
        remedy = f"Name its files, all together if the same options hold for them, such as {path}/*.csv."
        raise InvalidValueError("a folder is no file of trials", got=str(path), remedy=remedy)
    if found is None:
        expected = f"a file of {', '.join(suffix for one in FORMATS for suffix in one.suffixes)}"
        remedy = "Save or export it as one of these, such as CSV; of BrainVision's files name the .vhdr."
        raise InvalidValueError("this cannot be read", got=path.name, expected=expected, remedy=remedy)
    return found


def read(path: Path, layout: Layout) -> Contents:
    """What a file holds."""
    found = format_of(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles, names and dates; what is read is checked
            return found.read(path, layout)
    except (ConfigError, InvalidValueError, MemoryError):
        raise
    except Exception as error:  # each library has errors of its own
        why, *_ = str(error).splitlines() or [type(error).__name__]
        what = f"the file {'is no table, and ' if found.is_table else ''}cannot be read as {found.name}: {why}"
        raise InvalidValueError(what, got=str(path), remedy=found.way_in) from error
