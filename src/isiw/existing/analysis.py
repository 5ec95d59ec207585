"""The analysis of trials that were delivered without isiw, and a log of them that was never a session."""

from __future__ import annotations

import datetime as dt
import html
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from isiw.decision import StopKind
from isiw.design import DesignSpace, require_space
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError, LogError, os_errors
from isiw.estimate import WindowEstimate
from isiw.existing.delivered import Delivered
from isiw.files import made_folder, put
from isiw.findings import Kind
from isiw.log.headers import Header
from isiw.log.names import require_free
from isiw.log.places import log_of
from isiw.log.record import SessionRecord
from isiw.log.schema import Event, Record, Waveform
from isiw.log.writer import LogWriter, clock_ns
from isiw.plots.session import session_figure
from isiw.plots.style import inline_svg, save_figure
from isiw.report.page import save_report
from isiw.report.words import final_statement
from isiw.session.assembly import header_of
from isiw.session.examination import estimate_record
from isiw.signals.plausible import before_impact
from isiw.signals.watch import Watch
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Measurement, Sweep
from isiw.trials import Status, Trial, TrialTable
from isiw.types import ArrayLike, FloatArray
from isiw.visit import Visit

MOST_ESTIMATES: Final = 50  # of a long series so many are logged, after trials evenly spread, and that of the last
_END: Final = StopKind.OWN.stop("All trials are analysed. They were delivered without isiw, so no more can follow.")
_NEVER: Final = 10**9


