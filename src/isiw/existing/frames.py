"""Files as tables: rows of cells, among which the line with the columns' names is found, and one of units below it."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import chain, islice, pairwise, zip_longest
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.cells import is_missing
from isiw.existing.layout import COLUMNS, EMG_UNITS, ISI_UNITS_MS, Layout, letters, unit_named
from isiw.existing.names import doubtful_words, is_remark
from isiw.existing.quantities import require_one, unit_said
from isiw.lazy import pd
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.text.sanitize import counted

TEXTS: Final = (".csv", ".tsv", ".txt", ".dat", ".tab")
WORKBOOKS: Final = (".xlsx", ".xlsm")
STATISTICS: Final = {".sav": "read_sav", ".zsav": "read_sav", ".por": "read_por", ".dta": "read_dta"}  # of pyreadstat
_NOTE: Final = re.compile(rb'(?s)<comment ref="[A-Z]+(\d+)"(.*?)</comment>')
_TEXT: Final = re.compile(r"(?s)<t(?: [^>]*)?>([^<]*)</t>")
_LINES, _HEAD = 100, 40  # within so many lines the columns' names are sought; so many bytes show how a text is encoded
_BLANKS: Final = r"\s+"
_WORDS: Final = 2  # blanks at least are in a line of text
_COUNT: Final = "If these trials count, show them as the others; if not, mark them in a column called exclude."
_SHOWN_OTHERWISE: Final = (
    (r'<row (?=[^>/]*hidden="(?:1|true)")[^>/]*?r="(\d+)"[^>/]*>', "hidden", _COUNT),
    (r'<c r="[A-Z]+(\d+)"[^>]*><f[^>]*(?:/>|>[^<]*</f>)(?:<v ?/>|<v></v>)?</c>', "without the result of a formula",
     "Open the workbook in Excel or LibreOffice, and save it."),
)  # fmt: skip # in a sheet's XML, rows that Excel shows otherwise than as their cells say, and what to do


def read_frame(path: Path, layout: Layout) -> pd.DataFrame:
    """The table in a file, its cells as they are."""
    suffix = path.suffix.lower()
    if suffix in STATISTICS:
        return _labelled(path, STATISTICS[suffix])
    if suffix == ".parquet":
        return named(pd.read_parquet(io.BytesIO(content_of(path))))
    return _workbook(content_of(path), layout) if suffix in WORKBOOKS else _texts(decoded(content_of(path)), layout)


def content_of(path: Path) -> bytes:
    """The bytes in a file."""
    with opened(path) as file:
        return file.read()


def _labelled(path: Path, reader: str) -> pd.DataFrame:
    """A table of SPSS or Stata: labels for values, and what labels of columns say behind their names."""
    read = getattr(library("pyreadstat", "import"), reader)
    frame, said = read(str(path), apply_value_formats=True, formats_as_category=False)
    for name, labels in said.variable_value_labels.items():
        kinds = {isinstance(cell, str) for cell in frame[name] if not is_missing(cell)}
        if (numbers := [label for label in labels.values() if label[:1].isdigit()]) and len(kinds) > 1:
            what = f"some values of the column {name!r} of {path.name} have numbers as labels, and others have no label"
            raise InvalidValueError(what, got=", ".join(numbers[:3]), remedy="Give a label to all of its values.")
    names = {}
    for name, label in said.column_names_to_labels.items():
        units = [unit_said(f"x {label or ''}", known) for known in (ISI_UNITS_MS, EMG_UNITS)]
        names[name] = "".join([name, *(f" ({word})" for word in (*units, *doubtful_words(label or "")) if word)])
    return cast("pd.DataFrame", frame.rename(columns=names))


def named(frame: pd.DataFrame | None) -> pd.DataFrame:
    """A data frame whose index, if it has a name, is a column as others are, and whose columns have one name each."""
    frame = pd.DataFrame() if frame is None else frame
    out_of_order = frame.index.is_unique and not frame.index.is_monotonic_increasing
    if out_of_order or any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    names = [" ".join(map(str, name)) if isinstance(name, tuple) else str(name) for name in frame.columns]
    if any(names[1:]) and letters(names[0]) in {"", "unnamed0"}:  # as R and pandas write the numbers of rows
        numbers = pd.to_numeric(frame.iloc[:, 0], errors="coerce")
        names[0] = "index" if numbers.notna().all() and numbers.is_unique else names[0]
    return frame.set_axis(names, axis=1)


def _texts(text: str, layout: Layout) -> pd.DataFrame:
    if "\0" in text:
        raise InvalidValueError("the file is no text, and so no table that can be read", remedy="Is it the right one?")
    every = [*io.StringIO(text, newline=None)]  # no other sign ends a line, since it may stand in a cell
    lines = every[layout.skip_lines :]
    first = 0 if layout.names else _first(lines, layout)
    title, lines = "".join(lines[:first]), lines[first:]
    separator = layout.separator or _separator(lines)
    if lines and lines[0].startswith("#"):
        lines = [*_first_part(lines, separator)]
    title += "".join(line for line in lines if line.startswith("# "))
    lines = [line for line in lines if not line.startswith("# ")]
    every_row, foot = _without_foot([*_split(lines, separator)])
    title += foot
    table = _table([row for row in every_row if row], layout, title)
    below = len(every_row) - next((n for n in range(len(every_row), 1, -1) if not every_row[n - 1]), 0)
    table.attrs["apart"] = len(table) - below if below < len(table) else None
    table.attrs["head"] = "".join(every[: layout.skip_lines + first])
    return table


def _first_part(lines: Sequence[str], separator: str) -> Iterator[str]:
    """Of parts that begin with a # and names of their own the first one, without trials that a # leaves out."""
    names, *_ = _split([head := lines[0].lstrip("# ")], separator)
    yield head
    for line, below in pairwise([*lines[1:], ""]):
        if line.startswith("#"):
            cells, after = ([*chain(*_split([one.lstrip("# ")], separator))] for one in (line, below))
            if len(cells) == len(after) != len(names):
                return
            if cells in ([], names) or cells[0][:1].isdigit():
                continue
        yield line


