"""What the columns of a table hold, and in which units; what is ambiguous is asked about."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from isiw.errors import InvalidValueError, did_you_mean
from isiw.existing.cells import Column, says_alone, with_decimals
from isiw.existing.frames import without_unit_in_cells
from isiw.existing.layout import COLUMNS, ISI_UNITS_MS, UNIT_WORDS, Layout, letters
from isiw.lazy import pd
from isiw.signals.limits import EMG_UNITS_MV


@dataclass(frozen=True)
class Columns:
    """The columns of a table by what they hold.

    Args:
        of: the columns that are there.
        factors: by what the numbers of a column are multiplied to be in ms, mV or µV.
        rows: how many rows there are.
        units: the units of ISIs and amplitudes.
    """

    of: Mapping[str, Column]
    factors: Mapping[str, float]
    rows: int
    units: tuple[str, str]

    @classmethod
    def found(cls, frame: pd.DataFrame, layout: Layout, source: str) -> Columns:
        """The columns of a table, as they are named or else as they are called."""
        names = [str(name) for name in frame.columns]
        held = {key: _named(key, names, layout, source) for key in COLUMNS}
        for key in ("isi", "mep"):
            if held[key] is None:
                raise _missing(key, names, source)
        columns = {}
        for key, name in held.items():
            if name is not None:
                said, cells = without_unit_in_cells(name, frame.iloc[:, names.index(name)].tolist())
                columns[key] = Column(said, cells, of=source)
        numeric = ("isi", "mep", "asked", "isi_sd", "background")
        columns |= with_decimals({key: columns[key] for key in numeric if key in columns}, layout.decimal)
        isi_unit = required_unit("ISIs", columns["isi"], layout, ISI_UNITS_MS)
        mep_unit = required_unit("amplitudes", columns["mep"], layout, EMG_UNITS_MV)
        factors = {"isi": ISI_UNITS_MS[isi_unit], "mep": EMG_UNITS_MV[mep_unit]}
        for key in ("asked", "isi_sd"):
            if key in columns:
                factors[key] = ISI_UNITS_MS[_told(columns[key].name, ISI_UNITS_MS) or isi_unit]
        if "background" in columns:
            factors["background"] = 1e3 * EMG_UNITS_MV[_told(columns["background"].name, EMG_UNITS_MV) or "uV"]
        return cls(columns, factors, len(frame), (isi_unit, mep_unit))

    def number(self, key: str, row: int) -> float | None:
        """A number of a row, in ms, mV or µV; None if there is none."""
        column = self.of.get(key)
        return None if column is None else column.number(row, self.factors.get(key, 1.0))

    def flag(self, key: str, row: int) -> bool | None:
        """A yes or no of a row; None if there is none."""
        column = self.of.get(key)
        return None if column is None else column.flag(row)

    def text(self, key: str, row: int) -> str:
        """A text of a row; empty if there is none."""
        column = self.of.get(key)
        return "" if column is None else column.text(row)


def _named(key: str, names: list[str], layout: Layout, source: str) -> str | None:
    """The column that holds something; None if there is none."""
    if (stated := layout.columns.get(key)) is not None:
        if names.count(stated) > 1:
            raise InvalidValueError(f"several columns of {source} have this name", got=stated, remedy="Rename them.")
        if stated not in names:
            raise InvalidValueError(
                f"{source} has no such column",
                got=stated,
                expected=f"one of {', '.join(names)}",
                remedy=did_you_mean(stated, names) or None,
            )
        return stated
    taken = set(layout.columns.values())
    for known in COLUMNS[key]:
        fitting = [name for name in names if letters(name) == known and name not in taken]
        if len(fitting) > 1:
            raise InvalidValueError(
                f"several columns of {source} may hold the {key}",
                got=" or ".join(fitting),
                remedy=f'Say --column "{key}={fitting[0]}".' if len(set(fitting)) > 1 else "Rename one of them.",
            )
        if fitting:
            return fitting[0]
    return None


def _missing(key: str, names: list[str], source: str) -> InvalidValueError:
    what = {"isi": "ISIs", "mep": "amplitudes of the MEPs"}[key]
    return InvalidValueError(
        f"no column of {source} is known to hold the {what}",
        got=", ".join(names),
        remedy=f'Say --column "{key}=NAME"; if the names are not in the first line, describe the file: --layout FILE.',
    )


def isis_of(vectors: Mapping[str, Sequence[Any]], layout: Layout, source: str) -> list[float | None]:
    """The ISIs among the vectors that come with sweeps [ms]; None is TMS alone."""
    name = _named("isi", list(vectors), layout, source)
    if name is None:
        raise _missing("isi", list(vectors), source)
    cells = list(vectors[name])
    column = with_decimals({"isi": Column(name, cells, of=source)}, layout.decimal)["isi"]
    factor = ISI_UNITS_MS[required_unit("ISIs", column, layout, ISI_UNITS_MS)]
    alone = [says_alone(cell, layout.alone) for cell in cells]
    isis_ms = [None if alone[row] else column.number(row, factor) for row in range(len(cells))]
    if lost := [row for row, isi_ms in enumerate(isis_ms) if isi_ms is None and not alone[row]]:
        raise column.refused(lost[0], "is empty", "If it is TMS alone, say --alone ''.")
    return isis_ms


def _told(name: str, known: Mapping[str, float]) -> str | None:
    """The unit that a column's name says, of those of one quantity."""
    words = [*re.findall(r"[\[(](.*?)[\])]", name), *re.findall(r"[^\W_]+", name)[1:]]
    told = [unit for word in words if (unit := UNIT_WORDS.get(word.strip().casefold(), "")) in known]
    return told[-1] if told else None


def required_unit(what: str, column: Column, layout: Layout, known: Mapping[str, float]) -> str:
    """The column's unit, as it is stated or as its name says."""
    unit = layout.unit_of(known) or _told(column.name, known)
    if unit is None:
        units = "ms or s" if "ms" in known else "mV, uV or V"
        numbers = [value for row in range(len(column.cells)) if isinstance(value := _tried(column, row), float)]
        span = f"{min(numbers):g} to {max(numbers):g}" if numbers else None
        raise InvalidValueError(
            f"the unit of the {what} of {column.of} is not stated, in the column {column.name!r}",
            got=span,
            remedy=f"Say --unit with {units}.",
        )
    return unit


def _tried(column: Column, row: int) -> float | None:
    try:
        return column.number(row)
    except InvalidValueError:
        return None
