"""What the text claims of its methods side by side (Fig. 4.14–4.18, 4.23–4.26), and its marks of significance."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Final

import pandas as pd

from benchmarks.dissertation.claims import Claim
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.claims import ERRORS, Found, Statement, about, between, number, share, told
from benchmarks.reduction.comparison import METHODS, WORDS, by_person, error_of_mean
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.significance import no_power, paired_tests

Table = pd.DataFrame
"""A comparison, as from `comparison.summary`."""

PF_ONLY: Final = "PF: "
"""How the names of readings of the particle filter begin."""

SIGNIFICANT: Final = 0.05


def cell(table: Table, column: str, method: str, word: str = "without") -> float:
    """One value of a comparison; NaN where it is missing."""
    rows = table[(table["method"] == NAMES[method]) & (table["accelerometer"] == word)]
    return float(rows[column].iloc[0]) if len(rows) else float("nan")


def row(table: Table, column: str, word: str = "without") -> dict[str, float]:
    """A value of all four methods."""
    return {method: cell(table, column, method, word) for method in text.METHODS}


def in_words(values: Mapping[str, float], digits: int = 2) -> str:
    """Values by method, largest first."""
    ranked = sorted(values.items(), key=lambda pair: -pair[1])
    return ", ".join(f"{NAMES[method]} {value:.{digits}f}" for method, value in ranked)


def ordered(table: Table, column: str, theirs: Mapping[str, float], word: str) -> Found:
    """Whether the methods have the text's order, strictly where it is strict."""
    ours = row(table, column, word)
    pairs = itertools.combinations(text.METHODS, 2)
    holds = all((ours[a] - ours[b]) * (theirs[a] - theirs[b]) > 0 for a, b in pairs if theirs[a] != theirs[b])
    return about(holds, in_words(ours, 0 if column == "converged %" else 2))


def numbers() -> Iterator[Statement[Table]]:
    """Every bar of Fig. 4.23–4.26."""
    for word, method in itertools.product(WORDS.values(), text.METHODS):
        name = f"{NAMES[method]} {word} accelerometer"
        n, f1, c = text.TRIALS[word][method], text.F1[word][method], text.CONVERGED[word][method]
        yield Statement(
            "Fig. 4.24, Fig. 4.14" if (method, word) == ("pf", "without") else "Fig. 4.24",
            f"{name} needs {n} trials.",
            str(n),
            lambda t, m=method, w=word, n=n: between(
                cell(t, "trials", m, w), n, _error(t, m, w), own=cell(t, "SE", m, w)
            ),
        )
        yield Statement(
            "Fig. 4.25",
            f"{name} has an F1 of {f1}.",
            str(f1),
            lambda t, m=method, w=word, f1=f1: number(cell(t, "F1: measured", m, w), f1),
        )
        yield Statement(
            "Fig. 4.26",
            f"{100 * c:.2f} % of the runs of {name} converge.",
            f"{c:.2f}",
            lambda t, m=method, w=word, c=c: _converged(t, m, w, c),
        )
    for method, r in text.CORRELATION.items():
        what = f"{NAMES[method]}'s profile correlates with the measured one by {r}."
        yield Statement("Fig. 4.23", what, str(r), lambda t, m=method, r=r: number(cell(t, "r: measured", m), r))


def their_error(method: str, word: str = "without") -> float:
    """The standard error of the text's mean trials, from the SD of Fig. 4.14–4.18 and its number of people."""
    return text.TRIALS_SEVEN[method][1] / math.sqrt(text.PEOPLE[word])


def _error(table: Table, method: str, word: str) -> float:
    """Of the difference between our mean trials and the text's."""
    return math.hypot(cell(table, "SE", method, word), their_error(method, word))


def _converged(table: Table, method: str, word: str, theirs: float) -> Found:
    """Shares of runs, each with the error of a share that is never quite 0 or 1."""
    ours, runs = cell(table, "converged %", method, word) / 100, cell(table, "sessions", method, word)
    own = _share_error(ours, runs)
    return between(ours, theirs, math.hypot(own, _share_error(theirs, text.RUNS[word])), 2, own)


def _share_error(share: float, runs: float) -> float:
    near = (share * runs + 1.0) / (runs + 2.0)
    return math.sqrt(near * (1.0 - near) / runs)


