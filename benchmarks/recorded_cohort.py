"""The default, and who knows the law, on people whose MEPs were recorded.

    python -m benchmarks.recorded_cohort --people 400 --seed 10000 --given 0 --out benchmarks/results/recorded_cohort

The recordings lie in no repository of ours: `--data`, or the variable ISIW_SHARED_DATA, names their folder. `--given
0,10,30,60,600` gives the default so many single pulses of the same law first, and has one who takes the law from these
and knows all else but start and width; `--known` adds the default with all that who knows the law knows besides (that
there is a window, the law of windows, form, impact and boost, and that nothing changes), but not the law; `--searched`
adds the default after a search for the motor threshold of the same law; `--fitted` adds the default with the prior that
`benchmarks.response_prior` fitted to all other persons; `--lab` adds the default with the prior that `isiw prior learn`
makes of nine earlier sessions, one of each other person. `--banks coils` draws from both curves of a coil, trials from
every second pulse and what is known from the other half. `--made-up 10` puts hands of the default's own law in the
place of who was recorded, so many pulses a level. Sessions are kept beside the result as they finish, and the same
command continues where it was interrupted. Standard errors are by bootstrap over the ten persons, each with all banks.
Seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
import re
import tempfile
import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, cast

import numpy as np
import pandas as pd
import typer
from rich.progress import Progress

import isiw
from benchmarks.earlier import logged_session
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.recorded_law import KnowsTheLaw, all_but_the_law
from benchmarks.recorded_people import Banks, RecordedPerson, RecordedResponse, banks, recordings
from benchmarks.recorded_tables import tables_of
from benchmarks.response_prior import Fit, read_folds
from benchmarks.tables import kept, write_tables
from isiw.errors import ImplausibleDataWarning
from isiw.models.particles.prior import Prior
from isiw.priors import LabPrior, learn, read_lab_prior, write_lab_prior
from isiw.studies import Failure, Processes

SPACE: Final = isiw.VALVE_SPACE
MARKS: Final = (0, 10, 15, 20, 30, 40)
LAW: Final = "who knows the law"
TOO_GOOD: Final = "law and draws from the same half (too good)"
ELSE: Final = "default that knows all but the law"
SEARCHED: Final = "default, after a search for the motor threshold"
FITTED: Final = "default, prior fitted to the other persons"
LEARNT: Final = "default, prior learnt from a session of each other person"
EARLIER_TRIALS, EARLIER_NUMBERS = 40, 100_000
"""Of an earlier session; and the number that its people begin with, whom nobody else has."""
IMPACT_SD_MS: Final = 1.0
"""How far from the truth an impact that is known may be [ms]."""

TOGETHER: Final = 5
"""Sessions that are kept in one file."""


@dataclass(frozen=True)
class RecordedSession:
    """One session with one of the cohort.

    Args:
        person: the person.
        strategy: `default`, `SEARCHED`, `ELSE`, `FITTED`, `LEARNT`, `LAW` or `TOO_GOOD`.
        given: how many single pulses are given first.
        trials: how many pairs are delivered.
        prior: the default's, of `FITTED` and `LEARNT` alone.
    """

    person: RecordedPerson
    strategy: str
    given: int
    trials: int
    prior: Prior | None = None

    @property
    def label(self) -> str:
        """What its rows are called."""
        if self.strategy == LAW and self.given:
            return f"who takes the law from {self.given} single pulses"
        return f"{self.strategy}, {self.given} single pulses first" if self.given else self.strategy

    def player(self) -> Any:
        """What asks, learns and reports, before the first pair."""
        if self.strategy in {LAW, TOO_GOOD}:
            half = "other" if self.strategy == LAW else "drawn"
            subject = self.person.subject(half)
            if self.given:
                own = cast("RecordedResponse", subject.response)
                subject = replace(subject, response=replace(own, bank=self.person.bank_of_pulses(self.given)))
            return KnowsTheLaw(subject, SPACE)
        subject = self.person.subject()
        seed = self.person.seed + self.person.number
        known: dict[str, Any] = {"hit_delay_ms": subject.stated_hit_delay_ms}
        if self.strategy == ELSE:
            known = {"hit_delay_ms": (subject.hit_delay_ms, IMPACT_SD_MS), "prior": all_but_the_law(subject)}
        elif self.prior is not None:
            known["prior"] = self.prior
        strategy = isiw.make_strategy("default", SPACE, seed, **known)
        for intensity_pct_rmt, mep_mv in self.person.single_pulses(self.given):
            strategy.tell(None, mep_mv, intensity_pct_rmt=intensity_pct_rmt)
        if self.strategy == SEARCHED:
            strategy.learn_all(self.person.searched_pulses())
        return strategy

    def rows(self) -> list[dict[str, Any]]:
        """One row a mark, each also with where the player's own stopping rule fired first."""
        subject, player = self.person.subject(), self.player()
        responder, truth = subject.begin(self.person.seed + self.person.number), subject.window(SPACE)
        rows, stop = [], dict[str, Any]()
        for trial in range(self.trials + 1):
            estimate = player.estimate()
            if trial in MARKS:
                rows.append(self._row(trial, estimate, truth))
            stopped = hasattr(player, "decision") and player.decision().stop
            if not stop and (stopped or trial == self.trials):
                stop = {"stop_pairs": trial, "stopped": stopped, "stop_f1": isiw.metrics.f1(estimate, truth, SPACE)}
            if trial < self.trials:
                response = responder.respond(player.ask(), SPACE.reference)
                player.tell(response.isi_ms, response.mep_mv)
        return [row | stop for row in rows]

    def _row(self, trial: int, estimate: isiw.WindowEstimate, truth: isiw.Window | None) -> dict[str, Any]:
        bank, covered = self.person.bank, isiw.metrics.covers(estimate, truth, SPACE)
        start, end = (np.nan, np.nan) if covered is None else map(float, covered)
        return {
            "strategy": self.label,
            "number": self.person.number,
            "person": bank.person,
            "coil": bank.coil,
            "pairs": trial,
            "f1": isiw.metrics.f1(estimate, truth, SPACE),
            "expected_f1": estimate.expected_f1,
            "start_covered": start,
            "end_covered": end,
            "true_window": truth is not None,
            "reported_window": estimate.window is not None,
            **{f"believes {name}": share for name, share in (estimate.hypotheses or {}).items()},
        }


