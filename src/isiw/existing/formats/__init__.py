"""The formats of files that can be read: a row each, with the module that yields what such a file holds."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from isiw.errors import ConfigError, InvalidValueError
from isiw.existing.formats import columns, edf, eeglab, matlab, mne_files, nwb, programs, spike2, xdf
from isiw.existing.formats.contents import Contents
from isiw.existing.frames import STATISTICS, TEXTS, WORKBOOKS
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
    install: str = ""  # how its users install the library, if it is none of isiw's extras
    on_windows: bool = False  # whether the library is for Windows alone


_TABLE: Final = "Save it as CSV, with the columns' names in the first line."
_EEGLAB: Final = "In EEGLAB: File, Save current dataset as; its .fdt stays beside it."
_BRAINVISION: Final = "Are the .eeg and .vmrk beside it, under the names that it says?"
_MNE: Final = "Are all of its files in one folder? Otherwise export it as EDF+ or BrainVision."
_XDF: Final = "Record again with LabRecorder, or save the streams as EDF+."
_ASKED: Final = "A layout says what is what: docs/your-data.md."
_CFS: Final = "In Signal: File, Export As, Text file (.txt), the frames one below the other, or MATLAB data (.mat)."
_SMRX: Final = ("In Spike2: File, Export As, Spreadsheet text (.txt), a row a sample, EMG and triggers as columns; or "
                f"File, Export As, an older Spike2 file (.smr). {_ASKED}")  # fmt: skip
_ADICHT: Final = "In LabChart: File, Export, LabChart text (.txt), with block header, time and comments."
_GPL: Final = "Install BioSig for Python, whose licence is GPL-3"
_ACQ: Final = "In AcqKnowledge: File, Save As, text (.txt) or MATLAB (.mat), and a layout."

FORMATS: Final = (
    Format("text", TEXTS, columns.read, _TABLE, is_table=True, options=("skip_lines", "names", "separator")),
    Format("Excel", WORKBOOKS, columns.read, _TABLE, "openpyxl", is_table=True,
           options=("skip_lines", "names", "sheet")),
    Format("Parquet", (".parquet",), columns.read, _TABLE, "pyarrow", is_table=True),
    Format("MATLAB", (".mat",), matlab.read, "In MATLAB: save('P01.mat', 'isi_ms', 'mep_mv', '-v7').", is_table=True),
    Format("EDF and BDF", (".edf", ".bdf"), edf.read, "Export it again, as EDF+."),
    Format("EEGLAB", (".set",), eeglab.read, _EEGLAB, "pymatreader"),
    Format("BrainVision", (".vhdr",), mne_files.read, _BRAINVISION, "mne"),
    Format("FIF", (".fif", ".fif.gz"), mne_files.read, _MNE, "mne"),
    Format("XDF", (".xdf", ".xdfz"), xdf.read, _XDF, "pyxdf"),
    Format("AcqKnowledge", (".acq",), programs.acq, _ACQ, "bioread"),
    Format("Spike2", (".smr",), spike2.read, _SMRX, "neo"),
    Format("NWB", (".nwb",), nwb.read, "Is it a file of NWB 2, and complete?", "pynwb"),
    Format("SPSS and Stata", tuple(STATISTICS), columns.read, _TABLE, "pyreadstat", is_table=True),
    Format("Signal", (".cfs",), programs.cfs, f"{_CFS} {_ASKED}", "biosig", install=_GPL),
    Format("Spike2 from version 8 on", (".smrx",), spike2.smrx, _SMRX, "sonpy",
           install="pip install sonpy, whose licence is its own", on_windows=True),
    Format("LabChart", (".adicht",), programs.adicht, f"{_ADICHT} {_ASKED}", "adi",
           install="pip install adi-reader, whose licence is its own", on_windows=True),
    Format("CNT, GDF and MFF", (".cnt", ".gdf", ".mff"), mne_files.read, _MNE, "mne"),
)  # fmt: skip


def format_of(path: Path) -> Format:
    """The format of a file, by its name."""
    name = path.name.casefold()
    found = next((one for one in FORMATS if name.endswith(one.suffixes)), None)
    if path.is_dir() and not name.endswith(".mff"):
        remedy = f"Name its files, all together if the same options hold for them, such as {path}/*.csv."
        raise InvalidValueError("a folder is no file of trials", got=str(path), remedy=remedy)
    if found is None:
        expected = f"a file of {', '.join(suffix for one in FORMATS for suffix in one.suffixes)}, or a log (.mcap)"
        remedy = "Save or export it as one of these, such as CSV; of BrainVision's files name the .vhdr."
        raise InvalidValueError("this cannot be read", got=path.name, expected=expected, remedy=remedy)
    return found


def read(path: Path, layout: Layout) -> Contents:
    """What a file holds."""
    found = format_of(path)
    if found.on_windows and sys.platform != "win32":
        raise ConfigError("this format has no reader but on Windows", got=sys.platform, remedy=found.way_in)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles, names and dates; what is read is checked
            return found.read(path, layout)
    except (InvalidValueError, MemoryError):
        raise
    except ConfigError as error:
        if found.install:
            raise ConfigError(error.what, remedy=f"{found.install}. Or: {found.way_in}") from error
        raise
    except Exception as error:  # each library has errors of its own
        why, *_ = str(error).splitlines() or [type(error).__name__]
        what = f"the file {'is no table, and ' if found.is_table else ''}cannot be read as {found.name}: {why}"
        raise InvalidValueError(what, got=str(path), remedy=found.way_in) from error
