"""The rehearsal before the first stimulus: all compiled code that a session computes with is loaded, or compiled.

What could go wrong while a file of it is loaded, or while it is compiled, goes wrong while the device is not armed. A
search for a motor threshold has no compiled code.
"""

from __future__ import annotations

from typing import Final

from isiw.acquisition.information import Alternating
from isiw.models.protocol import Rehearses
from isiw.session.examination import estimate_record
from isiw.strategy.outcomes import Details
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy

_MEP_MV: Final = 0.1
_SORTS: Final = (
    Details(),
    Details(isi_sd_ms=2.0),
    Details(mep_interval_mv=(0.01, _MEP_MV)),
    Details(mep_sd_mv=0.02),
)
"""Pairs as a session may have them: with an amplitude or an interval, and an ISI that was measured or not."""

_rehearsed: Final[set[tuple[type, str]]] = set()


def rehearse(strategy: Strategy) -> None:
    """Compute once, with few particles, all that a session with such a strategy may compute; once in a process.

    The strategy itself learns nothing. Models without compiled code are left alone, and a user's acquisition function
    is not called: one of isiw's stands in for it.
    """
    acquisition, model = strategy.acquisition, strategy.model
    ours = type(acquisition).__module__.partition(".")[0] == "isiw"
    known = type(model), repr(acquisition) if ours else ""
    if known in _rehearsed or not isinstance(model, Rehearses):
        return
    _play(Strategy(strategy.space, model.in_brief(), acquisition if ours else Alternating(), Budget(1000)))
    _rehearsed.add(known)


def _play(strategy: Strategy) -> None:
    """Let a made-up session go through all that a session can have."""
    strategy.learn(None, _MEP_MV)
    strategy.learn_tap(strategy.ask(), _MEP_MV)
    for details in _SORTS:
        strategy.learn(strategy.ask(), None if "mep_interval_mv" in details else _MEP_MV, **details)
    strategy.note_change()
    next_isi_ms = strategy.ask()
    estimate_record(strategy, len(_SORTS), strategy.decision(), next_isi_ms)