def _first(lines: Sequence[str], layout: Layout) -> int:
    """The line with the columns' names: those below it have as many cells, or at least it has a sign between names."""
    found = []
    for number, line in enumerate(lines[:_LINES]):
        separator = layout.separator or _separator(lines[number : number + 2])
        names, *below = _split([line.lstrip("# "), *lines[number + 1 : number + 3]], separator)
        if _is_header(names, layout):
            found.append((not all(len(row) >= len(names) for row in below if row), separator == _BLANKS, number))
    best = min(found, default=(True, True, 0))[-1]
    return next((number for number, line in enumerate(lines) if line == lines[best]), 0)  # where the names come first


def _is_header(cells: Sequence[Any], layout: Layout) -> bool:
    """True if cells are the names of columns, those of ISIs and amplitudes among them."""
    texts = [cell.strip() for cell in cells if isinstance(cell, str)]
    known = {letters(text) for text in texts}
    if not {*layout.columns.values(), *layout.channels.values()} <= {*texts}:
        return False
    of_trials = (key in layout.columns or not known.isdisjoint(COLUMNS[key]) for key in ("isi", "mep"))
    return bool(layout.channels) or all(of_trials)


def _table(rows: Sequence[Sequence[Any]], layout: Layout, title: str) -> pd.DataFrame:
    """Rows as a table that knows its title: below the names, or below those that are stated."""
    if not rows and not layout.names:
        raise InvalidValueError("the file is empty, and no table that can be read", remedy="Is it the right one?")
    names = [*layout.names] or ["" if is_missing(cell) else str(cell).strip() for cell in rows[0]]
    body = rows if layout.names else rows[1:]
    below = body[0] if body and not layout.names else ()
    units = [None if is_missing(cell) or not isinstance(cell, str) else _unit_below(cell) for cell in below]
    others = [str(cell) for unit, cell in zip(units, below, strict=True) if not (unit or is_missing(cell))]
    if any(units) and (not others or (sum(map(bool, units)) > 1 and not re.search(r"\d", "".join(others)))):
        names = [f"{name} {unit}" if unit else name for name, unit in zip(names, units, strict=False)]
        body = body[1:]
    if not body:
        raise InvalidValueError("the table has no rows", got=", ".join(names), remedy="Is the file complete?")
    numbered = all(len(row) == len(names) + 1 and str(row[0]) == str(n) for n, row in enumerate(body, 1))
    if numbered and not all(is_missing(row[-1]) for row in body):  # those end with the sign that separates cells
        body = [row[1:] for row in body]  # R numbers its rows without naming the column of these numbers
    for number, row in enumerate(body, 1):
        if not all(is_missing(cell) for cell in row[len(names) :]):
            what = f"row {number} has {len(row)} cells, but there are {len(names)} names: no table that can be read"
            remedy = "Is a decimal comma also what separates the cells? Save the file with another separator. If it "
            remedy += "has samples, describe it in a layout, as docs/your-data.md does (--layout)."
            raise InvalidValueError(what, got=" | ".join(map(str, row[: len(names) + 2])), remedy=remedy)
    table = pd.DataFrame([[*row[: len(names)], *[""] * (len(names) - len(row))] for row in body], columns=names)
    beside, kept, notes = _beside(table, layout)
    table = table.iloc[:, kept]
    table.attrs |= {"title": f"{title}\n{beside}", "notes": notes}
    return table


