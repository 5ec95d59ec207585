"""What may be taken for single trials of one muscle, and is not: means, per cent, several muscles, rectified EMG."""

from __future__ import annotations

import re
import statistics
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.layout import Layout, letters
from isiw.text.sanitize import counted
from isiw.types import FloatArray

if TYPE_CHECKING:
    from isiw.existing.tables import Columns

ALL: Final = "*"
"""What `where` says of a column whose values are to be analysed together."""

_MEANS: Final = frozenset({"mean", "means", "average", "avg", "median", "mittel", "mittelwert", "grandmean", "moyenne"})
_SPREADS: Final = frozenset({"sd", "std", "stdev", "stddev", "se", "sem", "stderr", "cv", "sds", "stdabw",
                             "standarddeviation", "standarderror", "ci", "iqr", "var"})  # fmt: skip
_NUMBERS: Final = frozenset({"n", "count", "ntrials", "trials", "ntrial", "nobs", "nsweeps", "sweeps", "anzahl"})
_RELATIVE: Final = re.compile(
    r"%|\bper ?cent|\bpct\b|prozent|\bratio\b|\bnorm(ed|alis\w*|aliz\w*)?\b|\brel(ative|ativ)?\b|\bz[ -]?score|"
    r"\blog\d*\b",
    re.IGNORECASE,
)
_ROWS_A_KIND: Final = 6
"""With fewer rows for each of its values a column does not tell kinds of trials from each other."""
_SHARED: Final = 0.8
_ONE_SIDED: Final = 8.0
"""A sweep with an MEP that rises from its median by so many times what it falls below it has one half only."""


def _words(name: str) -> list[str]:
    return re.findall(r"[^\W_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).casefold())


def require_absolute(name: str, source: str) -> None:
    """Raise if a column's name says that its amplitudes are relative to others, whatever unit is stated."""
    if found := _RELATIVE.search(name.replace("_", " ")):
        raise InvalidValueError(
            f"the amplitudes of {source} in the column {name!r} are relative to others",
            got=found[0],
            expected="peak-to-peak amplitudes in mV, µV or V",
            remedy="Name the column that holds these: --column mep=NAME.",
        )


def require_single_trials(mep: str, isis: Sequence[object], names: Sequence[str], source: str) -> None:
    """Raise if rows are means of several trials: their column says so, or their SDs are beside them.

    Args:
        mep: the name of the column of the amplitudes.
        isis: the ISIs, as texts or numbers.
        names: the names of all columns.
        source: the table in words.
    """
    others = [name for name in names if name != mep]
    spreads = [name for name in others if re.sub("mep|amplitude|of", "", letters(name)) in _SPREADS]
    numbers = [name for name in others if letters(name) in _NUMBERS]
    said = set(_words(mep)) & _MEANS
    once = len(isis) > 2 and len(set(isis)) == len(isis)
    if said or (spreads and (numbers or once)):
        raise InvalidValueError(
            f"the rows of {source} are means of several trials, by the column {mep!r}"
            + (f" beside {spreads[0]!r}" if spreads else ""),
            expected="a row for each trial, since the scatter of single trials says how sure a window is",
            remedy="Export the single trials; if these are, rename the column.",
        )


def require_short(isis_ms: Sequence[float], layout: Layout, source: str) -> None:
    """Raise if most ISIs are longer than those after which the effect of a tap is sought."""
    usual_ms = statistics.median(isis_ms) if isis_ms else 0.0
    if usual_ms > layout.longest_isi_ms:
        raise InvalidValueError(
            f"the ISIs of {source} are longer than those of paired stimulation",
            got=f"{usual_ms:g} ms in the median",
            expected=f"at most {layout.longest_isi_ms:g} ms",
            remedy="Are they in another unit (--unit), or numbers of samples, or times between trials? If they are "
            "right, write longest_isi_ms = NUMBER into a layout.",
        )


def is_rectified(sweeps: Sequence[FloatArray]) -> list[str]:
    """A sentence, if EMG has no negative half: it only ever rises from its level at rest."""
    known = [sweep for sweep in sweeps if sweep.size and np.isfinite(sweep).all()]
    largest = sorted(known, key=lambda sweep: float(np.ptp(sweep)))[len(known) // 2 :]
    one_sided = [
        sweep.min() >= 0 and sweep.max() - np.median(sweep) > _ONE_SIDED * (np.median(sweep) - sweep.min())
        for sweep in largest
    ]
    if not known or sum(one_sided) < _SHARED * len(largest):
        return []
    said = "The EMG has no negative half, as if it was rectified: amplitudes are then about half of those from peak to"
    return [f"{said} peak. Choose the channel that was not rectified, if there is one."]


def require_codes(texts: Sequence[str], rows: Sequence[int], columns: Columns) -> None:
    """Raise if a code NA may be a person's initials, or stand for no code."""
    others = {text for text in texts if text and text.upper() != "NA"}
    if (
        others
        and len(others) < len(set(texts))
        and not all(re.fullmatch(r"[A-Za-zÄÖÜäöü]{2,3}", one) for one in others)
    ):
        first = next((n for n, text in enumerate(texts) if text.upper() == "NA"), None)
        if first is not None:
            remedy = "If NA is a person's code, write another one, such as N.A.; if the code is missing, fill it in."
            raise columns.of["subject"].refused(rows[first], "may be a code, or stand for none", remedy)


def require_one_kind(columns: Columns, rows: Sequence[int], layout: Layout, source: str) -> None:
    """Raise if an unused column has several values at each ISI, as one of muscles, people, sides or conditions has."""
    isi = columns["isi"]
    placed = [(number, row) for row in rows if not columns.tms_alone(row, layout.alone)
              and (number := isi.number(row)) is not None]  # fmt: skip
    by_isi = [row for _, row in sorted(placed)]
    for name, column in columns.beside.items():
        if name in layout.where:
            continue
        texts = [text for row in by_isi if (text := column.text(row))]
        kinds = Counter(texts)
        if not 2 <= len(kinds) <= len(by_isi) / _ROWS_A_KIND or len(texts) < 0.8 * len(by_isi):
            continue
        size = min(4 * len(kinds), len(texts) // 2)
        bins = [texts[first : first + size] for first in range(0, len(texts) - size + 1, size)]
        if sum(len({*each}) == len(kinds) for each in bins) >= _SHARED * len(bins):
            few = ", ".join(list(kinds)[:3]) + (f" and {counted(len(kinds) - 3, 'other')}" if len(kinds) > 3 else "")
            raise InvalidValueError(
                f"the column {name!r} of {source} has several values at each ISI, and nothing is read of it",
                got=few,
                remedy=f'Say --where "{name}={next(iter(kinds))}" for one of them, --where "{name}={ALL}" if all are '
                f'to be analysed together, or --column "subject={name}" if they are people.',
            )
