"""What may be taken for single trials of one muscle, and is not: means, per cent, several muscles, rectified EMG."""

from __future__ import annotations

import math
import re
import statistics
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from operator import itemgetter
from typing import TYPE_CHECKING, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.cells import Column, times_of
from isiw.existing.delivered import Delivered
from isiw.existing.layout import EMG_UNITS, WORDS, Layout, letters, plain, unit_in
from isiw.existing.names import MEANS, TITLES_OF_MEANS, is_remark, is_verdict, require_title, says_only, words_of
from isiw.lazy import pd
from isiw.text.sanitize import counted
from isiw.types import BoolArray, FloatArray, Reference

if TYPE_CHECKING:
    from isiw.existing.quantities import Columns

_INTENSITY: Final = re.compile(r"intensit|stärke\b|\b(mso|r?mt|output|strength|power|[ab][ -]amplitude)\b")
_NUMBER: Final = re.compile(r"[-.,]*\d[\d.,]*")
_FEW, _BELOW_AT_MOST, _BELOW = 3, 20, 50  # so many rows at most are below the trials
_SEVERAL: Final = 12  # in a table with fewer rows most may be left out
_CODE: Final = 4  # a shorter text in rows that follow may be initials
_ROWS_A_WORD, _ROWS_A_NUMBER = 4, 6  # with fewer for each a column does not tell kinds of trials from each other
_ALONE_AT_MOST: Final = 2  # so few rows without an ISI are no baseline that was measured after all pairs
_ROWS_A_PART: Final = 4  # so many trials at least have a mean below them
_SHARED: Final = 0.8
_LAST: Final = 2000  # so many rows at most are compared with those below them
_USUAL: Final = 10  # figures are what stands below trials in most files, the first half of these in nearly all
_MEASURE: Final = re.compile(r"laten[cz]|\bonset|\btemp|\biti\b|inter.?trial|\brms\b")  # or what scatters by itself
_LAST_NUMBER, _TIME = re.compile(r"(.*?)(\d+)(\D*)"), re.compile(r"\d{1,2}:\d\d|\d{4}-\d\d-\d\d")
_EVEN, _ITS_OWN = 3.0, 0.98  # steps of trials are alike within such a factor; numbers so like ISIs are the ISIs
_CHANCE: Final = 0.02  # with which single trials are hardly by chance what they seem
_NO_REMARKS: Final = WORDS["alone"] | WORDS["tap alone"] | WORDS["yes"]
_BELOW_TRIALS: Final = "Delete the rows below the trials; if these are trials, number all in a column called trial."
_IF_NO_TRIAL: Final = "Delete the row if it is a sum or a mean; what it says of trials, write into a column of theirs."
_IS_FIGURE: Final = "seems to be a mean of rows above, or an SD"
_ONE_SIDED: Final = 8.0  # a sweep has one half only if it rises from its median by so many times what it falls below