@dataclass(frozen=True, eq=False)
class Analysis:
    """The estimate of one person's window from trials that were delivered without isiw.

    Args:
        record: the trials and the estimates after them, as in a log.
        estimate: the window's estimate after all of them.
    """

    record: SessionRecord
    estimate: WindowEstimate

    def __str__(self) -> str:
        return final_statement(self.record)

    def _repr_html_(self) -> str:
        style = "--ink:#222;--faint:#888;--blue:#0072b2;--orange:#d55e00;--green:#009e73;--red:#c1272d;--paper:#fff"
        picture = inline_svg(self.plot(), "analysis")
        return f'<div style="{style}"><p>{html.escape(str(self))}</p>{picture}</div>'

    def plot(self, path: str | Path | None = None, *, overwrite: bool = False) -> Figure:
        """The picture of profile, trials and window, as `isiw plot` draws it.

        Args:
            path: where to save it, too; the suffix chooses the format.
            overwrite: whether to replace a file that is there.

        Raises:
            InvalidValueError: a format that matplotlib does not know, or a file that is not to be replaced.
        """
        figure = session_figure(self.record)
        if path is not None:
            save_figure(figure, path, overwrite=overwrite)
        return figure

    def report(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page about the trials, as `isiw report` does.

        Args:
            path: where to, such as `P01.html`.
            overwrite: whether to replace a file that is there.

        Raises:
            ConfigError: plotly or jinja2 is not installed.
            InvalidValueError: a path that is none of a page, or a file that is not to be replaced.
        """
        return save_report(self.record, path, overwrite=overwrite)

    def to_log(self, path: str | Path) -> Path:
        """Write a log that is marked as imported: everything that looks at logs works on it; it cannot be resumed.

        Args:
            path: where to, such as `P01.mcap`; nothing is replaced.

        Raises:
            LogError: there is a log already, or no file can have this name.
        """
        target = log_of(Path(path))
        with os_errors(LogError, "the log cannot be created", target, "Choose another path."):
            require_free(target)
        made_folder(target.parent)
        with tempfile.TemporaryDirectory() as folder:  # a log that is not whole never gets a name
            whole = Path(folder) / "log.mcap"
            with LogWriter.create(whole, self.record.header) as log:
                for (number, name), channel in self.record.waveforms.items():
                    log.append(Waveform.of(number, channel), name)
                for record in self.record.history:
                    log.append(record)
            with os_errors(LogError, "the log cannot be created", target, "Make room, or choose another path."):
                put(target, whole.read_bytes(), replacing=False)
        return target


def analyse(
    isi_ms: ArrayLike,
    mep_mv: ArrayLike,
    *,
    space: DesignSpace,
    strategy: str = "default",
    seed: int = 0,
    subject: str = "",
    visit: Visit | None = None,
    simulated: bool = False,
    **settings: Any,
) -> Analysis:
    """Estimate a person's window from trials that exist already.

    Args:
        isi_ms: the ISI of each trial [ms], in the order of delivery, shape (n,); NaN is TMS alone. A pulse before the
            impact does not count, nor do values that a mask hides.
        mep_mv: peak-to-peak amplitude of its MEP [mV], shape (n,); 0 is below the detection limit, NaN a lost trial.
        space: the ISIs at which a window is sought; trials at others teach, too.
        strategy: the strategy that estimates, one of `isiw.list_strategies()`.
        seed: seed of all randomness.
        subject: the person's code.
        visit: what is noted about the visit.
        simulated: true if nobody was stimulated: the person is simulated.
        **settings: settings of the strategy, such as `detection_limit_mv=0.05` or `conditioning="electrical"`.

    Raises:
        InvalidValueError: no design space, shapes that differ, no pair of stimuli, or numbers that are probably in
            another unit or swapped.
        StrategyError: an unknown strategy or setting.
    """
    require_space(space)
    isis, meps = _numbers("the ISIs", isi_ms), _numbers("the MEPs", mep_mv)
    if isis.shape != meps.shape or isis.ndim != 1:
        raise InvalidValueError("each trial has one ISI and one MEP", got=(isis.shape, meps.shape))
    table = TrialTable(tuple(_trial(n, *pair, space) for n, pair in enumerate(zip(isis, meps, strict=True))))
    known: dict[str, Any] = {"subject": subject, "visit": visit or Visit(), "source": "arrays", "simulated": simulated}
    return analysed(Delivered(table, space.reference, **known), make_strategy(strategy, space, seed, **settings))


def _numbers(what: str, values: ArrayLike) -> FloatArray:
    """Numbers as an array; what a mask hides is NaN."""
    try:
        return np.ma.filled(np.ma.array(values, dtype=np.float64), np.nan)
    except (TypeError, ValueError) as error:
        remedy = "Write NaN for what is missing."
        raise InvalidValueError(f"{what} are not numbers", got=values, remedy=remedy) from error


def _trial(number: int, isi: float, mep: float, space: DesignSpace) -> Trial:
    isi_ms, mep_mv = (None if np.isnan(value) else float(value) for value in (isi, mep))
    lost = Kind.OUTCOME_UNKNOWN if mep_mv is None else None
    if isi_ms is not None and before_impact(isi_ms, max(isi_ms, 0.0), space):
        lost = Kind.TMS_BEFORE_IMPACT
    status = Status.ACCEPTED if lost is None else Status.MISTRIAL
    return Trial(number, status, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv, reason=lost)


def analysed(delivered: Delivered, strategy: Strategy, config: Mapping[str, Any] | None = None) -> Analysis:
    """Estimate the window from trials that were delivered without isiw, by a strategy that has learnt nothing yet.

    Args:
        delivered: the trials.
        strategy: the strategy; it has learnt them afterwards.
        config: what is kept in the log, as TOML values.

    Raises:
        StrategyError: the strategy has learnt or asked something before, or cannot learn from such trials.
    """
    header, day = _header(delivered, strategy, config or {}), delivered.visit.day
    record = SessionRecord(
        path=Path(f"{delivered.subject or 'analysis'}{f'_day{day}' if day else ''}.mcap"),
        header=header,
        history=tuple(_history(delivered, strategy, header)),
        waveforms={(n, name): channel for n, sweep in delivered.sweeps.items() for name, channel in sweep.items()},
        losses=(),
        finished=True,
        delivered=len(delivered.trials),
    )
    return Analysis(record, strategy.estimate())


def _header(delivered: Delivered, strategy: Strategy, config: Mapping[str, Any]) -> Header:
    device = DeviceInfo(
        "none: the trials were delivered without isiw",
        delivered.reference,
        simulated=delivered.simulated,
        channels={name: channel.unit for sweep in delivered.sweeps.values() for name, channel in sweep.items()},
        conditioning=strategy.recipe.settings.get("conditioning", delivered.conditioning),
    )
    limits = replace(Limits.of_space(strategy.space, min_iti_s=0.0), max_pulses=max(1, len(delivered.trials)))
    known = {name: getattr(delivered, name) for name in ("source", "given_by", "subject", "visit", "signals")}
    header = header_of(strategy, kind="imported", device=device, limits=limits, config=dict(config), **known)
    moment = dt.datetime.fromtimestamp(clock_ns() / 1e9, dt.UTC)  # what tells one log of a person from the next
    return header.model_copy(update={"created": delivered.created or moment.isoformat(timespec="microseconds")})


def _history(delivered: Delivered, strategy: Strategy, header: Header) -> Iterator[Record]:
    """The trials, with findings, and the estimates after them."""
    trials = delivered.trials
    learnt = [trial.index for trial in trials if trial.told]
    places = np.linspace(0, len(learnt) - 1, MOST_ESTIMATES).round() if learnt else ()
    logged = {learnt[int(place)] for place in places}
    watch = Watch(header.space, header.signals, _NEVER, header.detection_limit_mv)
    for note in delivered.notes:
        yield Event(kind="note", trial=trials[0].index, text=note)
    for trial in trials:
        if trial.index in delivered.blocks:
            yield Event(kind="note", trial=trial.index, text=f"Block {delivered.blocks[trial.index]} begins.")
        yield trial
        strategy.learn(trial)
        times_ms = trial.t_valve_ms, trial.t_tms_ms, trial.t_hit_ms
        channels = delivered.sweeps.get(trial.index)
        answer = Measurement(trial.mep_mv or 0.0, trial.isi_ms) if channels is None else Sweep(channels, *times_ms)
        watch = watch.after(trial, answer)
        if (doubt := watch.doubts.new) is not None and trial.told:
            yield Event(kind="doubt", finding=doubt.kind, trial=trial.index, text=f"{doubt}")
        if trial.told and (trouble := strategy.trouble) is not None:
            yield Event(kind="fit", trial=trial.index, text=trouble)
        if trial.index in logged or trial.index == trials[-1].index:
            yield estimate_record(strategy, trial.index, _END, None)
