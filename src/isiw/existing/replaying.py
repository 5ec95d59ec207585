"""Replay of a person's recorded trials: strategies ask, the trials answer, each once; how many would it have taken?"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from isiw.checks import whole
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.existing.analysis import analysed
from isiw.existing.delivered import Delivered
from isiw.findings import refused
from isiw.metrics import f1
from isiw.plots.comparison import replay_figure
from isiw.plots.style import save_figure
from isiw.signals.plausible import is_silent
from isiw.strategy.catalogue import make_strategy
from isiw.summary import NO_MEP
from isiw.trials import Trial
from isiw.types import FloatArray
from isiw.window import Window

NEAR_MS: Final = 2.5  # half of the dissertation's step between ISIs; what is farther away answers another one
_MARKS: Final = (5, 10, 15, 20, 30, 40, 60, 80, 100)  # stimuli, after which the agreement is said

SHARED: Final = (
    "The trials that answer are among those of the answer from all trials, so that the two agree more than two "
    "sessions of this person would. Each amplitude is as it was recorded at its place in the session: drift and a "
    "startle at the start come at other places than they would have."
)  # is said beside every replay


@dataclass(frozen=True, eq=False)
class StrategyRun:
    """A strategy that was answered by recorded trials."""

    strategy: str
    seed: int  # also of the draws
    windows: tuple[Window | None, ...]  # after each trial
    far_ms: tuple[float, ...]  # between each answer's ISI and the one that was asked
    stopped: int | None  # after how many trials it would have stopped


@dataclass(frozen=True, eq=False)
class Replay:
    """Strategies on the trials of one person, and the answer from all trials.

    Args:
        delivered: the person's trials.
        space: the ISIs that were asked.
        pairs: how many pairs of stimuli answered.
        runs: each strategy with each seed.
    """

    delivered: Delivered
    space: DesignSpace
    pairs: int
    runs: tuple[StrategyRun, ...]

    @cached_property
    def window(self) -> Window | None:
        """The window that the default reports after all trials."""
        return analysed(self.delivered, make_strategy("default", self.space, self.runs[0].seed)).estimate.window

    @property
    def strategies(self) -> list[str]:
        """The names of the strategies."""
        return list(dict.fromkeys(run.strategy for run in self.runs))

    def f1_by_trial(self, strategy: str, truth: Window | Literal["all"] | None = "all") -> FloatArray:
        """F1 against the answer from all trials, or against a window that is known, shape (seeds, trials).

        Args:
            strategy: its name.
            truth: the window, or None for none; by default the answer from all trials.
        """
        against = self.window if isinstance(truth, str) else truth
        runs = [run for run in self.runs if run.strategy == strategy]
        longest = min(len(run.windows) for run in runs)
        return np.array([[f1(found, against, self.space) for found in run.windows[:longest]] for run in runs])

    def __str__(self) -> str:
        found = "no window" if self.window is None else f"the window {self.window}"
        said = f"All {self.pairs} pairs of stimuli say: {found}. F1 against that, by the number of stimuli:"
        lines = [line for name in self.strategies for line in self._lines(name)]
        return "\n".join([*filter(None, map(self._unanswered, self.strategies)), said, *lines, SHARED])

    def _unanswered(self, name: str) -> str:
        """How many of a strategy's ISIs no trial answered; empty if one answered each."""
        far_ms = np.concatenate([run.far_ms for run in self.runs if run.strategy == name])
        share = float((far_ms > NEAR_MS).mean())
        said = f"{name}: {100 * share:.0f} % of its ISIs could not be answered: no trial was left within {NEAR_MS:g} ms"
        return f"{said}, and the nearest one answered, at most {far_ms.max():.0f} ms away." if share else ""

    def _lines(self, name: str) -> Iterator[str]:
        scores = self.f1_by_trial(name)
        low, middle, high = np.quantile(scores, (0.0, 0.5, 1.0), axis=0)
        at = [n for n in _MARKS if n <= scores.shape[1]] or [scores.shape[1]]
        yield f"{name}  {', '.join(f'{n}: {middle[n - 1]:.2f} ({low[n - 1]:.2f}–{high[n - 1]:.2f})' for n in at)}"
        runs = [run for run in self.runs if run.strategy == name]
        if stops := [run.stopped for run in runs if run.stopped is not None]:
            yield f"  It would have stopped after {np.median(stops):.0f} ({len(stops)} of {len(runs)} seeds)."

    def plot(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Draw F1 by the number of stimuli, with the band over seeds.

        Args:
            path: where to; the suffix chooses the format.
            overwrite: whether to replace a file that is there.
        """
        curves = {name: self.f1_by_trial(name) for name in self.strategies}
        return save_figure(replay_figure(curves), path, overwrite=overwrite)


def replay(
    delivered: Delivered,
    strategies: Sequence[str] = ("default",),
    *,
    space: DesignSpace | None = None,
    seeds: int = 5,
    trials: int = 60,
    first_seed: int = 0,
    on_done: Callable[[], None] = lambda: None,
    **settings: Any,
) -> Replay:
    """Let strategies ask for a person's recorded trials, and see how soon they say what all trials say.

    At an ISI that is asked a trial is drawn among those left at the nearest ISI that has any; each answers once.

    Args:
        delivered: the person's trials.
        strategies: names of strategies.
        space: the ISIs that may be asked; by default the range of those that were delivered.
        seeds: how many times each strategy is run, with other draws.
        trials: how many stimuli each time, at most as many as there are.
        first_seed: the seed of the first run.
        on_done: called after each run.
        **settings: settings that all of the strategies have.

    Raises:
        InvalidValueError: fewer than five pairs, all amplitudes 0, or no whole numbers.
        StrategyError: an unknown strategy or setting.
    """
    space = space or delivered.space()
    seeds, trials = whole("seeds", seeds, least=1), whole("trials", trials, least=1)
    pairs = [trial for trial in delivered.trials.told if trial.isi_ms is not None and space.admits(trial.isi_ms)]
    if len(pairs) < _MARKS[0]:
        expected = f"{_MARKS[0]} pairs and more"
        raise InvalidValueError("too few trials to answer a strategy", got=len(pairs), expected=expected)
    if is_silent(pairs, settings.get("detection_limit_mv")):
        raise refused(NO_MEP, f"{len(pairs)} amplitudes of 0")
    runs = []
    for name in strategies:
        for seed in range(first_seed, first_seed + seeds):
            runs.append(_run(name, space, seed, pairs, min(trials, len(pairs)), settings))
            on_done()
    return Replay(delivered, space, len(pairs), tuple(runs))


def _run(
    name: str, space: DesignSpace, seed: int, pairs: Sequence[Trial], trials: int, settings: dict[str, Any]
) -> StrategyRun:
    strategy, rng, left = make_strategy(name, space, seed, **settings), np.random.default_rng([seed, 1]), list(pairs)
    windows, far_ms, stopped = list[Window | None](), list[float](), None
    for _ in range(trials):
        asked_ms = strategy.ask()
        gaps_ms = np.abs([(trial.wanted_isi_ms or 0.0) - asked_ms for trial in left])
        trial = left.pop(int(rng.choice(np.flatnonzero(gaps_ms <= gaps_ms.min() + 1e-9))))
        far_ms.append(float(gaps_ms.min()))
        strategy.learn(trial)
        windows.append(strategy.estimate().window)
        if stopped is None and strategy.decision().stop:
            stopped = len(windows)
    return StrategyRun(name, seed, tuple(windows), tuple(far_ms), stopped)