def _beside(table: pd.DataFrame, layout: Layout) -> tuple[str, list[int], str]:
    """What stands in cells to the right of a table, its own columns, and the names of those that are empty."""
    aside, kept, empty, is_apart = list[int](), list[int](), list[str](), False
    for place, name in enumerate(table.columns):
        filled = (n for n, cell in enumerate(table.iloc[:, place]) if not is_missing(cell))
        if (first := next(filled, None)) is None:
            empty += [] if is_apart else [name]
        is_apart |= first is None and not name  # by an empty column
        few = [] if not is_apart or first is None else [first, *filled]
        at_top = 4 * len(few) <= len(table) and few == [*range(len(few))]
        is_own = not (is_apart and at_top) or name in layout.columns.values()
        (kept if is_own else aside).append(place)
    cells = table.iloc[:, aside]
    return _text_in([[*cells.columns], *cells.to_numpy().tolist()]).strip(), kept, " ".join(empty)


def _text_in(rows: Iterable[Sequence[Any]]) -> str:
    return "\n".join(" ".join(str(cell) for cell in row if not is_missing(cell)) for row in rows)


def _without_foot(rows: list[list[Any]]) -> tuple[list[list[Any]], str]:
    """Rows without lines of text below them, and these lines."""
    kept, foot = len(rows), ""
    for row in reversed(rows):
        said = [cell for cell in row if not is_missing(cell)]
        if not all(isinstance(cell, str) and (cell.count(" ") >= _WORDS or ": " in cell) for cell in said):
            break
        kept, foot = kept - 1, "\n".join([*said, foot])
    return (rows[:kept], f"\n{foot}") if foot.strip() else (rows, "")


def _unit_below(cell: str) -> str | None:
    """What a cell below a name adds to it: a unit, or words with a unit behind them, such as amplitude (mV)."""
    if unit := unit_named(cell.strip().strip("[]()")):
        return f"({unit})"
    inside = re.fullmatch(r"[^\W\d]+ ?[\[(]([^][()]*)[\])]", cell.strip())
    return cell.strip() if inside and unit_named(inside[1]) else None


def decoded(content: bytes) -> str:
    """A text, however it is encoded."""
    if content[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return content.decode("utf-16")
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):  # the same without a mark of the order of its bytes
        if content[first:_HEAD:2] and not any(content[first:_HEAD:2]):
            return content.decode(encoding)
    with suppress(UnicodeDecodeError):
        return content.decode("utf-8-sig")
    return content.decode("cp1252", errors="replace")


def _separator(lines: Sequence[str]) -> str:
    """The sign between names that comes as often in the line below, or else most often."""
    line, below = ([one.lstrip("# ") for one in lines[:2]] + ["", ""])[:2]
    counts = {sign: line.count(sign) for sign in ("\t", ";", "|", ",")}
    best = max(counts, key=lambda sign: (0 < counts[sign] == below.count(sign), counts[sign]))
    return best if counts[best] else _BLANKS


def _split(lines: Sequence[str], separator: str) -> Iterator[list[str]]:
    if separator == _BLANKS:
        lines, separator = [" ".join(line.split()) for line in lines], " "
    return csv.reader(lines, delimiter=separator, skipinitialspace=True)


