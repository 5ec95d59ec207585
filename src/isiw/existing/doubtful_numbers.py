"""What the numbers of a table say themselves: codes, marks, two units, columns and rows that come twice."""

from __future__ import annotations

import math
import re
from collections import Counter
from itertools import combinations, groupby, product
from typing import TYPE_CHECKING, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.delivered import LONGEST_ISI_MS
from isiw.existing.layout import COLUMNS, EMG_UNITS, letters, unit_in
from isiw.existing.names import RELATIVE, WHOLE, words_of
from isiw.findings import AMPLITUDE_MV
from isiw.types import FloatArray

if TYPE_CHECKING:
    from isiw.existing.quantities import Columns

_POSSIBLE: Final = {"isi": (1.0, LONGEST_ISI_MS), "mep": (AMPLITUDE_MV.least, AMPLITUDE_MV.most)}  # [ms], [mV]
_FINE, _COARSE = 1e-3, 3e-3  # a mean of rounded numbers is hardly by chance so near to 1; one whose name has no unit
_HALF: Final = (
    r"\b(peak|trough|valley|pos(itive?)?|neg(ative?)?|min(imum)?|max(imum)?|[np][12]|spitze|tal|pic|pico|picco)\b"
)
_OF_REST: Final = (  # what says of EMG that it is no MEP, or of a number that it is another measure
    r"backgr|noise|base|rest|\bpre|rms|hintergrund|rausch|bruit|fond|ruido|rumore|ruis|area|auc|fläche|laten[cz]|\bsd\b"
)
_WITH, _ITS_HALF, _EXACT = 0.8, 0.7, 0.02  # halves correlate so with amplitudes, and are seldom a larger share of them
_ORDERED, _LEAST_SD = 0.25, 0.02  # of a table of means most ISIs ascend; the least SD of MEPs, as a share of them
_FEW, _FEWEST = 3, 12  # in a table with fewer rows ISIs may come again by chance
_LONG_BEFORE_MS: Final = 50.0  # no pulse is given so long before the tap
_NO_MEP: Final = {"none", "n.d.", "k.a.", "-", "--", "–", "—", ".", "?"}  # in an amplitude's place
_LOGS, _LOG_CV = ((1.0, 12.0), (25.0, 90.0)), 0.3  # logarithms of µV are among these, or in dB, and scatter so little
_NEAR_MS, _ALIKE = (1.0, 25.0), 0.98  # so far from each other are ISIs that were asked and measured, and so alike


def require_plain_numbers(columns: Columns) -> None:
    """Raise if the numbers of ISIs and amplitudes seem to be something else, in two units, or of each row twice."""
    for doubt in (_require_one_unit, require_plain_isis, _require_one_row_each, _require_no_spread, _require_whole,
                  _require_absolute, _require_uncut):  # fmt: skip
        doubt(columns)


def require_plain_isis(columns: Columns) -> None:
    """The same of ISIs, whether amplitudes or sweeps are beside them."""
    for doubt in (_require_isis, _require_no_codes, _require_one_column_each):
        doubt(columns)


def _require_isis(columns: Columns) -> None:
    """Raise if one number among the ISIs is so frequent, or so far from the others, that it may stand for TMS alone."""
    isi, paired = columns["isi"], columns.paired
    isis_ms = [isi.number(row) for row in paired]
    before = [isi_ms for isi_ms in isis_ms if (isi_ms or 0.0) < 0]
    if len({*before}) > 1 and 2 * len(before) > len(paired) > 2:
        remedy = "If the tap came first, write them without the sign; if not, so that these trials do not count"
        why, got = "has most ISIs below 0, as if the pulse came before the tap", f"{len(before)} of {len(paired)}"
        isi.doubt(why, got, remedy)
    if columns.layout.alone is not None or len(paired) < len(columns.rows):
        return
    times = Counter(isi_ms for isi_ms in isis_ms if isi_ms is not None)
    for odd in {min(times, default=0.0), max(times, default=0.0)}:
        others = {isi_ms: count for isi_ms, count in times.items() if isi_ms != odd}
        if len(others) < 2 or (times[odd] < 3 and odd <= max(499.0, 3 * max(others))):
            continue
        if times[odd] < 3:
            isi.doubt(
                "is far longer than all others", None, "Correct it; if it is right", row=paired[isis_ms.index(odd)]
            )
            continue
        apart = odd <= 0 or odd > 2 * max(others)
        strange = odd in {-1, -9, 99, 999} or odd > max(499.0, 2 * max(others))
        strange |= odd < -_LONG_BEFORE_MS and len({*before}) == 1
        usual = max(others.values())
        strange |= apart and (times[odd] >= min(2 * usual, max(1.5 * usual, usual + _FEW)) or _is_named(columns, odd))
        strange |= times[odd] >= 2 * _FEW > 2 * usual and len(others) >= _FEWEST
        if strange:
            what = f"{times[odd]} rows of {isi.of} have the ISI {odd:g} ms, which may stand for TMS alone"
            remedy = f"Say --alone {odd / isi.factor:g} if they are TMS alone; if they are pairs, say --alone never."
            raise InvalidValueError(what, expected="what an ISI is, and what is TMS alone", remedy=remedy)


