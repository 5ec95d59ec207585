"""What benchmarks of priors share: sessions that were run earlier, as a lab has them, and units that are measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from rich.progress import Progress

import isiw
from isiw.studies import Failure, Processes
from isiw.subjects import SimulatedSubject


def logged_session(
    subject: SimulatedSubject,
    name: str,
    seed: int,
    trials: int,
    folder: Path,
    hit_delay_ms: tuple[float, float] | None = None,
    visit: isiw.Visit | None = None,
) -> Path:
    """Run a session of so many trials with the default, from the valve command, and return its log.

    Args:
        subject: the person.
        name: the person's identifier.
        seed: of the trials and the strategy.
        trials: how many.
        folder: where the log is written.
        hit_delay_ms: what the rig states of it, mean and SD [ms]; None where it states nothing.
        visit: what is noted of the person.
    """
    respond = partial(subject.begin(seed).respond, reference="valve")
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(respond, "valve", hit_delay_ms=hit_delay_ms))
    never = {"stop_width_ms": 1e-3, "stop_no_window": 1.0, "stop_expected_f1": 1.0, "stop_gain": 0.0}
    strategy = isiw.make_strategy(seed=seed, max_trials=trials, hit_delay_ms=hit_delay_ms, **never)
    return isiw.Session(device, strategy, log=folder / f"{name}.mcap", subject=name, visit=visit).run().log


def measured(examine: Callable[[Any], pd.DataFrame], units: Sequence[Any], workers: int, out: Path) -> pd.DataFrame:
    """All rows of some units, kept beside the result as they come; it ends with the first unit that fails.

    Args:
        examine: the rows of one unit.
        units: what is measured.
        workers: how many processes.
        out: path of the result, without suffix.
    """
    tables = []
    with Progress() as progress:
        bar = progress.add_task(out.name, total=len(units))
        for _, result in Processes(workers).results(examine, units):
            if isinstance(result, Failure):
                raise SystemExit(f"a unit failed: {result.error}\n{result.details}")
            tables.append(result)
            pd.concat(tables).to_csv(out.with_suffix(".csv"), index=False)
            progress.advance(bar)
    return pd.concat(tables)
