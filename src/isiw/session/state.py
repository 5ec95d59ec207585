"""The states of a session, and the one table of their words: on the live page, in the terminal and over HTTP.

Whether the device is armed is no state but a lamp beside it: a session that rests is armed, and one that is paused is
not.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final, NamedTuple


class State(StrEnum):
    """The state of a session, in the word that people read."""

    NOT_BEGUN = "NOT BEGUN"
    RUNS = "RUNS"
    REST = "REST"
    PAUSED = "PAUSED"
    FAULT = "FAULT"
    ENDED = "ENDED"
    NO_CONNECTION = "NO CONNECTION"


SENTENCES: Final[Mapping[State, str]] = MappingProxyType(
    {
        State.NOT_BEGUN: "The session has not begun.",
        State.RUNS: "The session runs.",
        State.REST: "The session rests, and continues by itself.",
        State.PAUSED: "The session is paused until a person continues it.",
        State.FAULT: "A fault ended the session.",
        State.ENDED: "The session has ended.",
        State.NO_CONNECTION: "No connection. Use the stimulator's own switch. What is shown below is old.",
    }
)
"""What each state means. No session says that it has no connection; who looks on finds out."""


class Fault(NamedTuple):
    """What ended a session before its time.

    Args:
        what: what went wrong, without any remedy.
        trial: the trial that was being delivered; None if none was.
        given: whether its pulse may have been given.
    """

    what: str
    trial: int | None = None
    given: bool = False

    @property
    def about_the_trial(self) -> str:
        """The trial, and whether its pulse was given, in a sentence; empty if none was being delivered."""
        if self.trial is None:
            return ""
        given = "may have been given, and counts" if self.given else "was not given"
        return f"The pulse of trial {self.trial} {given}."


def state_of(*, begun: bool, running: bool, paused: bool, rests: bool, fault: bool) -> State:
    """The state of a session.

    Args:
        begun: whether it was ever running.
        running: whether its log is open.
        paused: whether it waits for a person.
        rests: whether it waits for the end of a rest.
        fault: whether a fault ended it.
    """
    if fault:
        return State.FAULT
    if not running:
        return State.ENDED if begun else State.NOT_BEGUN
    if paused:
        return State.PAUSED
    return State.REST if rests else State.RUNS