def _is_named(columns: Columns, isi_ms: float) -> bool:
    """True if a column has a word or two, or one of two numbers, for the rows with one ISI that no other row has."""
    of_isi = {row for row in columns.rows if columns["isi"].number(row) == isi_ms}
    for column in (*columns.beside.values(), columns["block"]):
        words = {column.text(row) for row in of_isi}
        others = {column.text(row) for row in {*columns.rows} - of_isi}
        is_kind = len(words | others) == 2 or not any(map(str.isdigit, words))
        if 2 * len(words) <= len(of_isi) and words.isdisjoint(others) and is_kind:
            return True
    return False


def _require_no_codes(columns: Columns) -> None:
    """Raise if ISIs or amplitudes are 1, 2, 3 and so on, or amplitudes one or two numbers, such as yes and no."""
    for key, rows in (("isi", columns.paired), ("mep", columns.rows)):
        column, numbers = columns[key], columns[key].numbers[rows]
        numbers = numbers[np.isfinite(numbers)]
        kinds = np.unique(numbers).tolist()
        counts = len(kinds) > 2 and kinds in ([*range(len(kinds))], [*range(1, len(kinds) + 1)])
        are_codes = counts and ("order" not in columns.of or len(numbers) >= 2 * len(kinds))  # or numbers of rows
        are_codes |= key == "mep" and len(kinds) < 3 and kinds != [0.0]
        if are_codes and len(numbers) >= _FEWEST:
            remedy = "Write what they stand for, or name the column of the numbers themselves: --column "
            got = ", ".join(f"{kind:g}" for kind in kinds[:5])
            column.doubt("seems to have codes", got, f"{remedy}{key}=NAME; if these are")


def _require_one_column_each(columns: Columns) -> None:
    """Raise if an unused column has nearly the same ISIs, or further ones beside them, such as isi2 beside mep2."""
    isi, mep, rows = columns["isi"], columns["mep"], columns.paired
    isis, once = isi.numbers[rows], len({isi.text(row) for row in rows}) == len(rows)
    stems = {name: letters(name).rstrip("0123456789") for name in (isi.name, mep.name, *columns.beside)}
    stems = {name: stem if len(stem) > 1 else "" for name, stem in stems.items()}  # such as a, b and c
    a_row_each = once and list(stems.values()).count(stems[mep.name]) > 2  # or else MEP2 is that of another muscle
    alike = [isi.name, *([mep.name] if a_row_each and mep.name else [])]
    is_stated = bool(columns.layout.columns.keys() & {"isi", "asked"}) or "asked" in columns.of
    for name, column in columns.beside.items() if len({*isis.tolist()}) > _FEW else ():
        others = column.numbers[rows]
        off_ms = abs(isi.factor * float(np.median(others - isis)))
        is_near = _NEAR_MS[0] < off_ms < _NEAR_MS[1] and np.ptp(others) > 0 and np.corrcoef(isis, others)[0, 1] > _ALIKE
        is_further = stems[name] in map(stems.get, alike) and np.isfinite(others).any()
        if is_further or (is_near and not is_stated):
            remedy = "If they are further trials, write a row for each; if both are of the same trials, say --column "
            remedy += "isi=NAME with the ISIs that were measured; if it is something else"
            column.doubt(f"is like {' or '.join(alike)}, and is not read", None, remedy)


