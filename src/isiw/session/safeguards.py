"""What a session does about faults, pauses and earlier sessions; the limits themselves are the log's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from isiw.checks import check_numbers, check_wholes
from isiw.devices.deadlines import Deadlines


@dataclass(frozen=True)
class Safeguards:
    """How a session keeps a person safe besides its limits.

    Args:
        deadlines: how long each verb of the device may take.
        retries: how often a stimulus is tried again that the device refused before firing.
        backoff_s: how long to wait before the first of these [s]; twice as long before each further one.
        on_pause: is called with the reason when the session has paused and the device is disarmed; True goes on, and
            arms again. Without it the operator is asked in the terminal, and where there is none the session ends.
        dead_man: is called before each stimulus; anything but True refuses it and ends the session.
        earlier_logs: a folder of logs, whose folders are looked into, too; the same subject's stimuli in it count for
            the limits' period and block. A log that cannot be read refuses the session.

    Raises:
        InvalidValueError: a number of retries or a time that is negative.
    """

    deadlines: Deadlines = field(default_factory=Deadlines)
    retries: int = 3
    backoff_s: float = 1.0
    on_pause: Callable[[str], bool] | None = None
    dead_man: Callable[[], bool] | None = None
    earlier_logs: str | Path | None = None

    def __post_init__(self) -> None:
        check_wholes(self, "retries", least=0)
        check_numbers(self, "backoff_s", least=0)

    @property
    def backoffs_s(self) -> tuple[float, ...]:
        """How long to wait before each retry [s]."""
        return tuple(self.backoff_s * 2**retry for retry in range(self.retries))
