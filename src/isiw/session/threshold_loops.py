"""The loop around a logged search for the motor threshold whose pulses an operator gives and types."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from isiw.checks import text
from isiw.decision import StopDecision
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.session.threshold import ThresholdRecorder
from isiw.strategy.threshold.estimate import place_text

ANSWERS: Final = (
    "After each pulse type the MEP's amplitude in mV (0.08, or 80 uV); y or n if you only saw on the screen whether it "
    "was above 50 uV; x if the pulse cannot be used; u to take the last answer back. To stop here and resume later, "
    "type q without giving the pulse: it then counts as not given."
)

_LAST_WORD: Final = "Enter ends, u takes the last answer back: "

SURELY_MV: Final = 2.0
"""More than this [mV] needs its unit: it is more likely an amplitude in µV."""

_AMPLITUDE: Final = re.compile(r"(\d+(?:[.,]\d*)?|[.,]\d+)\s*(mv|uv|µv|μv)?", re.IGNORECASE | re.ASCII)
_THOUSANDS: Final = re.compile(r"[.,][0-9]{3}$")


def run_by_hand(recorder: ThresholdRecorder, read: Callable[[str], str], say: Callable[[str], None]) -> StopDecision:
    """Let an operator set intensities and type outcomes; `read` raises EOFError if nobody types any more."""
    say(ANSWERS)
    going_on = True
    while going_on:
        try:
            going_on = _take(recorder, _answer(recorder, read, say), say)
        except EOFError:
            break
        except InvalidValueError as error:
            say(f"{error}\nNothing was logged; type it again.")
    return recorder.decision()


def _answer(recorder: ThresholdRecorder, read: Callable[[str], str], say: Callable[[str], None]) -> str:
    """The operator's answer about the next pulse, or about the last one if none is asked any more."""
    decision = recorder.decision()
    if decision.stop:
        return _typed(read, f"The search is over. {decision.reason} {_LAST_WORD}")
    try:
        intensity = recorder.ask()
    except LimitExceededError as limit:
        with suppress(EOFError):
            if _typed(read, f"{limit} {_LAST_WORD}") == "u":
                _take_back(recorder, say)
        raise
    return _typed(
        read, f"Pulse {recorder.given + 1}: set {intensity:g} % MSO{at_place(recorder)}, give one pulse. MEP: "
    )


def at_place(recorder: ThresholdRecorder) -> str:
    """Where the coil is, for a line on the screen; empty if it stays."""
    return f", coil {place_text(recorder.place_mm)}" if recorder.place_mm else ""


def _typed(read: Callable[[str], str], question: str) -> str:
    return read(question).strip().lower()


def _take(recorder: ThresholdRecorder, typed: str, say: Callable[[str], None]) -> bool:
    """Log what was typed; False if the operator ends the search here."""
    over = recorder.decision().stop
    if typed == "u":
        _take_back(recorder, say)
    elif over and typed in {"", "q", "quit"}:
        return False
    elif over:
        raise InvalidValueError("the search is over, and no pulse was asked", got=typed, expected="Enter or u")
    elif typed in {"q", "quit"}:
        recorder.withdraw()
        return False
    elif typed in {"y", "n"}:
        recorder.tell(response=typed == "y")
    elif typed == "x":
        recorder.lost("lost, said the operator")
    else:
        recorder.tell(amplitude_of(typed))
    say(str(recorder.estimate()))
    return True


def _take_back(recorder: ThresholdRecorder, say: Callable[[str], None]) -> None:
    last = recorder.outcomes[-1] if recorder.outcomes else None
    if last is None or last.reason:
        raise InvalidValueError(
            "there is no last answer to take back", got=last.reason if last else None, expected="a pulse that counts"
        )
    recorder.exclude(last.trial, "taken back by the operator")
    seen = f"{last.mep_mv:g} mV" if last.response is None else "y" if last.response else "n"
    say(f"Pulse {last.trial + 1} ({last.intensity_pct_mso:g} % MSO, {seen}) no longer counts.")


def amplitude_of(typed: str) -> float:
    """An amplitude as somebody types it [mV]."""
    found = _AMPLITUDE.fullmatch(text("an amplitude", typed).strip())
    if found is None:
        raise InvalidValueError(
            "this is not a valid answer", got=typed, expected="an amplitude in mV, or y, n, x, u or q"
        )
    if _THOUSANDS.search(found[1]) and (found[2] or "mv").lower() != "mv":
        raise InvalidValueError(
            "it is not clear whether the separator is a decimal or a thousands separator",
            got=typed,
            remedy="Type it without a separator, as in 1200 uV.",
        )
    value, unit = float(found[1].replace(",", ".")), (found[2] or "").lower()
    if unit == "" and value > SURELY_MV:
        raise InvalidValueError(
            f"an amplitude above {SURELY_MV:g} needs its unit", got=typed, remedy=f"Type {value:g} uV or {value:g} mV."
        )
    return value if unit in {"", "mv"} else value / 1000