def _workbook(content: bytes, layout: Layout) -> pd.DataFrame:
    """The sheet that is named, or the only one with trials, or the first."""
    library("openpyxl", "import")
    if not content.startswith(b"PK"):
        what = "this is no workbook that can be read, or one with a password"
        raise InvalidValueError(what, remedy="Save it as .xlsx without a password, or as CSV.")
    book = pd.ExcelFile(io.BytesIO(content), engine="openpyxl")
    if layout.sheet is not None:
        require_one("sheet", "the workbook", layout.sheet, book.sheet_names)
    sheets, heads, titles = dict[str, list[list[Any]]](), dict[str, int](), dict[str, str]()
    for name in [layout.sheet] if layout.sheet is not None else map(str, book.sheet_names):
        cells, foot = _without_foot(_cells(book.book[name]))
        rows = cells[layout.skip_lines :]
        first = next((n for n, row in enumerate(rows[:_LINES]) if _is_header(row, layout)), 0)
        sheets[name] = rows if layout.names else rows[first:]
        heads[name] = len(cells) - len(sheets[name]) + (0 if layout.names else 1)
        titles[name] = f"{name}\n{_text_in(cells[: max(heads[name] - 1, 0)])}{foot}"
    with_trials = [name for name, rows in sheets.items() if rows and _is_header(rows[0], layout)]
    if len(with_trials) > 1:
        what = "several sheets of the workbook hold trials"
        raise InvalidValueError(what, got=", ".join(with_trials), remedy="Say --sheet NAME.")
    filled = [name for name, rows in sheets.items() if len(rows) > 1]
    if not with_trials and len(filled) > 1:
        held = {name: ", ".join(str(cell) for cell in sheets[name][0] if not is_missing(cell)) for name in filled}
        what = "no sheet of the workbook is known to hold ISIs and amplitudes"
        remedy = "Say --sheet NAME, and --column isi=NAME --column mep=NAME."
        raise InvalidValueError(what, got="; ".join(f"{name} ({cells})" for name, cells in held.items()), remedy=remedy)
    chosen = (with_trials or filled or list(sheets))[0]
    rows = sheets[chosen]
    merged, coloured = _require_whole(book.book, chosen, heads[chosen])
    if not layout.names:
        _flag_coloured(rows, coloured)
    _fill_merged(rows, merged, heads[chosen] + (1 if layout.names else 0), layout, chosen)
    for cells in islice(book.book[chosen].iter_rows(), _LINES) if rows else ():
        shown = [_shown_in(cell.number_format) if isinstance(cell.value, int | float) else "" for cell in cells]
        if any(shown):  # Excel shows 1.2 as 120 %
            pairs = zip_longest(rows[0], shown[: len(rows[0])])
            rows[0] = [f"{name} ({unit})" if unit else name for name, unit in pairs]
            break
    table = _table(rows, layout, titles[chosen])
    table.attrs["notes"] += "\n".join(f"{titles[name]}\n{_text_in(sheets[name])}" for name in sheets if name != chosen)
    return table


def _cells(sheet: Any) -> list[list[Any]]:
    """The rows of a sheet up to the last that is filled, an error such as #DIV/0! as its text."""
    frame = pd.DataFrame([*sheet.iter_rows(values_only=True)], dtype=object)
    rows, columns = (int(np.flatnonzero(frame.notna().any(axis=axis)).max(initial=-1)) + 1 for axis in (1, 0))
    return frame.iloc[:rows, :columns].to_numpy().tolist()


def _flag_coloured(rows: list[list[Any]], coloured: Iterable[int]) -> None:
    """Add a column of flags if a few rows have a colour of their own, of which no other column is the reason."""
    marked = {n for n in coloured if n < len(rows) and not all(map(is_missing, rows[n]))}
    if not 0 < 4 * len(marked) < len(rows):
        return
    for cells in zip(*rows, strict=True):
        kinds = {str(cells[n]) for n in marked}
        others = {str(cells[n]) for n in range(1, len(rows)) if n not in marked}
        if len(kinds) == 1 and kinds.isdisjoint(others) and (len(marked) > 1 or len(others) == 1):
            return
    for n, row in enumerate(rows):
        row.append("flag by colour" if n == 0 else "1" if n in marked else "")