def require_single_trials(
    mep: Column, isi: Column, others: Sequence[Column], frame: pd.DataFrame, reference: Reference | None
) -> None:
    """Raise if rows are means of several trials, or relative: their column says so, a title, or what is beside them."""
    # SDs of 0 alone are of single trials that isiw exported.
    spreads = [one.name for one in others if says_only(one.name, WORDS["spreads"]) and any(one.numbers > 0)]
    numbers = [one for one in others if letters(one.name) in WORDS["numbers"]]
    counted_in = [one.name for one in numbers if 2 * len({*one.texts}) <= len(one.texts)
                  and all(text.isdigit() and int(text) > 1 for text in one.texts)]  # fmt: skip
    kinds = [one.texts for one in others if one.name != isi.name and 3 * len({*one.texts}) <= len(one.texts)]
    once = len(isi.cells) > 2 and len({*zip(isi.texts, *kinds, strict=True)}) == len(isi.cells)
    known = WORDS["spreads"] | WORDS["sums"] | WORDS["means"]
    for one in others:
        for odd in dict.fromkeys(cell for cell in one.cells if isinstance(cell, str) and says_only(cell, known)):
            if len(odd) >= _CODE or not any(cell == other == odd for cell, other in pairwise(one.cells)):
                raise one.refused(one.cells.index(odd), "is none of a trial", _IF_NO_TRIAL)
    heading = f"{mep.of}\n{frame.attrs.get('title', '')}"
    bare = [row for row, cells in enumerate(zip(mep.texts, isi.texts, strict=True)) if not any(cells)]
    below = [", ".join(cell for one in others if isinstance(cell := one.cells[row], str)) for row in bare]
    if mep.name:  # or there are sweeps beside the ISIs
        require_title("\n".join([heading, *below]), mep, reference, frame.attrs.get("notes", ""))
    title = TITLES_OF_MEANS.search(words_of(heading)) if once else None
    is_counted = bool(counted_in) and (once or re.search("sweep|averag|mep", letters(counted_in[0])))
    if title or MEANS.search(words_of(mep.name)) or (spreads and (numbers or once)) or is_counted:
        beside = (spreads or counted_in or ([title[0]] if title else []))[:1]
        what = f"the rows of {mep.of} are means of several trials, by the column "
        what += " beside ".join(map(repr, filter(None, [mep.name, *beside])))
        expected = "a row for each trial, since the scatter of single trials says how sure a window is"
        remedy = "Export the single trials; if these are, rename the column."
        raise InvalidValueError(what, expected=expected, remedy=remedy)


def require_no_summaries(columns: Columns, apart: int | None) -> None:
    """Raise if the last rows, such as those from one `apart` on, or some between parts, are figures of those above."""
    isi, mep, order = columns["isi"], columns["mep"], columns["order"]
    numbers = {row: number for row in columns.rows if (number := mep.number(row)) is not None}
    known, meps = [*numbers][-_LAST:], np.array([*numbers.values()])[-_LAST:] / mep.factor
    isis, digits = isi.numbers[known], np.array([len(mep.texts[row].partition(mep.decimal)[2]) for row in known])
    slacks = np.maximum(0.51 * 10.0**-digits, 1e-9 * np.abs(meps))
    below = next((n for n, row in enumerate(known) if apart is not None and row >= apart), len(known))
    begins = {max(below, len(known) - _BELOW), *range(max(len(known) - _BELOW_AT_MOST, _FEW), len(known))}
    for begin in sorted(begins - {len(known), *range(_FEW)}):
        finer = digits[begin] > digits[:begin].max() or np.isclose(isis[begin], np.nanmean(isis[:begin]), rtol=1e-3)
        is_own = (below == begin or finer) and meps[begin] not in meps[:begin]
        if order.text(known[begin]) or not (is_own or np.isnan(isis[begin:]).all()):
            continue
        for figures in _figures_of(meps[:begin], isis[:begin]):
            are_so = np.any(abs(figures[:, None] - meps) <= slacks, axis=0)
            by_chance = max(are_so[:begin].sum() - 2, 0.5) / begin  # two are the least and the largest
            chance = np.prod(np.where(meps[begin:] > 2 * meps[:begin].max(), _CHANCE, by_chance)[are_so[begin:]])
            chance *= _CHANCE ** (int(below == begin) + int(finer))
            if are_so[begin] and 2 * are_so[begin:].sum() > len(known) - begin and chance < _CHANCE:
                raise mep.refused(known[begin], _IS_FIGURE, _BELOW_TRIALS)
    said, most = (order, _BELOW_AT_MOST) if "order" in columns.of else (isi, _ALONE_AT_MOST * (len(known) > _SEVERAL))
    bare = [n for n, row in enumerate(known) if not said.text(row) and columns.called_alone(row) is None]
    if bare and len(known) - bare[0] == len(bare) <= most and not np.isfinite(isis[bare]).any():
        numbered = f", and no number in the column {order.name!r}," if said is order else ", and all above have one,"
        raise mep.refused(known[bare[0]], f"has no ISI{numbered} as a mean or a sum has", _BELOW_TRIALS)
    for least, are_ends in ((1, digits == digits.max(initial=0)), (2, np.isnan(isis))):  # each of its own trials
        spans = [*pairwise([-1, *np.flatnonzero(are_ends)])]
        parts = ((_figures(meps[begin + 1 : end])[:_USUAL], end) for begin, end in spans)
        agree = [(abs(figures - meps[end]) <= slacks[end]).any() for figures, end in parts]
        if least <= len(spans) < len(known) / _ROWS_A_PART and np.mean(agree) > _SHARED:
            raise mep.refused(known[spans[0][1]], _IS_FIGURE, _BELOW_TRIALS)