def _require_one_unit(columns: Columns) -> None:
    """Raise if some numbers cannot be what they are, are about a thousand times the others, and none lies between."""
    mep = columns["mep"]
    coded = [row for row in columns.rows if mep.numbers[row] in {99, 999, 9999}]
    words = {row: cell.strip() for row in columns.rows if isinstance(cell := mep.cells[row], str)}
    said = [row for row, word in words.items() if word.casefold() in _NO_MEP and word != "None"]
    said = [row for row in said if columns.lost(row) is None and not columns.tap_alone(row)]
    if said:
        remedy = f"{mep.remedy} If all such trials are lost"
        mep.doubt("may say that there was no MEP, or that it is not known", None, remedy, row=said[0])
    others = [number for row in {*columns.rows} - {*coded} if (number := mep.number(row)) is not None]
    are_apart = bool(coded) and (mep.number(coded[0]) or 0.0) > 2 * max(others, default=np.inf)
    if (len(coded) >= _FEW or are_apart) and len({mep.text(row) for row in coded}) == 1:
        mep.doubt("may stand for no amplitude", None, "If it does, leave these cells empty; if not", row=coded[0])
    for key, (least, most) in _POSSIBLE.items():
        column = columns[key]
        numbers = np.sort([number for row in columns.paired if (number := column.number(row)) and number > 0])
        apart = int(np.argmax(np.diff(np.log(numbers)))) + 1 if len(numbers) > 2 * _FEW else 0
        low, high = numbers[:apart], numbers[apart:]
        if min(len(low), len(high)) < _FEW or not (low[-1] < least or high[0] > most) or high[0] < 8 * low[-1]:
            continue
        if 300 < np.median(high) / np.median(low) < 3000:
            got = f"{len(low)} up to {low[-1] / column.factor:g} and {len(high)} from {high[0] / column.factor:g} on"
            raise column.doubted("seems to be in two units", got, "Write all of them in one.")


def _require_absolute(columns: Columns) -> None:
    """Raise if amplitudes seem to be parts of a mean or of the largest, which is then just 1, or 100 per cent."""
    mep, alone, odd = columns["mep"], {*columns.rows} - {*columns.paired}, dict[str, tuple[float, float, float]]()
    rows = [row for row in columns.rows if mep.number(row) and columns.lost(row) is None and not columns.tap_alone(row)]
    step = 10.0 ** -max((len(mep.texts[row].replace(",", ".").partition(".")[2]) for row in rows), default=0)
    if len(rows) < _FEW:
        return
    if (of_alone := mep.numbers[[row for row in rows if row in alone]]).size:
        by_mean = 0.0 if of_alone.size >= _FEW and np.ptp(of_alone) == 0 else step / of_alone.size**0.5
        most = _COARSE if columns.layout.unit_of(EMG_UNITS) else _FINE
        odd["mean of TMS alone"] = float(of_alone.mean()), by_mean, most
        odd["median of TMS alone"] = float(np.median(of_alone)), step, _FINE
    of_all = mep.numbers[rows]
    odd["mean"] = float(of_all.mean()), step / len(rows) ** 0.5, _FINE
    odd["largest"] = float(of_all.max()), step, _FINE
    remedy = "Name the column of the amplitudes themselves: --column mep=NAME; if these are"
    are_logs = any(least < of_all.min() < of_all.max() < most for least, most in _LOGS)
    if are_logs and of_all.std() < _LOG_CV * of_all.mean() and len(rows) >= _FEWEST:
        mep.doubt("scatters as little as logarithms do", f"{of_all.min():g} to {of_all.max():g}", remedy)
    for (what, (number, rounded, most)), one in product(odd.items(), (1.0, 100.0)):
        if rounded <= most * one and abs(number - one) <= max(rounded if "mean" in what else 0.0, 1e-9 * one):
            expected = "peak-to-peak amplitudes in mV, µV or V"
            mep.doubt(f"seems to be relative: its {what} is {one:g}", None, remedy, expected)


def _require_uncut(columns: Columns) -> None:
    """Raise if the largest amplitude, or the smallest, comes again and again, as of a saturated amplifier."""
    mep = columns["mep"]
    rows = [row for row in columns.rows if columns.lost(row) is None and not columns.tap_alone(row)]
    times = Counter(number for row in rows if (number := mep.number(row)))
    for odd, is_what in ((max(times, default=0.0), "saturated"), (min(times, default=0.0), "below a limit")):
        usual = max((count for number, count in times.items() if number != odd), default=len(rows))
        apart = times[odd] >= _FEW and odd > 2 * max((number for number in times if number != odd), default=odd)
        if len(rows) >= _FEWEST and (times[odd] >= _FEW * usual or apart):
            remedy = "Write 0 for an MEP below the limit, and leave the cell of a saturated one empty; if all are as "
            got = f"{times[odd]} times {odd / mep.factor:g}"
            mep.doubt(f"has amplitudes that seem to be {is_what}", got, f"{remedy}they were measured")


