"""The columns of a table: what they hold, and in which units."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

from isiw.errors import InvalidValueError, did_you_mean
from isiw.existing import doubts
from isiw.existing.cells import Column, is_missing, required_unit, says_alone, with_decimals, without_unit_in_cells
from isiw.existing.layout import COLUMNS, EMG_UNITS, ISI_UNITS_MS, UNIT_WORDS, WORDS, Layout, letters, plain, unit_named
from isiw.existing.names import (
    ALL,
    RELATIVE,
    require_no_flags,
    require_of_kind,
    require_order,
    require_reference,
    words_of,
)
from isiw.findings import Kind
from isiw.lazy import pd

_ASKED: Final = frozenset({"isi", "mep", "status", "exclude"})  # of which there may be two, that say different things
_MANY: Final = 5000  # so many trials has no person
_OF_MEPS: Final = (
    "Correct it: 0 is no MEP, or one below the detection limit, and an empty cell a lost trial; or name another "
    "column: --column mep=NAME."
)
_OF_ISIS: Final = "Correct it; if it is TMS alone, say --alone with it; or name another column: --column isi=NAME."


@dataclass(frozen=True)
class Columns:
    """The columns of a table by what they hold, and the rows that are read."""

    of: Mapping[str, Column]
    rows: Sequence[int]
    layout: Layout
    units: tuple[str, str]
    beside: Mapping[str, Column]  # of which nothing is read
    empty: Column  # in the place of those that there are not

    def __getitem__(self, key: str) -> Column:
        return self.of.get(key, self.empty)

    def tms_alone(self, row: int) -> bool:
        """True if a row is TMS alone: its ISI says so, or its condition does, and it has no ISI, or 0 and less."""
        isi = self.of["isi"]
        if says_alone(isi.cells[row], self.layout.alone):
            return True
        return self.called_alone(row) is not None and (isi.number(row) or 0.0) <= 0

    def called_alone(self, row: int) -> Column | None:
        """The column that calls a row TMS alone, besides that of the ISIs; None if none does."""
        if self["tms_alone"].flag(row):
            return self["tms_alone"]
        return self["condition"] if says_alone(self["condition"].text(row), None) else None

    def tap_alone(self, row: int) -> bool:
        """True if a row is a tap alone, by a column for it or by its condition."""
        return bool(self["tap_alone"].flag(row)) or plain(self["condition"].text(row)) in WORDS["tap alone"]

    @cached_property
    def paired(self) -> list[int]:
        """The rows that are not TMS alone."""
        return [row for row in self.rows if not self.tms_alone(row)]

    def excluded(self, row: int) -> bool:
        """True if a row is marked as excluded, by yes or by a word such as bad."""
        return bool(self["exclude"].flag(row, "left out", "counted"))

    @property
    def units_by(self) -> tuple[str, str]:
        """The names of the columns of ISIs and amplitudes, as far as they say a unit."""
        known = (("isi", ISI_UNITS_MS), ("mep", EMG_UNITS))
        isi, mep = (self[key].name if unit_said(self[key].name, units) else "" for key, units in known)
        return isi, mep

    @property
    def flags(self) -> str:
        """The key of the column by which rows are lost."""
        return "status" if "status" in self.of else "exclude"

    def lost(self, row: int) -> Kind | None:
        """Why a row is marked as lost; None if it is not."""
        bad = self.excluded(row) and "status" not in self.of
        return Kind.of_mistrial(self["reason"].text(row)) if bad or self["status"].flag(row) is False else None

    @classmethod
    def found(cls, frame: pd.DataFrame, layout: Layout, source: str, needed: Sequence[str] = ("isi", "mep")) -> Columns:
        """The columns of a table, as they are named or else as they are called."""
        names = [str(name) for name in frame.columns]
        held = {key: _named(key, names, layout, source) for key in COLUMNS if key != "mep" or key in needed}
        _require_held([key for key in needed if held[key] is None], frame, source)
        every = [Column(name, frame.iloc[:, place].tolist(), of=source) for place, name in enumerate(names)]
        columns, used = dict[str, Column](), {*held.values()}
        for key, name in held.items():
            if name is not None:
                units = units_beside(key, name, frame) or _units_above(key, name, frame)
                said, cells = without_unit_in_cells(name, every[names.index(name)].cells)
                said = "".join([said, *(f" ({unit})" for unit in units.values())])
                columns[key] = Column(said, cells, of=source, is_stated=said in layout.where)
                columns[key].require_no_errors()
                used |= units.keys()
        columns, stated = _scaled(columns, layout)
        columns |= _with_taps_alone(replace(columns["isi"], remedy=_OF_ISIS), columns.get("tap_alone"))
        for key in [key for key in columns if key not in layout.columns and _is_another(key, columns)]:
            used.remove(held[key])
            del columns[key]
        if "subject" in columns:
            columns["subject"] = replace(columns["subject"], of_codes=True)
        if "status" in layout.columns and {*map(columns["status"].flag, range(len(frame)))} == {None, True}:
            cells = ["no" if is_missing(cell) else cell for cell in columns["status"].cells]
            columns["status"] = replace(columns["status"], cells=cells)
        empty = Column("", [None] * len(frame), of=source)
        if "mep" in columns:
            columns["mep"] = replace(columns["mep"], remedy=_OF_MEPS)
        others = [one for one in every if one.name != held.get("mep")]
        doubts.require_single_trials(columns.get("mep", empty), columns["isi"], others, frame, layout.reference)
        free = [(one.name if one.name.strip() else f"column {place}", one) for place, one in enumerate(every, 1)
                if one.name not in used and (one.name.strip() or any(one.texts))]  # fmt: skip
        beside = {name: replace(one, name=name, is_stated=name in layout.where) for name, one in free}
        for column in beside.values():
            require_no_flags(column)
        require_reference("column", "isi", columns["isi"].name, layout.reference, source)
        require_order(columns["isi"])
        if (condition := columns.get("condition")) is not None:  # which may tell pairs from each other, too
            alone = WORDS["alone"] | WORDS["tap alone"]
            of_pairs = replace(condition, cells=["" if plain(text) in alone else text for text in condition.texts])
            if len({*map(plain, of_pairs.texts)} - {""}) > 1:
                beside[condition.name] = of_pairs
        return cls(columns, _chosen([*columns.values(), *beside.values()], layout), layout, stated, beside, empty)


def _require_held(missing: Sequence[str], frame: pd.DataFrame, source: str) -> None:
    for key in missing:
        what = f"no column of {source} is known to hold the {'ISIs' if key == 'isi' else 'amplitudes of the MEPs'}"
        got = ", ".join(str(name) for name in frame.columns if str(name).strip()) or "no names"
        remedy = f'Say --column "{key}=NAME"; if the names are not in the first line, describe the file (--layout); '
        remedy += "if each ISI has a column, or each trial, write a row for each trial."
        if len(frame) > _MANY:
            remedy += " If these are samples, a row each, say --channel emg=NAME, and write rate_hz into a layout."
        raise InvalidValueError(what, got=got, remedy=remedy)


def _with_taps_alone(isi: Column, flags: Column | None) -> dict[str, Column]:
    """The ISIs, and which rows are a tap alone, if the cells of ISIs say so of some."""
    taps = [isinstance(cell, str) and plain(cell) in WORDS["tap alone"] for cell in isi.cells]
    if not any(taps):
        return {"isi": isi}
    said = flags or replace(isi, cells=[None] * len(taps))
    cells = [None if tap else cell for tap, cell in zip(taps, isi.cells, strict=True)]
    others = [1 if tap else cell for tap, cell in zip(taps, said.cells, strict=True)]
    return {"isi": replace(isi, cells=cells), "tap_alone": replace(said, cells=others)}


def _is_another(key: str, columns: Mapping[str, Column]) -> bool:
    """True if a column is of no use as what its name says: an id of each row, reasons of nothing, or amplitudes."""
    texts = columns[key].texts if key in {"subject", "tms_alone", "order"} else []
    if key == "subject":
        return letters(columns[key].name) == "id" and 1 < len(texts) == len({*texts})
    if key == "tms_alone":
        return not {*map(str.casefold, texts)} <= {"", *WORDS["yes"], *WORDS["no"]}
    said = re.search(r"\d", "".join(texts)) if key == "order" else {"status", "exclude"} & columns.keys()
    if key in {"mep_low", "mep_high"}:  # an interval has two ends
        return not {"mep_low", "mep_high"} <= columns.keys()
    return key in {"order", "reason"} and not said  # such as before and after


def _chosen(columns: Sequence[Column], layout: Layout) -> list[int]:
    """The rows whose cells say what is to be read, as the layout states."""
    every, source, kept = {one.name: one for one in columns}, columns[0].of, [*range(len(columns[0].cells))]
    for name, wanted in layout.where.items():
        require_one("column", source, name, every)
        texts = every[name].texts
        if wanted not in {ALL, *texts}:
            what = f"no row of {source} has this in its column {name!r}"
            raise InvalidValueError(what, got=wanted, expected=f"one of {', '.join([*dict.fromkeys(texts)][:9])}")
        kept = [row for row in kept if wanted in {ALL, texts[row]}]
    return kept


def _scaled(columns: Mapping[str, Column], layout: Layout) -> tuple[dict[str, Column], tuple[str, str]]:
    """Columns whose numbers are in ms, mV or µV by the units that are stated; those of ISIs and amplitudes besides."""
    numeric = ("isi", "mep", "asked", "isi_sd", "mep_low", "mep_high", "background", "intensity")
    scaled = {**columns, **with_decimals({key: columns[key] for key in numeric if key in columns}, layout.decimal)}
    isi_unit = _required_unit("isi", "ISIs", scaled["isi"], layout, ISI_UNITS_MS)
    mep_unit = _required_unit("mep", "amplitudes", scaled["mep"], layout, EMG_UNITS) if "mep" in scaled else "mV"
    factors = {"isi": ISI_UNITS_MS[isi_unit], **dict.fromkeys(("mep", "mep_low", "mep_high"), EMG_UNITS[mep_unit])}
    for key, known, usual in (("asked", ISI_UNITS_MS, isi_unit), ("isi_sd", ISI_UNITS_MS, isi_unit),
                              ("background", EMG_UNITS, "uV")):  # fmt: skip
        if key in scaled:
            if known is ISI_UNITS_MS:
                require_of_kind("isi", "ISIs", scaled[key].name, scaled[key].of)
            factors[key] = known[unit_said(scaled[key].name, known) or usual] * (1e3 if known is EMG_UNITS else 1.0)
    scaled |= {key: replace(scaled[key], factor=factor) for key, factor in factors.items() if key in scaled}
    return scaled, (isi_unit, mep_unit)


def require_one(kind: str, source: str, stated: str, names: Iterable[object], remedy: str | None = None) -> None:
    """Raise if a file has nothing of a kind of the name that is stated, or more than one."""
    known = [str(name) for name in names]
    if stated not in known:
        remedy, expected = did_you_mean(stated, known) or remedy, f"one of {', '.join(known)}"
        raise InvalidValueError(f"{source} has no such {kind}", got=stated, expected=expected, remedy=remedy)
    if known.count(stated) > 1:
        raise InvalidValueError(f"several {kind}s of {source} have this name", got=stated, remedy="Rename them.")


def _named(key: str, names: list[str], layout: Layout, source: str) -> str | None:
    """The column that holds something; None if there is none."""
    if (stated := layout.columns.get(key)) is not None:
        if stated not in names:  # what stands below it, or is its label, was added to it
            stated = next((name for name in names if name.partition(" (")[0] == stated), stated)
        require_one("column", source, stated, names)
        return stated
    free = [(name, letters(re.sub(r"\.\d+$", "", name)))  # so pandas numbers names that come again
            for name in names if name not in layout.columns.values()]  # fmt: skip
    found = [(known, name) for known in COLUMNS[key] for name, plain_name in free if plain_name == known]
    if key == "mep":  # one in per cent may stand beside it
        found = [one for one in found if not re.search(RELATIVE, words_of(one[1]))] or found
    first = found[0][0] if found else ""
    several = [name for known, name in found
               if known == first or (key in _ASKED and len({known, first} & WORDS["vague"]) != 1)]  # fmt: skip
    if len(several) > 1:
        what = f"several columns of {source} may hold the {key}"
        alike = "Rename one of them; if they are further trials, write a row for each."
        remedy = f'Say --column "{key}={several[0]}".' if len(set(several)) > 1 else alike
        raise InvalidValueError(what, got=" or ".join(several), remedy=remedy)
    return several[0] if several else None


def isis_of(said: Mapping[str, Any]) -> Iterator[float]:
    """The ISIs [ms] among what a row says, by the names of its columns."""
    for name, cell in said.items():
        if letters(name) in COLUMNS["isi"]:
            column = Column(name, [cell], factor=ISI_UNITS_MS[unit_said(name, ISI_UNITS_MS) or "ms"])
            yield from (number for number in [column.number(0)] if number is not None)


def units_beside(key: str, name: str, frame: pd.DataFrame) -> dict[str, str]:
    """Units that columns beside another say of it, such as `isi_unit`, by their names."""
    known, found = (EMG_UNITS if key in {"mep", "emg", "background"} else ISI_UNITS_MS), dict[str, str]()
    for place, other in enumerate(map(str, frame.columns)):
        of = re.fullmatch("(.*?)units?", letters(other))
        if of is None or not (letters(name).startswith(of[1]) or of[1] in COLUMNS.get(key, ())):
            continue
        for text in dict.fromkeys(frame.iloc[:, place].dropna().astype(str)):
            unit = unit_named(text) or (text if of[1] and re.search(r"\d", text) else None)  # 0.1 ms is asked about
            fits = unit in known or (known is EMG_UNITS and unit not in ISI_UNITS_MS)  # or per cent, of amplitudes
            if unit is not None and (of[1] or fits):  # a unit of no column is of those that may have it
                found[other] = unit if found.get(other) in {None, unit} else f"{found[other]}) ({unit}"
    return found


def unit_of(name: str, frame: pd.DataFrame) -> str:
    """The unit of a channel by its name and by what a column beside it says; empty if none does."""
    said = "".join([name, *(f" ({unit})" for unit in units_beside("emg", name, frame).values())])
    return unit_said(said, EMG_UNITS) or ""


def _units_above(key: str, name: str, frame: pd.DataFrame) -> dict[str, str]:
    """The unit that a title says of ISIs or amplitudes, such as "MEP in µV", or "in s" if no column's name does."""
    known = {"isi": {**ISI_UNITS_MS, "samples": 1.0}, "mep": EMG_UNITS}.get(key, {})
    title = f" - {frame.attrs.get('title', '')}"
    said = re.findall(r"(?i)([^\W\d_]+?)s?(?: are| is| sind| ist)? in ([^\W\d_]+)", title)
    found = [unit for of, word in said if (unit := unit_named(word)) in known
             and (letters(of) in COLUMNS[key] or not unit_said(name, known))]  # fmt: skip
    return {"": str(found[0])} if found else {}