def _fill_merged(rows: list[list[Any]], spans: Iterable[str], row_of_first: int, layout: Layout, sheet: str) -> None:
    """Write what merged cells hold into each of their rows; an amplitude cannot be that of several trials."""
    names = [*layout.names] or [str(name).strip() for name in rows[0]] if rows else []
    for span in spans:
        column, first, _, last = library("openpyxl.utils", "import").range_boundaries(span)
        column, first, last = column - 1, first - row_of_first, last - row_of_first
        if not (0 if layout.names else 1) <= first < min(last, len(rows)) or column >= len(names):
            continue  # beside each other, or not in the table
        name = names[column]
        if name == layout.columns.get("mep") or letters(name) in COLUMNS["mep"]:
            what, remedy = f"an amplitude of the sheet {sheet!r} is merged over several rows", "Write each row's own."
            raise InvalidValueError(what, got=rows[first][column], remedy=remedy)
        for row in rows[first + 1 : last + 1]:
            row[column] = rows[first][column]


def _require_whole(book: Any, sheet: str, head: int) -> tuple[list[str], list[int]]:
    """Which cells are merged, and which rows below a head are coloured; raise if Excel shows some not as they are."""
    with book[sheet]._get_source() as file:  # noqa: SLF001 - openpyxl does not read it in another way, row by row
        content = file.read()
    notes = (book._archive.read(name) for name in book._archive.namelist() if "comment" in name)  # noqa: SLF001 - the same
    said = ((row, "".join(_TEXT.findall(note.decode()))) for row, note in _NOTE.findall(b"".join(notes)))
    left_out = "|".join(row.decode() for row, note in said if is_remark(note.rpartition(":\n")[2]))
    crossed, coloured = _styled(book, lambda font, _: font.strike), _styled(book, _is_coloured)
    noted = rf'<row [^>]*?r="({left_out})"' if left_out else "(?!)"
    for pattern, are, remedy in (
        *_SHOWN_OTHERWISE, (crossed, "crossed out", _COUNT), (noted, "with a note, as of what happened", _COUNT)
    ):  # fmt: skip
        found = dict.fromkeys(int(number) for number in re.findall(pattern.encode(), content))
        if rows := [str(row) for row in sorted(found) if row > head]:
            what = f"{counted(len(rows), 'row')} of the sheet {sheet!r} {'is' if len(rows) == 1 else 'are'} {are}"
            got = f"row {', '.join(rows[:5])}{' and others' if len(rows) > 5 else ''}"
            raise InvalidValueError(what, got=got, remedy=remedy)
    spans = [span.decode() for span in re.findall(rb'<mergeCell ref="([A-Z0-9:]+)"', content)]
    return spans, [row - head for row in map(int, re.findall(coloured.encode(), content)) if row > head]


def _styled(book: Any, are_so: Callable[[Any, Any], bool]) -> str:
    """What finds the numbers of rows in the XML of a sheet that have a cell whose font and fill are so."""
    fonts, fills = book._fonts, book._fills  # noqa: SLF001 - openpyxl does not say it in another way, row by row
    styles = [str(n) for n, one in enumerate(book._cell_styles) if are_so(fonts[one.fontId], fills[one.fillId])]  # noqa: SLF001 - the same
    return rf'<c r="[A-Z]+(\d+)" s="(?:{"|".join(styles)})"[^>/]*>' if styles else "(?!)"


def _is_coloured(font: Any, fill: Any) -> bool:
    """True if a cell is not black on white."""
    usual = {"000000", "FFFFFF", 0, 1}  # as numbers those of a theme
    shown = [font.color, fill.fgColor if fill.fill_type == "solid" else None]
    known = [one for one in shown if one is not None and one.type in {"rgb", "theme"}]
    return not usual.issuperset(one.value if one.type == "theme" else one.value[-6:] for one in known)


def _shown_in(number_format: str) -> str:
    """What Excel shows behind a number: the sign of per cent, or a unit; and that it shows a part of it."""
    if commas := re.search(r"[0#](,+)(?![0#,])", number_format):
        return f"÷{1000 ** len(commas[1])}"
    words = [word.strip() for word in re.findall(r'"([^"]*)"', number_format)]
    return "%" if "%" in number_format else next((word for word in words if unit_named(word)), "")