def _figures_of(meps: FloatArray, isis: FloatArray) -> Iterator[FloatArray]:
    """What may stand together below trials: figures of all, of pairs and of TMS alone, or the means of each ISI."""
    paired = np.isfinite(isis)
    every, *_ = kinds = [_figures(one) for one in (meps, meps[paired], meps[~paired])]
    yield np.concatenate([one[:_USUAL] for one in kinds])
    if len(meps) >= _SEVERAL:
        yield from (every[:4], every[4:7], np.concatenate(kinds))
    yield np.array([float(meps[isis == isi].mean()) for isi in np.unique(isis[paired])[:_BELOW_AT_MOST]])


def _figures(values: FloatArray) -> FloatArray:
    """What stands below numbers, the most usual first: mean, SD, the least and the largest."""
    if len(values) < 2:
        return np.empty(0)
    mean, sds = float(np.mean(values)), np.array([np.std(values, ddof=one) for one in (0, 1)])
    geometric = np.exp(np.log(values[values > 0]).mean()) if (values > 0).any() else 0.0
    quarters = [*np.quantile(values, [0.25, 0.75]), *statistics.quantiles(values.tolist())[::2]]
    cvs = sds / mean if mean else sds
    usual = [mean, sds[1], values.min(), values.max(), np.median(values), geometric, np.ptp(values), sds[0]]
    sems = sds / len(values) ** 0.5
    return np.array([*usual, *sems, *quarters, values.sum(), len(values), *sds**2, *cvs, *(100 * cvs)])


def require_short(delivered: Delivered, layout: Layout) -> None:
    """Raise if most ISIs are longer than those after which the effect of a tap is sought."""
    usual_ms = statistics.median(trial.isi_ms for trial in delivered.trials if trial.isi_ms is not None)
    if usual_ms > layout.longest_isi_ms:
        what = f"the ISIs of {delivered.source} are longer than those of paired stimulation"
        got, expected = f"{usual_ms:g} ms in the median", f"at most {layout.longest_isi_ms:g} ms"
        remedy = "Are they in another unit (--unit), or numbers of samples, or times between trials? If they are "
        remedy += "right, write longest_isi_ms = NUMBER into a layout."
        raise InvalidValueError(what, got=got, expected=expected, remedy=remedy)


