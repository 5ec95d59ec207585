"""SPSS (.sav, .zsav, .por) and Stata (.dta): tables whose values and columns may have labels."""

from __future__ import annotations

from pathlib import Path

from isiw.existing.doubts import doubtful_words
from isiw.existing.formats.contents import Contents
from isiw.existing.layout import EMG_UNITS, ISI_UNITS_MS, Layout
from isiw.existing.quantities import unit_said
from isiw.text.named_code import library

_READERS = {".sav": "read_sav", ".zsav": "read_sav", ".por": "read_por", ".dta": "read_dta"}


def read(path: Path, _layout: Layout) -> Contents:
    """The table in a file of SPSS or Stata: labels for values, and what labels of columns say behind their names."""
    reader = getattr(library("pyreadstat", "import"), _READERS[path.suffix.casefold()])
    frame, said = reader(str(path), apply_value_formats=True, formats_as_category=False)
    names = {}
    for name, label in said.column_names_to_labels.items():
        units = [unit_said(f"x {label or ''}", known) for known in (ISI_UNITS_MS, EMG_UNITS)]
        names[name] = "".join([name, *(f" ({word})" for word in (*units, *doubtful_words(label or "")) if word)])
    return Contents(path.name, trials=frame.rename(columns=names))