@dataclass(frozen=True)
class Chunk:
    """Some sessions of one strategy, and the file that keeps them."""

    sessions: tuple[RecordedSession, ...]
    file: Path

    def run(self) -> pd.DataFrame:
        """Their rows, from the file if it is there."""
        return kept(self.file, self._made)

    def _made(self) -> pd.DataFrame:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ImplausibleDataWarning)
            return pd.DataFrame([row for session in self.sessions for row in session.rows()])


@dataclass(frozen=True)
class Earlier:
    """Nine earlier sessions of a lab, one of each person but one, and the file of the prior that they teach.

    Args:
        without: one with the person who is left out, of the cohort that is examined later.
        file: where the prior is kept.
    """

    without: RecordedPerson
    file: Path

    def prior(self) -> Prior:
        """The prior, from the file if it is there."""
        if not self.file.is_file():
            write_lab_prior(self._learnt(), self.file)
        return read_lab_prior(self.file).joined()

    def _learnt(self) -> LabPrior:
        seen, logs, number = {self.without.bank.person}, list[Path](), EARLIER_NUMBERS
        with tempfile.TemporaryDirectory() as folder:
            for person in sorted({bank.person for bank in banks(self.without.folder, self.without.banks)} - seen):
                while (one := replace(self.without, number=number)).bank.person != person:
                    number += 1
                subject, name, seed = one.subject(), f"P{person}", one.seed + number
                stated = subject.stated_hit_delay_ms
                logs.append(logged_session(subject, name, seed, EARLIER_TRIALS, Path(folder), stated))
            return learn(logs)


def chunks(
    people: list[RecordedPerson],
    given: list[int],
    trials: int,
    folder: Path,
    folds: Mapping[int, Fit] | None = None,
    learnt: Mapping[int, Prior] | None = None,
    *,
    known: bool = False,
    searched: bool = False,
) -> list[Chunk]:
    """All sessions: the default with so many pulses first, with fitted priors, and who knows the law, also from them.

    Where banks are split in halves there is also who knows the half that trials are drawn from.

    Args:
        people: the cohort.
        given: numbers of single pulses.
        trials: how many pairs are delivered.
        folder: where rows are kept.
        folds: the fit without each person; None for no fitted priors.
        learnt: the prior that the other persons teach; None for none.
        known: also the default that knows all but the law.
        searched: also the default after a search for the motor threshold.
    """
    plan = [("default", count) for count in given] + [(LAW, count) for count in sorted({0, *given})]
    if people[0].bank.kernel_log_sds is None:
        plan.append((TOO_GOOD, 0))
    plan += [(SEARCHED, 0)] * searched
    plan += [(ELSE, count) for count in given if known]
    plan += [(FITTED, count) for count in given if folds] + [(LEARNT, count) for count in given if learnt]
    fits = folds or {}
    priors = {FITTED: {person: fit.prior() for person, fit in fits.items()}, LEARNT: learnt or {}}
    names = {strategy: re.sub("[^a-z]+", "_", strategy) for strategy, _ in plan}
    names[FITTED] = f"fitted_{zlib.crc32(repr(fits).encode()):08x}"
    parts = [people[first : first + TOGETHER] for first in range(0, len(people), TOGETHER)]
    return [
        Chunk(
            tuple(
                RecordedSession(each, strategy, count, trials, priors.get(strategy, {}).get(each.bank.person))
                for each in part
            ),
            folder / f"{names[strategy]}-{count}-{part[0].number}-{len(part)}.parquet",
        )
        for part in parts
        for strategy, count in plan
    ]