def _ratio(table: Table, first: str, second: str) -> Found:
    """How many times as many trials one method needs, with the errors of four means."""
    ours, theirs = cell(table, "trials", first) / cell(table, "trials", second), _texts_ratio(first, second)
    of_ours = [cell(table, "SE", m) / cell(table, "trials", m) for m in (first, second)]
    of_theirs = [their_error(m) / text.TRIALS["without"][m] for m in (first, second)]
    return between(ours, theirs, theirs * math.hypot(*of_ours, *of_theirs), 2, theirs * math.hypot(*of_ours))


def _texts_ratio(first: str, second: str) -> float:
    return text.TRIALS["without"][first] / text.TRIALS["without"][second]


def orders() -> Iterator[Statement[Table]]:
    """The orders of the methods, and the ratios of their trials."""
    for word in WORDS.values():
        for where, what, column, theirs in (
            ("Fig. 4.25", "F1", "F1: measured", text.F1[word]),
            ("Fig. 4.26", "convergence", "converged %", text.CONVERGED[word]),
        ):
            yield Statement(
                where,
                f"The methods' order by {what}, {word} accelerometer.",
                in_words({method: theirs[method] for method in text.METHODS}),
                lambda t, c=column, theirs=theirs, w=word: ordered(t, c, theirs, w),
            )
    yield Statement(
        "Fig. 4.23",
        "GPR correlates best, NR worst.",
        in_words(text.CORRELATION),
        lambda t: about(_best_and_worst(row(t, "r: measured")), in_words(row(t, "r: measured"))),
    )
    n = text.TRIALS["without"]
    for first, second in (("pf", "svmr"), ("svmr", "gpr"), ("gpr", "nr")):
        ratio = _texts_ratio(first, second)
        yield Statement(
            "Fig. 4.24",
            f"{NAMES[first]} needs {ratio:.2f} times as many trials as {NAMES[second]}.",
            f"{ratio:.2f}",
            lambda t, a=first, b=second: _ratio(t, a, b),
        )
    for method in text.METHODS:
        yield Statement(
            "4.4.2",
            f"The accelerometer improves {NAMES[method]}: no more trials, and no lower F1.",
            f"trials {n[method]} → {text.TRIALS['with'][method]}, "
            f"F1 {text.F1['without'][method]} → {text.F1['with'][method]}",
            lambda t, m=method: _helped(t, m),
        )


def _best_and_worst(r: Mapping[str, float]) -> bool:
    return max(r, key=r.__getitem__) == "gpr" and min(r, key=r.__getitem__) == "nr"


def _helped(table: Table, method: str) -> Found:
    trials, f1 = ([cell(table, c, method, w) for w in WORDS.values()] for c in ("trials", "F1: measured"))
    numbers = f"trials {trials[0]:.1f} → {trials[1]:.1f}, F1 {f1[0]:.2f} → {f1[1]:.2f}"
    # A wrong model may do the same with everybody: then it has no error at all.
    of_trials, of_f1 = ([max(cell(table, c, method, w), 1e-9) for w in WORDS.values()] for c in ("SE", "F1 SE"))
    fewer = (trials[0] - trials[1]) / math.hypot(*of_trials)
    better = (f1[1] - f1[0]) / math.hypot(*of_f1)
    numbers = f"{numbers} ({fewer:+.1f} and {better:+.1f} standard errors better)"
    return about(max(fewer, better) >= ERRORS and min(fewer, better) >= 0.0, numbers)


def method_claims(contexts: Mapping[str, Table]) -> list[Claim]:
    """Numbers and orders with their verdicts; readings of PF alone judge what is claimed of PF."""
    usual = {name: table for name, table in contexts.items() if not name.startswith(PF_ONLY)}
    statements = (*numbers(), *orders())
    return [told(one, contexts if "PF" in one.what or "order" in one.what else usual) for one in statements]


