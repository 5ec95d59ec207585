"""What `after` and `earlier` of a configuration name: sessions, searches for the threshold, and tables of pulses."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias

from isiw.config.run import RunConfig
from isiw.errors import ConfigError
from isiw.findings import require_percent
from isiw.log.continuing import imported_sentence
from isiw.log.reader import ThresholdRecord
from isiw.log.record import SessionRecord, read_any, read_session
from isiw.log.salvage import salvage
from isiw.log.verdicts import changed_after
from isiw.session.stated import require_given
from isiw.session.threshold import search_of
from isiw.signals.plausible import require_amplitude
from isiw.strategy.threshold.curve import CurvePulses
from isiw.text.sanitize import command, counted
from isiw.trials import Status, Stimulus, Trial
from isiw.visit import different_muscles

_COLUMNS: Final = ("intensity_pct_rmt", "mep_mv")
_COUNTING: Final = frozenset({"pulse", "number", "no", "nr", "index", "trial", "time", "time_s", "date"})
"""Columns that number or date pulses, and say nothing else of them."""

_OF_MSO: Final = "From an intensity in % MSO, intensity_pct_rmt is 100 times it by the threshold in % MSO. "

_TABLES: Final = frozenset({".csv", ".tsv", ".txt", ".xlsx", ".xls"})
"""Of these text alone is read; the others are no logs either, and who names one is told so."""


_Table: TypeAlias = tuple[Path, tuple[Trial, ...]]


class Given(NamedTuple):
    """What was given before a session, as the logs and tables say that its configuration names."""

    sessions: list[SessionRecord]  # of `after`, whose windows teach a prior
    searches: list[ThresholdRecord]  # of `after`, whose pulses are earlier trials
    earlier: list[SessionRecord]  # of the same visit
    pulses: list[Trial]  # of tables

    def sentence(self, config: RunConfig) -> str:
        """That sessions were none, and that pulses of searches are learnt, in words; empty of usual sessions alone."""
        imported = [each.path.name for each in (*self.sessions, *self.earlier) if each.header.imported]
        return " ".join(filter(None, (imported_sentence(imported), _of_searches(config, self.searches))))


def given_before(config: RunConfig) -> Given:
    """Read what was given before a session.

    Raises:
        ConfigError: a search of another muscle than the visit's, one that is damaged, or none of the visit's pulses
            over the curve; a table that is none of pulses.
        LogError: a log that cannot be read.
    """
    after = [read_any(salvage(path)) for path in config.after]
    searches = [record for record in after if isinstance(record, ThresholdRecord)]
    _require_searches(config, searches)
    tables = [(path, _pulses_of_table(path)) for path in config.earlier if is_table(path)]
    _require_each_once(searches, tables)
    return Given(
        [record for record in after if isinstance(record, SessionRecord)],
        searches,
        [read_session(path) for path in config.earlier if not is_table(path)],
        [pulse for _, pulses in tables for pulse in pulses],
    )


def _require_each_once(searches: Sequence[ThresholdRecord], tables: Sequence[_Table]) -> None:
    """Raise if two tables, or a table and a log, are of the same pulses, whatever they are called."""
    same = [
        (search.path, path)
        for search, (path, pulses) in itertools.product(searches, tables)
        if [outcome.mep_mv for outcome in search.outcomes] == [pulse.mep_mv for pulse in pulses]
    ]
    same += [(path, other) for (path, pulses), (other, others) in itertools.combinations(tables, 2) if pulses == others]
    if same:
        raise ConfigError(
            "two files are of the same pulses, which would count twice",
            got=" and ".join(map(str, same[0])),
            expected="each pulse once",
            remedy="Leave one out.",
        )


def _require_searches(config: RunConfig, searches: Sequence[ThresholdRecord]) -> None:
    for record in searches:
        if record.end_lost or record.losses:
            raise ConfigError(
                "the log of the search for the threshold is damaged, so that pulses may be missing",
                got=str(record.path),
                remedy="Leave it out, and take the pulses that the stimulator has counted off limits.max_pulses.",
            )
        if muscles := different_muscles((config.visit.muscle, record.header.muscle)):
            raise ConfigError(
                "the search for the threshold is of another muscle than the visit",
                got=f"{muscles[1]} in {record.path}",
                expected=muscles[0],
                remedy="Leave this file out, or correct visit.muscle.",
            )
    _require_curve(config, searches)


def _require_curve(config: RunConfig, searches: Sequence[ThresholdRecord]) -> None:
    """Raise if the visit's pulses over the curve were not all given."""
    if config.visit.curve is None:
        return
    plan = CurvePulses(config.visit.curve.at_pct_mso, config.visit.curve.each, config.seed)
    for search in map(search_of, searches):
        if isinstance(search.method, CurvePulses) and not plan.left(search.pulses):
            return
    at = [word for intensity in plan.at_pct_mso for word in ("--at", f"{intensity:g}")]
    options = ["--method", "curve", *at, "--each", plan.each, "--seed", plan.seed]
    stated = {"--subject": config.visit.subject, "--muscle": config.visit.muscle}
    options += [word for option, value in stated.items() if value.strip() for word in (option, value)]
    by_hand = ["--by-hand", "--high", f"{max(plan.at_pct_mso):g}"] if config.own_rig else []
    raise ConfigError(
        "the visit has pulses over the recruitment curve before the pairs, and no log of all of them is given",
        got=", ".join(str(record.path) for record in searches) or "no log of a search",
        expected=f"{plan.budget} pulses at {', '.join(f'{at:g}' for at in plan.at_pct_mso)} % MSO",
        remedy=f"Give them first, and name their log with --after: {command('threshold', 'LOG', *by_hand, *options)}",
    )


