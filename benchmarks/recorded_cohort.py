"""The default, and who knows the law, on people whose MEPs were recorded.

    python -m benchmarks.recorded_cohort --people 400 --seed 10000 --given 0 --out benchmarks/results/recorded_cohort

The recordings lie in no repository of ours: `--data`, or the variable ISIW_SHARED_DATA, names their folder. `--given
0,10,30,60,600` gives the default so many single pulses of the same law first, and has one who takes the law from these
and knows all else but start and width; `--known` adds the default with all that who knows the law knows besides (that
there is a window, the law of windows, form, impact and boost, and that nothing changes), but not the law; `--searched`
adds the default after a search for the motor threshold of the same law; `--fitted` adds the default with the prior that
`benchmarks.response_prior` fitted to all other persons. `--banks coils` draws from both curves of a coil, trials from
every second pulse and what is known from the other half. `--made-up 10` puts hands of the default's own law in the
place of who was recorded, so many pulses a level. Sessions are kept beside the result as they finish, and the same
command continues where it was interrupted. Standard errors are by bootstrap over the ten persons, each with all banks.
Seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
import re
import warnings
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, cast

import numpy as np
import pandas as pd
import typer
from rich.progress import Progress

import isiw
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.recorded_law import KnowsTheLaw, all_but_the_law
from benchmarks.recorded_people import Banks, RecordedPerson, RecordedResponse, recordings
from benchmarks.recorded_tables import tables_of
from benchmarks.response_prior import Fit, read_folds
from benchmarks.tables import kept, write_tables
from isiw.errors import ImplausibleDataWarning
from isiw.studies import Failure, Processes

SPACE: Final = isiw.VALVE_SPACE
MARKS: Final = (0, 10, 15, 20, 30, 40)
LAW: Final = "who knows the law"
TOO_GOOD: Final = "law and draws from the same half (too good)"
ELSE: Final = "default that knows all but the law"
SEARCHED: Final = "default, after a search for the motor threshold"
FITTED: Final = "default, prior fitted to the other persons"
IMPACT_SD_MS: Final = 1.0
"""How far from the truth an impact that is known may be [ms]."""

TOGETHER: Final = 5
"""Sessions that are kept in one file."""


@dataclass(frozen=True)
class RecordedSession:
    """One session with one of the cohort.

    Args:
        person: the person.
        strategy: `default`, `SEARCHED`, `ELSE`, `FITTED`, `LAW` or `TOO_GOOD`.
        given: how many single pulses are given first.
        trials: how many pairs are delivered.
        fit: numbers of the default's prior, of `FITTED` alone.
    """

    person: RecordedPerson
    strategy: str
    given: int
    trials: int
    fit: Fit | None = None

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
        elif self.fit is not None:
            known["prior"] = self.fit.prior()
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


def chunks(
    people: list[RecordedPerson],
    given: list[int],
    trials: int,
    folder: Path,
    folds: Mapping[int, Fit] | None = None,
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
        known: also the default that knows all but the law.
        searched: also the default after a search for the motor threshold.
    """
    plan = [("default", count) for count in given] + [(LAW, count) for count in sorted({0, *given})]
    if people[0].bank.kernel_log_sds is None:
        plan.append((TOO_GOOD, 0))
    plan += [(SEARCHED, 0)] * searched
    plan += [(ELSE, count) for count in given if known]
    plan += [(FITTED, count) for count in given if folds]
    fits = folds or {}
    names = {strategy: re.sub("[^a-z]+", "_", strategy) for strategy, _ in plan}
    names[FITTED] = f"fitted_{zlib.crc32(repr(fits).encode()):08x}"
    parts = [people[first : first + TOGETHER] for first in range(0, len(people), TOGETHER)]
    return [
        Chunk(
            tuple(
                RecordedSession(each, strategy, count, trials, fits[each.bank.person] if strategy == FITTED else None)
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
    counts, found = [int(each) for each in given.split(",")], []
    units = chunks(cohort, counts, trials, folder, folds, known=known, searched=searched)
    with Progress() as progress:
        bar = progress.add_task("sessions", total=len(units))
        for _, result in Processes(workers).results(Chunk.run, units):
            if isinstance(result, Failure):
                raise SystemExit(f"a session failed: {result.error}\n{result.details}")
            found.append(result)
            progress.advance(bar)
    rows = pd.concat(found, ignore_index=True)
    facts = facts_of("recorded_cohort", "numpy", seed=seed, sessions=people, space="valve, 0–500 ms")
    write_tables(tables_of(rows, cohort, SPACE, LAW), facts, out)
    print(out.with_suffix(".md").read_text())


if __name__ == "__main__":
    understood("recorded_cohort")
    typer.run(main)