def sweep_claims(rows: pd.DataFrame) -> list[Claim]:
    """What is claimed of the conventional sweep, from the sessions of the base cohort."""
    sweep = rows[(rows["method"] == "incremental") & ~rows["accelerometer"]]
    pf = rows[(rows["method"] == "pf") & ~rows["accelerometer"]]["trials"].mean()
    ratio = _texts_ratio("incremental", "pf")
    columns = {
        "a sweep until the window was passed": "trials",
        "stops inside the measured window alone": "inside measured",
    }
    readings = {name: (sweep[column].mean(), error_of_mean(sweep, column)) for name, column in columns.items()}
    theirs = their_error("incremental")
    statements: list[Statement[tuple[float, float]]] = [
        Statement(
            "Fig. 4.24, 4.18",
            "The conventional sweep needs 272 trials.",
            "272",
            lambda n: between(n[0], 272, math.hypot(n[1], theirs), own=n[1]),
        ),
        Statement(
            "Fig. 4.24",
            "The conventional sweep needs 1.37 times as many trials as PF.",
            f"{ratio:.2f}",
            lambda n: share(n[0] / pf, ratio),
        ),
    ]
    return [told(one, readings) for one in statements]


def star_claims(rows: pd.DataFrame) -> list[Claim]:
    """The marks of Fig. 4.23–4.25 whose pairs the text names, by paired tests of the base cohort's eleven people."""
    bare = rows[~rows["accelerometer"] & rows["method"].isin((*text.METHODS, "incremental"))]
    values = by_person(bare, "correlation, measured")[list(text.METHODS)]
    correlation = _p_values(values)
    claims = [
        _pair_claim(pair, correlation, no_power(values[pair[0]] - values[pair[1]]))
        for pair in itertools.combinations(text.METHODS, 2)
    ]
    trials = by_person(bare, "trials")
    for method in ("nr", "svmr", "gpr"):
        p = _p_values(trials)[frozenset((method, "incremental"))]
        fewer = trials[method].mean() < trials["incremental"].mean()
        look = about(fewer and p[1] < SIGNIFICANT, f"p = {p[1]:.2g}")
        what = f"{NAMES[method]} needs significantly fewer trials than the conventional sweep."
        claims.append(told(Statement("Fig. 4.24", what, "p < .05", lambda _, look=look: look), {"base": None}))
    return [*claims, *(_unreadable(where, by_person(bare, value)) for where, value in _MARKED.items())]


_MARKED: Final = {"Fig. 4.24": "trials", "Fig. 4.25": "f1, measured"}


def _p_values(values: pd.DataFrame) -> dict[frozenset[str], tuple[float, float]]:
    """Mean difference and corrected p by pair."""
    tests = paired_tests(values)
    return {frozenset((t.first, t.second)): (float(t.difference), float(t.p)) for t in tests.itertuples()}


def _pair_claim(pair: tuple[str, str], tests: Mapping[frozenset[str], tuple[float, float]], weak: str) -> Claim:
    better = next((p for p in text.SIGNIFICANT_CORRELATIONS if set(p) == set(pair)), None)
    difference, p = tests[frozenset(pair)]
    first, second = better or pair
    sign = 1.0 if (first, second) == pair else -1.0
    ours = f"{sign * difference:+.2f}, p = {p:.2g}"
    if better is None:
        what = f"{NAMES[first]} and {NAMES[second]} do not differ significantly in correlation."
        look = about(p >= SIGNIFICANT, ours, weak)
    else:
        what = f"{NAMES[first]} correlates significantly better than {NAMES[second]}."
        look = about(p < SIGNIFICANT and sign * difference > 0, ours)
    theirs = "n.s." if better is None else "p < .05"
    reason = f"here the difference is {ours}"
    return told(Statement("Fig. 4.23", what, theirs, lambda _: look, reason), {"base": None})


def _unreadable(where: str, values: pd.DataFrame) -> Claim:
    """The other marks, of which the text's words do not say to which pair they belong."""
    tests = paired_tests(values[[m for m in METHODS[:-1] if m in values]])
    ours = ", ".join(f"{NAMES[t.first]}–{NAMES[t.second]} {t.stars or 'n.s.'}" for t in tests.itertuples())
    ours = ours or "too few can be compared"
    reason = "the marks' pairs cannot be read in the copy that was used; ours stand for themselves"
    look: Statement[None] = Statement(
        where, "Marks of significance between the methods.", "* to ***", lambda _: Found(holds=False, ours=ours), reason
    )
    return told(look, {"base": None})


__all__ = ["Table", "cell", "method_claims", "star_claims", "sweep_claims", "their_error"]
