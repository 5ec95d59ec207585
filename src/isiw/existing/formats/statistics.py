"""SPSS (.sav, .zsav, .por) and Stata (.dta): tables whose values and columns may have labels."""

from __future__ import annotations

from pathlib import Path

from isiw.existing.formats.contents import Contents
from isiw.existing.layout import EMG_UNITS, ISI_UNITS_MS, Layout
from isiw.existing.tables import unit_said
from isiw.text.named_code import library

_READERS = {".sav": "read_sav", ".zsav": "read_sav", ".por": "read_por", ".dta": "read_dta"}


def read(path: Path, _layout: Layout) -> Contents:
    """The table in a file of SPSS or Stata: labels in the place of values that have one, and units of labels."""
    reader = getattr(library("pyreadstat", "import"), _READERS[path.suffix.casefold()])
    frame, said = reader(str(path), apply_value_formats=True, formats_as_category=False)
    known = {**ISI_UNITS_MS, **EMG_UNITS}
    names = {}
    for name, label in said.column_names_to_labels.items():
        unit = unit_said(f"x {label or ''}", known)
        names[name] = f"{name} ({unit})" if unit and unit_said(name, known) is None else name
    return Contents(path.name, trials=frame.rename(columns=names))