def _require_no_spread(columns: Columns) -> None:
    """Raise if amplitudes of ISIs that ascend, each once, have beside them what may be the SDs of means."""
    isis, meps = (columns[key].numbers[columns.rows] for key in ("isi", "mep"))
    if np.unique(isis).size < max(len(isis), _FEW) or abs(np.mean(np.diff(isis) > 0) - 0.5) < _ORDERED:
        return
    for name, column in columns.beside.items():
        shares = column.numbers[columns.rows] / np.where(meps > 0, meps, np.nan)
        is_emg = (len(name) == 1 or unit_in(name) in {None, *EMG_UNITS}) and not re.search(_OF_REST, words_of(name))
        is_less = ((shares >= 0) & (shares < 1)).all() and np.median(shares) > _LEAST_SD
        if is_emg and is_less and 2 * len({*column.texts}) > len(isis):
            remedy = "Export the single trials; if these are, and it is something else"
            column.doubt("is a part of each amplitude, as the SD of a mean is, and ISIs come once", None, remedy)


def _require_whole(columns: Columns) -> None:
    """Raise if amplitudes seem to be halves, by the other half in a column beside them."""
    mep, halves = columns["mep"], _halves_beside(columns)
    is_whole, is_half = (re.search(pattern, words_of(mep.name)) for pattern in (WHOLE, _HALF))
    if any(np.nanmedian(np.abs(one + other - 1)) < _EXACT for one, other in combinations(halves.values(), 2)):
        return
    for name, shares in halves.items():
        too_large = np.mean(shares > 1 + _EXACT) > _EXACT or (not is_whole and np.nanmedian(shares) > _ITS_HALF)
        if too_large or (is_half and not is_whole):
            remedy = "Name the column from peak to peak: --column mep=NAME, or add one; if it is this one"
            why = f"seems to have one half of each MEP, and {name!r} beside it the other one"
            mep.doubt(why, None, remedy, "amplitudes from peak to peak")


def _halves_beside(columns: Columns) -> dict[str, FloatArray]:
    """Unused columns of halves of the same MEPs, as shares of the amplitudes; raise if one has the MEPs themselves."""
    mep, halves = columns["mep"], dict[str, FloatArray]()
    meps, is_bare = mep.numbers[columns.rows], not (unit_in(mep.name) in EMG_UNITS or "mep" in columns.layout.columns)
    for name, column in columns.beside.items():
        numbers, words = column.numbers[columns.rows], words_of(name)
        shares = np.abs(numbers) / np.where(meps > 0, meps, np.nan)
        if column.is_stated or mep.is_stated or (known := np.isfinite(shares)).sum() < _FEWEST:
            continue
        if is_bare and unit_in(name) in EMG_UNITS and not re.search(f"{_OF_REST}|{_HALF}|{RELATIVE}", words):
            remedy = f'Say --column "mep={name}", or --column "mep={mep.name}".'
            why = f"says a unit of amplitudes, and {mep.name!r} says none: which has the MEPs?"
            raise column.doubted(why, None, remedy)
        pair = meps[known], (shares * meps)[known]
        if not all(map(np.ptp, pair)) or np.corrcoef(*pair)[0, 1] < _WITH:
            continue
        is_whole = (re.search(WHOLE, words) or letters(name) in COLUMNS["mep"]) and not re.search(RELATIVE, words)
        if is_whole and 1.2 < np.nanmedian(shares) < 5:
            why = f"has larger amplitudes of the same trials than {mep.name!r}"
            column.doubt(why, None, f'Say --column "mep={name}"; if it is something else')
        if re.search(_HALF, words) or np.mean(numbers < 0) > _WITH:
            halves[name] = shares
    return halves


def _require_one_row_each(columns: Columns) -> None:
    """Raise if the ISIs come twice as if each trial had a row a muscle: one after the other, or all of them again."""
    isi, mep = columns["isi"], columns["mep"]
    texts, meps = ([column.text(row) for row in columns.rows] for column in (isi, mep))
    is_known = "order" in columns.of or bool(columns.layout.where) or len(texts) < _FEWEST
    few = 6 if is_known else 4  # so many trials in a row never come again
    rows = zip(*(zip(texts[n:], meps[n:], strict=False) for n in range(few)), strict=False)
    times_of_rows = Counter(each for each in rows if len({text for _, text in each}) == few)
    runs = [len([*each]) for _, each in groupby(texts)]
    times, half = math.gcd(*runs), len(texts) // 2
    are_whole = all(round(isi.number(row) or 0.0, 3).is_integer() for row in columns.paired)
    again = texts[:half] == texts[half:] and not are_whole  # as realised ISIs never do
    comes_again = (times > 1 and len(runs) > len({*texts})) or (again and len({*texts}) > 2)
    if max(times_of_rows.values(), default=0) > 1 or (comes_again and not is_known):
        why = f"is of ISIs that come {max(times, 2)} times each, as if muscles had a row each, or each row twice"
        mep.doubt(why, ", ".join(texts[: 2 * max(times, 2)]), "Leave one row for each trial; if each row is one")
