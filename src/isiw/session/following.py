"""Those who look on while a session runs: they are told what is logged, and cannot hold it up."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from isiw.errors import told
from isiw.log.schema import Record
from isiw.session.updates import SessionUpdate

__all__ = ["Follower", "Followers"]


class Follower(Protocol):
    """Somebody who looks on. Each call has to return at once; `logged` comes from several threads."""

    def logged(self, record: Record, channel_name: str | None) -> None:
        """A record was appended to the log.

        Args:
            record: the record.
            channel_name: the channel, of a waveform.
        """

    def updated(self, update: SessionUpdate) -> None:
        """A trial is concluded.

        Args:
            update: what is known after it.
        """

    def ended(self) -> None:
        """The session has ended, and its log is closed."""

    def is_attended(self) -> bool:
        """Whether somebody is there who can say how a pause ends."""


class Followers:
    """All who look on. One whose call fails is not called again, and the session goes on.

    Args:
        faults: where a failure is put, for the log.
    """

    def __init__(self, faults: deque[str]) -> None:
        self._followers: list[Follower] = []
        self._faults = faults

    def __bool__(self) -> bool:
        return bool(self._followers)

    def add(self, follower: Follower) -> None:
        """Let somebody look on."""
        self._followers.append(follower)

    def logged(self, record: Record, channel_name: str | None) -> None:
        """Tell all that a record was appended to the log."""
        self._each(lambda follower: follower.logged(record, channel_name))

    def updated(self, update: SessionUpdate) -> None:
        """Tell all that a trial is concluded."""
        self._each(lambda follower: follower.updated(update))

    def ended(self) -> None:
        """Tell all that the session has ended."""
        self._each(lambda follower: follower.ended())

    def nobody(self) -> bool:
        """Whether none of them is attended."""
        attended: list[bool] = []
        self._each(lambda follower: attended.append(follower.is_attended()))
        return not any(attended)

    def _each(self, tell: Callable[[Follower], None]) -> None:
        for follower in tuple(self._followers):
            try:
                tell(follower)
            except Exception as error:  # noqa: BLE001 - who looks on must not stop a session
                with suppress(ValueError):  # another thread, in which it failed as well, was first
                    self._followers.remove(follower)
                    self._faults.append(f"A viewer failed and gets no further updates: {told(error)}")