def unit_said(name: str, known: Mapping[str, float]) -> str | None:
    """The unit that a column's name says, of those of one quantity; raise if it says two, such as one in its cells."""
    inside, bare = re.findall(r"[\[(]([^][()]*)[\])]", name), re.findall(r"[^\W_]+", re.sub(r"[\[(].*", "", name))[1:]
    found, usual = ([unit for word in words if (unit := unit_named(word) or "") in known]
                    for words in ([*inside, *bare[-1:]], bare))  # fmt: skip
    if len({*found}) > 1:
        remedy = "Leave the right one in its name."
        raise InvalidValueError(f"the column {name!r} says two units", got=" and ".join(found), remedy=remedy)
    return next(reversed(found or usual), None)


def _required_unit(key: str, what: str, column: Column, layout: Layout, known: Mapping[str, float]) -> str:
    """The column's unit, as it is stated or as its name says, which must not say that it is something else."""
    require_of_kind(key, what, column.name, column.of)
    if (other := unit_said(column.name, dict.fromkeys({*UNIT_WORDS.values()} - known.keys(), 1.0))) is not None:
        remedy = "Name the right column: --column KEY=NAME; if it is the right one, correct its name."
        raise column.doubted(f"says a unit of no {what}", other, remedy)
    some = ", ".join(filter(None, column.texts[:5])) or None
    said, stated = unit_said(column.name, known), layout.unit_of(known)
    if said and stated and known[said] != known[stated] and column.name not in layout.where:
        remedy = f'Leave out the wrong one of them; if it is the name, say --where "{column.name}={ALL}", too.'
        raise column.doubted("says another unit than the one that is stated", stated, remedy, said)
    what = f"the {what} of {column.of} in the column {column.name!r}"
    return required_unit(layout, known, said, what, some)
