"""What is written after a trial: the estimate, what is predicted, and why the next ISI is asked."""

from __future__ import annotations

from typing import Any

from isiw.log.schema import Estimate
from isiw.strategy.choosing import candidate_isis
from isiw.strategy.stopping import StopDecision
from isiw.strategy.strategy import Strategy
from isiw.types import FloatArray

__all__ = ["believed"]

DIGITS = 4
"""Significant digits of predicted amplitudes and scores, which are for pictures."""


def believed(strategy: Strategy, trial: int, decision: StopDecision, next_isi_ms: float | None) -> Estimate:
    """The record of what a strategy believes after a trial; scores are those that it has worked out anyway.

    Args:
        strategy: the strategy.
        trial: the number of the trial.
        decision: whether to stop, and why.
        next_isi_ms: what is asked next [ms]; None where nothing was asked.
    """
    record = Estimate.of(trial, strategy.estimate(), decision, next_isi_ms)
    predicted = _predicted(strategy) if record.grid_ms else {}
    return record.model_copy(update=predicted | ({} if next_isi_ms is None else _chosen(strategy)))


def _predicted(strategy: Strategy) -> dict[str, Any]:
    band = strategy.prediction_mv()
    return {} if band is None else {"predicted_low_mv": _rounded(band[0]), "predicted_high_mv": _rounded(band[1])}


def _chosen(strategy: Strategy) -> dict[str, Any]:
    choice = strategy.choice
    if choice is None or choice.scores is None:
        return {} if choice is None else {"chosen_by": choice.by}
    isis_ms = tuple(candidate_isis(strategy.space).tolist())
    scores = _rounded(choice.scores.detach().double().numpy())
    return {"chosen_by": choice.by, "scored_ms": isis_ms, "scores": scores}


def _rounded(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(f"{value:.{DIGITS}g}") for value in values)