def is_rectified(sweeps: Sequence[FloatArray]) -> list[str]:
    """A sentence, if EMG has one half only: it rises from its level at rest, or falls, whatever that level is."""
    known = [sweep for sweep in sweeps if sweep.size and np.isfinite(sweep).all()]
    largest = sorted(known, key=lambda sweep: float(np.ptp(sweep)))[len(known) // 2 :]
    halves = [sorted((sweep.max() - np.median(sweep), np.median(sweep) - sweep.min())) for sweep in largest]
    if not known or sum(more > _ONE_SIDED * less for less, more in halves) < _SHARED * len(largest):
        return []
    said = "The EMG has no negative half, or no other, as if it was rectified: amplitudes are about half of those from"
    return [f"{said} peak to peak. Choose the channel that was not rectified, if there is one."]


def require_one_kind_each(columns: Columns) -> None:
    """Raise if rows are not of one person's single trials of one muscle, in their order and in one unit."""
    for doubt in (_require_ascending, _require_unnumbered, _require_said, _require_no_remarks, _require_one_kind,
                  _require_one_intensity):  # fmt: skip
        doubt(columns)


def require_codes(columns: Columns) -> None:
    """Raise if a row has no code of a person and others have, or a code NA that may be initials, or stand for none."""
    subject = columns["subject"]
    texts = {row: subject.text(row) for row in columns.rows}
    others = {text for text in texts.values() if text.upper() not in {"", "NA"}}
    initials = all(re.fullmatch(r"[A-Za-zÄÖÜäöü]{2,3}", one) for one in others)
    for row, text in texts.items():
        if text.upper() == "NA" and others and not initials:
            remedy = "If NA is a person's code, write another one, such as N.A.; if the code is missing, fill it in."
            raise subject.refused(row, "may be a code, or stand for none", remedy)
    if empty := [row for row, text in texts.items() if not text and any(texts.values())]:
        raise subject.refused(empty[0], "is empty", "Write the person's code into each row.")


def require_no_parts(columns: Columns, empty: Iterable[int]) -> None:
    """Raise if a row between trials has a word and no numbers, as a title has of the rows below it."""
    every = [*columns.of.values(), *columns.beside.values()]
    for row in (row for row in empty if columns.rows[0] < row < columns.rows[-1]):
        said = [column for column in every if column.texts[row]]
        of_trials = {said[0].texts[one] for one in columns.rows} - {""} if len(said) == 1 else {"more"}
        if all(map(_NUMBER.fullmatch, of_trials)) and not _NUMBER.fullmatch(said[0].texts[row]):
            remedy = "If what is below is of another muscle, person or block, write that into a column of each row; if "
            raise said[0].refused(row, "has a word and no trial, as a title has", f"{remedy}not, delete the row.")


def _require_ascending(columns: Columns) -> None:
    """Raise if rows are not in the order of delivery, on which drift and the start depend, or a block comes back."""
    block, seen = columns["block"], set[str]()
    for text, rows in groupby(columns.rows, block.text):
        if text and text in seen:
            remedy = f'If it tells muscles apart, say --where "{block.name}={text}"; if all belong together'
            block.doubt("comes back after another block", text, remedy, row=next(rows))
        seen.add(text)
    numbers = [int(text) for row in columns.rows if (text := block.text(row)).isdecimal()]
    if numbers != sorted(numbers):
        block.doubt("does not ascend", None, "Sort the rows as the trials were delivered; if they are")
    if (order := columns.of.get("order") or columns.of.get("date")) is None:
        return
    order = replace(order, decimal=columns["isi"].decimal)
    known = {row: text for row in columns.rows if (text := order.text(row))}
    odd = [row for row, text in known.items() if order.name == columns["date"].name or not _NUMBER.fullmatch(text)]
    if 0 < len(odd) < len(known):
        raise order.refused(odd[0], "is none of a trial", _IF_NO_TRIAL)
    places = times_of([*known.values()]) if odd else [order.number(row) or 0.0 for row in known]  # of the day, perhaps
    in_blocks = [[*each] for _, each in groupby(zip(map(block.text, known), places, strict=False), itemgetter(0))]
    if any(each != sorted(each) for each in in_blocks):
        what = f"the rows of {order.of} are not in the order of its column {order.name!r}"
        remedy = "Sort them as the trials were delivered, or name the column that says so: --column order=NAME; if it "
        remedy += "begins again, as at midnight or with each block, add a column called date or block that says so."
        raise InvalidValueError(what, remedy=remedy)
    twice = [place for each in in_blocks for (_, before), (_, place) in pairwise(each) if before == place]
    if "order" in columns.of and not odd and twice:
        what = f"a trial has two rows and more in {order.of}, by its column {order.name!r}"
        remedy = 'Leave one row for each trial, such as that of a muscle: --where "muscle=FCR"; or say --column '
        remedy += "subject=NAME of people, or --column block=NAME of blocks."
        raise InvalidValueError(what, got=f"{twice[0]:g}", remedy=remedy)


def _require_unnumbered(columns: Columns) -> None:
    """Raise if a column of which nothing is read has numbers as even as those of trials, or times, out of order."""
    rows, isis = columns.rows, columns["isi"].numbers[columns.rows]
    is_known = {"order", "date"} & columns.of.keys() or len(rows) < _SEVERAL
    for column in () if is_known else columns.beside.values():
        texts, places = [column.text(row) for row in rows], column.numbers[rows]
        named = [found.groups() for text in texts if (found := _LAST_NUMBER.fullmatch(text))]
        if all(map(_TIME.match, texts)):
            places = np.array(times_of(texts) or [np.nan] * 2)
        elif not np.isfinite(places).any() and len(named) == len(texts) and len({one[::2] for one in named}) == 1:
            places = np.array([float(number) for _, number, _ in named])
        steps = np.diff(np.sort(places, axis=None))
        if not (np.isfinite(steps).all() and np.quantile(steps, 0.1) * _EVEN > np.quantile(steps, 0.9)):
            continue
        known = np.isfinite(isis)
        if (np.diff(places) < 0).any() and not abs(np.corrcoef(places[known], isis[known])[0, 1]) > _ITS_OWN:
            remedy = "Sort the rows as the trials were delivered; if it says something else"
            column.doubt("seems to number the trials, in another order than their rows", texts[0], remedy)


def _require_said(columns: Columns) -> None:
    """Raise if it is not stated what rows without an ISI are, or if a row is both a pair and TMS alone."""
    isi, condition, paired = columns["isi"], columns["condition"], columns.paired
    one_word = len({*map(plain, map(condition.text, columns.rows))}) == 1  # in all rows it means nothing
    for row in paired if columns.layout.alone is None else ():
        if (by := columns.called_alone(row)) is not None and not (by is condition and one_word):
            remedy = "If it is TMS alone, leave its ISI empty, or say --alone with it; if a pair, rename the column."
            raise by.refused(row, f"says TMS alone, and the ISI there is {isi.text(row)}", remedy)
    once = [number for row in paired if (number := isi.number(row)) is not None]
    if 2 * len(once) <= len(columns.rows) and len(once) > _FEW and once == sorted({*once}):  # as in the first row alone
        remedy = "Write each row's own; if it is TMS alone, write that there, or number all in a column called trial."
        bare = next((row for row in columns.rows if not isi.text(row) and "order" not in columns.of), None)
        if bare is not None and columns.called_alone(bare) is None:
            raise isi.refused(bare, "is empty, as if the ISI above held for it, too", remedy)
    of_alone = {isi.text(row) for row in {*columns.rows} - {*paired}} - {""}
    unsaid = [row for row in paired if not condition.text(row) and isi.text(row) in of_alone]
    if unsaid and condition.name:  # such as a word that stands in the first row of each block alone
        remedy = f"Write into each row what it is; if all with it are TMS alone, say --alone {isi.text(unsaid[0])}."
        raise condition.refused(unsaid[0], "is empty, and the ISI there is that of TMS alone", remedy)
    flags, lost = columns[columns.flags], sum(columns.lost(row) is not None for row in columns.rows)
    if len(columns.rows) >= _SEVERAL and 2 * lost > len(columns.rows):
        remedy = f'If yes leaves a trial out, say --column "exclude={flags.name}"; if no does, --column '
        flags.doubt("leaves out most trials", f"{lost} of {len(columns.rows)}", f'{remedy}"status={flags.name}"; if so')
    said = [columns["status"].flag(row) for row in columns.rows if "status" in columns.of]
    if {*said} == {None, True}:
        row = columns.rows[said.index(None)]
        remedy = f'Write yes or no into each row; if empty is no, say --column "status={columns["status"].name}".'
        raise columns["status"].refused(row, "is empty, and others say yes", remedy)
    empty = [row for row in paired if not isi.text(row) and not columns.tap_alone(row) and columns.lost(row) is None]
    empty = [row for row in empty if "mep" not in columns.of or columns["mep"].number(row) is not None]
    if empty and "asked" not in columns.of:
        what = f"{counted(len(empty), 'row has', 'rows have')} an amplitude and no ISI in {isi.of}"
        remedy = "If these are TMS alone, say --alone with what stands in their place, or --alone '' for an empty "
        remedy += "cell; if not, write their ISIs, or mark them in a column called exclude."
        raise InvalidValueError(what, got=f"row {empty[0] + 1}", remedy=remedy)


def _require_one_kind(columns: Columns) -> None:
    """Raise if an unused column has several values at each ISI, as one of muscles, people, sides or conditions has."""
    isi = columns["isi"]
    by_isi = sorted((number, row) for row in columns.paired if (number := isi.number(row)) is not None)
    block = columns["block"]
    of_words = {block.name: block} if any(re.fullmatch(r"(?![IVX]+$)\D{2,}", text) for text in block.texts) else {}
    for name, column in {**columns.beside, **of_words}.items() if by_isi else ():
        texts = {row: column.text(row).casefold() for _, row in by_isi}
        alone = [row for row, text in texts.items() if " " in plain(text) and plain(text) in WORDS["alone"]]
        if alone and len({*texts.values()}) > 1:
            remedy = f'Say --column "condition={name}"; if these are pairs'
            column.doubt("says TMS alone, and nothing is read of it", None, remedy, row=alone[0])
        said = np.array([texts[row] in WORDS["yes"] for _, row in by_isi])
        if {*texts.values()} <= {"", *WORDS["yes"], *WORDS["no"]} and _are_flags(said, by_isi):
            remedy = f'If yes leaves a trial out, say --column "exclude={name}"; if no does, --column "status={name}"; '
            remedy += "if all are to be analysed together"
            column.doubt("says yes or no of each pair, and nothing is read of it", None, remedy)
        if kinds := kinds_at_each(by_isi, column):
            few = ", ".join(kinds[:3]) + (f" and {counted(len(kinds) - 3, 'other')}" if len(kinds) > 3 else "")
            remedy = f'Say --where "{name}={kinds[0]}" for one of them, or --column "subject={name}" if they are '
            remedy += "people; if one is TMS alone, write that in place of its ISIs; if all are to be analysed together"
            column.doubt("has several values at each ISI, and nothing is read of it", few, remedy)


def _require_no_remarks(columns: Columns) -> None:
    """Raise if a row has a verdict in a column that nothing else is read of, or a remark where most rows have none."""
    rows = columns.rows
    for column in (*columns.beside.values(), columns["condition"]):
        times = Counter(map(column.text, rows))
        usual, is_other = max(times, key=lambda text: times[text]), column is columns["condition"]
        remarks = {text for text in times if is_remark(text) and plain(text) not in _NO_REMARKS}
        told = [row for row in rows if column.text(row) in remarks]
        is_other |= usual in remarks or bool(_NUMBER.fullmatch(usual)) or told == rows[:1] or 2 * len(told) > len(rows)
        if is_other:  # it is of all trials, or tells kinds apart
            told = [row for row in told if is_verdict(column.text(row))]
        if told:
            remedy = "Mark such rows in a column called exclude; if they count"
            column.doubt("may say that the trial does not count", None, remedy, row=told[0])


def _seldom_states(by_isi: Sequence[tuple[float, int]], column: Column) -> list[str]:
    """Two or three numbers, or words of all, of which one is seldom, and not of a range of ISIs, as a state may be."""
    texts = [column.text(row) for _, row in by_isi]
    times = Counter(filter(None, texts))
    are_states = all(texts) or all(re.fullmatch(r"\d", text) for text in times)
    if len(times) not in {2, 3} or not are_states or len({bool(_NUMBER.fullmatch(text)) for text in times}) > 1:
        return []
    said = np.array(texts) == min(times, key=lambda text: times[text])
    isis_ms = np.array([isi_ms for isi_ms, _ in by_isi])
    shared = np.isin(isis_ms[~said], isis_ms[said]).any() or np.unique(isis_ms).size == isis_ms.size
    has_isis = np.unique(isis_ms[said]).size > 1  # or it stands for one
    has_isis |= bool(shared and min(times.values()) < _FEW <= len(texts) / 4)
    return [*times] if has_isis and _are_flags(said, by_isi) and not _counts_again(column, by_isi) else []


def _are_flags(said: BoolArray, by_isi: Sequence[tuple[float, int]]) -> bool:
    """True if yes and no are not of a range of several ISIs, as of those with a response."""
    if said.all() or not said.any():
        return False
    isis_ms = np.array([isi_ms for isi_ms, _ in by_isi])
    is_range = np.count_nonzero(np.diff(said)) <= 2 and min(said.sum(), (~said).sum()) >= _FEW
    times = sorted((np.unique(own, return_counts=True)[1] for own in (isis_ms[said], isis_ms[~said])), key=len)
    is_mark = len(times[0]) == 1 and times[0][0] >= 2 * max(times[1])  # of an ISI that stands for something
    return bool(is_mark or not is_range)


def kinds_at_each(by_isi: Sequence[tuple[float, int]], column: Column) -> list[str]:
    """The values of a column, if several of them come at each of the ISIs of some rows, ascending."""
    texts = [text for _, row in by_isi if (text := column.text(row))]
    are_words = not any(map(_NUMBER.fullmatch, texts))
    kinds = {text: count for text, count in Counter(texts).items() if count >= _ROWS_A_WORD or not are_words}
    if len(kinds) < 2 or sum(kinds.values()) < _SHARED * len(by_isi):
        return _seldom_states(by_isi, column)
    unit, is_known = unit_in(column.name), _MEASURE.search(words_of(column.name))
    is_measure = unit in EMG_UNITS or is_known or (len(kinds) > _FEW and (unit or not all(map(str.isdigit, kinds))))
    if not are_words and (is_measure or len(kinds) > len(by_isi) / _ROWS_A_NUMBER or _counts_again(column, by_isi)):
        return []
    usual = min(kinds.values()) if are_words else len(texts) / len(kinds)
    size = min(math.ceil(4 * len(texts) / usual), len(texts) // 2)
    bins = [texts[first : first + size] for first in range(0, len(texts) - size + 1, size)]
    shares = [len(kinds.keys() & {*each}) / len(kinds) for each in bins]
    several = sum(shares if are_words else (share == 1 for share in shares)) >= _SHARED * len(bins)
    return [*kinds] if several else _seldom_states(by_isi, column)


def _counts_again(column: Column, by_isi: Sequence[tuple[float, int]]) -> bool:
    """True if a column counts each ISI's repetitions, in an order of ISIs in which people or muscles have no rows."""
    each = [[column.text(row) for _, row in rows] for _, rows in groupby(by_isi, itemgetter(0))]
    if not all(texts == [str(n) for n in range(1, len(texts) + 1)] for texts in each):
        return False
    numbers = [int(column.text(row)) for row in sorted(row for _, row in by_isi)]
    return any(after not in {before, before + 1, 1} for before, after in pairwise(numbers))


def _require_one_intensity(columns: Columns) -> None:
    """Raise if TMS alone had other intensities than pairs by a column that is not used, so that it is no baseline."""
    for name, column in columns.beside.items():
        rows = columns.rows if _INTENSITY.search(words_of(name)) else ()
        of_pairs = {text: None for row in columns.paired if rows and (text := column.text(row))}
        others = dict.fromkeys(text for row in rows if (text := column.text(row)) not in {"", *of_pairs})
        if of_pairs and others:
            remedy = f'Say --where "{name}={next(iter(of_pairs))}", or name a column in % of the resting motor '
            remedy += "threshold by --column intensity=NAME; to analyse all"
            column.doubt("says other intensities of TMS alone than of pairs", ", ".join([*others][:5]), remedy)
