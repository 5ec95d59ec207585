"""The answer of an intervention in words: each sentence about it is written here once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from isiw.pairing.effect import AfterEffect, BlockChange, Interval
from isiw.pairing.power import BETWEEN_PEOPLE, POWER, measuring_log_sd, people_needed, pulses_needed
from isiw.pairing.pulses import Delivered
from isiw.text.sanitize import counted

SOUGHT: Final = 1.5
"""The change that sentences about pulses and people are of."""

CONCEALED: Final = "The arm is concealed. What was delivered is shown once it is opened."

NOT_YET: Final = "The arm is concealed, so the change is shown once the plan is complete, or the arm is opened."

NO_CAUSE: Final = (
    "What one person shows after an intervention need not come from it. Compare people, or visits, with a control arm."
)


def times(factor: float) -> str:
    """A factor."""
    return f"× {factor:.2f}" if factor < 10 else f"× {factor:.0f}"


def between(interval: Interval) -> str:
    """A factor with its interval."""
    return f"{times(interval.median)} (90 % interval {times(interval.low)} to {times(interval.high)})"


def answer(effect: AfterEffect) -> str:
    """Whether TMS alone evokes more or less than before, and by how much."""
    factor = effect.pooled.factor
    if factor.holds_none:
        return f"No change is shown: TMS alone evokes {between(factor)} of what it did before."
    word = "more" if factor.median > 1 else "less"
    return f"TMS alone evokes {word} than before: {between(factor)}."


def drift(effect: AfterEffect) -> str:
    """What the interval allows for, and what it would be without that."""
    steady = effect.pooled.steady
    ends = f"{times(steady.low)} to {times(steady.high)}"
    if effect.is_shown or steady.holds_none:
        return f"The interval allows for a drift of the level by itself. Without one it is {ends}."
    return (
        f"It would be a change only if the level did not drift by itself: the interval is then {ends}. "
        "The pulses do not say which."
    )


def ratio(change: BlockChange) -> str:
    """The ratio of mean MEPs, and where it lies without an effect; empty where no intensity is on both sides."""
    if change.ratio is None or change.unchanged is None:
        return ""
    low, high = change.unchanged
    without = f"{times(low)} to {times(high)}"
    return f"Mean MEPs are {times(change.ratio)} of those before; without an effect nine of ten visits have {without}."


def needed(effect: AfterEffect, factor: float = SOUGHT) -> str:
    """How many pulses a person, and how many people a study needs to show a change."""
    people = people_needed(factor, math.hypot(BETWEEN_PEOPLE, measuring_log_sd(effect)))
    pulses = pulses_needed(effect, factor)
    share = f"with a probability of {POWER:g}"
    one = f"To show {times(factor)} in this person {share} takes {pulses} pulses before and {pulses} after."
    if pulses is None:
        few = pulses_needed(effect, factor, steady=True)
        one = (
            f"No number of pulses shows {times(factor)} in this person {share}, since the level may drift as much; "
            f"if it did not, {few} before and {few} after would."
        )
    return (
        f"{one} A study of such people takes {people}, "
        f"if their changes differ by a log SD of {BETWEEN_PEOPLE:g} (an assumption)."
    )


def dose(delivered: Sequence[Delivered]) -> str:
    """How many pairs were delivered, at which ISIs, and in which time."""
    if not delivered:
        return "No pair of stimuli was delivered."
    pairs, probes = ([pair for pair in delivered if pair.probe is wanted] for wanted in (False, True))
    minutes = (delivered[-1].at_s - delivered[0].at_s) / 60.0
    said = [f"{counted(len(pairs), 'pair')} {_at(pairs)}"] if pairs else []
    said += [f"{counted(len(probes), 'probe')} of the window {_at(probes)}"] if probes else []
    return f"{' and '.join(said)} in {minutes:.0f} min."


def _at(pairs: Sequence[Delivered]) -> str:
    low, high = min(pair.isi_ms for pair in pairs), max(pair.isi_ms for pair in pairs)
    return f"at {low:.0f} ms" if round(low) == round(high) else f"at {low:.0f}–{high:.0f} ms"


def statement(effect: AfterEffect) -> list[str]:
    """The answer and what belongs to it, a sentence or two each, the most important first."""
    return [said for said in (answer(effect), drift(effect), ratio(effect.pooled), NO_CAUSE, needed(effect)) if said]