def is_table(path: Path) -> bool:
    """True if a file is meant as a table of pulses, and as no log."""
    return path.suffix.lower() in _TABLES


def _pulses_of_table(path: Path) -> tuple[Trial, ...]:
    """The pulses of TMS alone in a table of intensities and amplitudes, in the order of its rows."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            head = next(file, "")
            between = next((sign for sign in ";\t" if sign in head), ",")
            names = [name.strip() for name in next(csv.reader([head], delimiter=between), [])]
            table = csv.DictReader(file, names, delimiter=between)
            rows = [row for row in table if any(row.values())]  # a spreadsheet writes empty ones below the last
    except (OSError, ValueError, csv.Error) as error:
        remedy = "Save it as CSV, in UTF-8, with commas between the columns."
        raise ConfigError("the table of pulses cannot be read", got=f"{path}: {error}", remedy=remedy) from error
    # Another column may say that a row is a pair, of another muscle, or to be left out.
    if sorted(name for name in names if name.casefold() not in _COUNTING) != sorted(_COLUMNS) or not rows:
        of_mso = _OF_MSO if any("mso" in name.casefold() for name in names) else ""
        raise ConfigError(
            "this is no table of pulses that were given before",
            got=f"the columns {', '.join(names) or 'none'} in {path}",
            expected=f"the columns {' and '.join(_COLUMNS)}, perhaps pulse or time_s, with a comma, a semicolon or a "
            "tab between, and a row for each pulse",
            remedy=f"{of_mso}Keep pulses of TMS alone that count, of the visit's muscle, and leave out other rows and "
            "columns. Trials with ISIs become a log first: isiw analyse.",
        )
    if between != ",":  # then a comma in a number is its decimal sign
        rows = [row | {name: (row[name] or "").replace(",", ".") for name in _COLUMNS} for row in rows]
    pulses = tuple(_pulse(path, number, row) for number, row in enumerate(rows))
    require_given(pulses)
    return pulses


def _pulse(path: Path, number: int, row: Mapping[str, str | None]) -> Trial:
    if None in row:  # as csv calls the cells beyond the last column
        raise ConfigError(
            f"row {number + 1} of {path} has more cells than there are columns",
            got=", ".join(f"{name} = {row[name]}" for name in _COLUMNS) + ", and more",
            remedy="Is the decimal sign a comma? Write a point.",
        )
    try:
        pct_rmt, mep_mv = (float(row[name] or "") for name in _COLUMNS)
        require_percent("the intensity", pct_rmt)
        pulse = Trial(number, Status.ACCEPTED, None, mep_mv=mep_mv, intensity_pct_rmt=pct_rmt)
        require_amplitude(mep_mv)
    except ValueError as error:
        raise ConfigError(
            f"row {number + 1} of {path} is no pulse",
            got=", ".join(f"{name} = {row[name]}" for name in _COLUMNS),
            expected="an intensity in % RMT and an amplitude in mV",
            remedy=f"Correct the row: {error}",
        ) from error
    return pulse


def _of_searches(config: RunConfig, searches: Sequence[ThresholdRecord]) -> str:
    """That pulses of searches are learnt, and what nobody has stated of them; empty if there are none."""
    if not searches:
        return ""
    said = f"{counted(sum(record.given for record in searches), 'pulse')} of the search for the threshold came before: "
    unstated = _without_muscle(config, searches)
    whose = f"of {config.visit.muscle}" if not unstated else "of the same muscle, which is not stated in " + unstated
    return f"{said}they are learnt as TMS alone, {whose}, at the same hot spot. Their level may be another one."


def _without_muscle(config: RunConfig, searches: Sequence[ThresholdRecord]) -> str:
    """Where no muscle is stated, in words; empty if it is everywhere."""
    names = [record.path.name for record in searches if not record.header.muscle.strip()]
    return ", ".join([*([] if config.visit.muscle.strip() else ["[visit]"]), *names])


class Before(NamedTuple):
    """What was given in a visit before a session: trials, and the places of those after which something changed."""

    trials: tuple[Trial, ...]
    changed_after: frozenset[int]


def before_of(record: SessionRecord, already: Sequence[Trial]) -> Before:
    """What a session's strategy had learnt at its end, and what else was given, but for what is known already."""
    header, own = record.header, sorted((*record.table, *record.unknown_trials), key=lambda trial: trial.index)
    known = sum(1 for _ in itertools.takewhile(lambda trial: trial in already, header.earlier))
    earlier, untold = header.earlier[known:], header.given_before - len(header.earlier)
    if known:
        untold = max(0, untold - sum(not trial.told for trial in already))
    lost = [Trial.unknown(Stimulus(0, None))] * untold
    noted, first = changed_after(record.events), untold + len(earlier)
    # A place of -1 is that of the last trial that is known already.
    changed = {untold + place - known for place in header.earlier_changed if place >= known - 1}
    if header.earlier and not header.earlier_same_level:
        changed.add(first - 1)
    changed |= {first + place for place, trial in enumerate(own) if trial.index in noted}
    return Before((*lost, *earlier, *own), frozenset(changed))