def main(  # noqa: PLR0913, PLR0917 - options of a command line
    people: Annotated[int, typer.Option(help="Sessions of each strategy; the banks come in turn.")] = 400,
    seed: Annotated[int, typer.Option(help="Seed of windows, rigs and draws.")] = 10_000,
    given: Annotated[str, typer.Option(help="Numbers of single pulses given first, comma-separated.")] = "0",
    trials: Annotated[int, typer.Option(help="Pairs a session.")] = MARKS[-1],
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    data: Annotated[Path | None, typer.Option(help="Folder of the recordings.")] = None,
    fitted: Annotated[Path | None, typer.Option(help="JSON of benchmarks.response_prior, with its folds.")] = None,
    banks: Annotated[str, typer.Option(help="What a bank is: curves or coils.")] = "curves",
    made_up: Annotated[int | None, typer.Option(help="Pulses a level of people of the default's own law.")] = None,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("recorded_cohort"),
    *,
    known: Annotated[bool, typer.Option("--known", help="Also the default that knows all but the law.")] = False,
    searched: Annotated[
        bool, typer.Option("--searched", help="Also the default after a search for the threshold.")
    ] = False,
    lab: Annotated[bool, typer.Option("--lab", help="Also the default with a prior of nine earlier sessions.")] = False,
) -> None:
    """Compare the default with who knows the law, on recorded people."""
    data = data or recordings()
    if not data.is_dir():
        print(f"Skipped: the recordings are not at hand, {data} is no folder. Name it with --data.")
        return
    kind = cast("Banks", "coils" if made_up else banks)
    cohort = [RecordedPerson(number, seed, data, made_up, kind) for number in range(people)]
    folder = out.with_suffix(f".{seed}-{trials}-{banks}{'' if made_up is None else f'-{made_up}'}.sessions")
    folder.mkdir(parents=True, exist_ok=True)
    folds = None if fitted is None else read_folds(json.loads(fitted.read_text(encoding="utf-8")))
    counts = [int(each) for each in given.split(",")]
    first = {one.bank.person: one for one in reversed(cohort)}
    earlier = {person: Earlier(one, folder / f"lab-{person}.toml") for person, one in first.items() if lab}
    with Progress() as progress:
        priors = list(_done(progress, "earlier sessions", Earlier.prior, list(earlier.values()), workers))
        learnt = dict(zip(earlier, priors, strict=True))
        units = chunks(cohort, counts, trials, folder, folds, learnt, known=known, searched=searched)
        rows = pd.concat(_done(progress, "sessions", Chunk.run, units, workers), ignore_index=True)
    facts = facts_of("recorded_cohort", "numpy", seed=seed, sessions=people, space="valve, 0–500 ms")
    write_tables(tables_of(rows, cohort, SPACE, LAW), facts, out)
    print(out.with_suffix(".md").read_text())


def _done(
    progress: Progress, what: str, run: Callable[[Any], Any], units: Sequence[Any], workers: int
) -> Iterator[Any]:
    """What each unit of work, which has a file, comes to, in their order; it ends with the first that fails."""
    bar = progress.add_task(what, total=len(units), visible=bool(units))
    found = {}
    for unit, result in Processes(workers).results(run, units):
        if isinstance(result, Failure):
            raise SystemExit(f"a session failed: {result.error}\n{result.details}")
        found[unit.file] = result
        progress.advance(bar)
    yield from (found[unit.file] for unit in units)


if __name__ == "__main__":
    understood("recorded_cohort")
    typer.run(main)
