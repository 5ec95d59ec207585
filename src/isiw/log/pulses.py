"""When a person was stimulated, by the logs."""

from __future__ import annotations

import time
from pathlib import Path

from isiw.errors import LogError
from isiw.log.durable import log_of
from isiw.log.reader import read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import Event, decode

__all__ = ["earlier_pulses_s", "pulses_s"]


def pulses_s(salvaged: Salvage, now_ns: int | None = None) -> list[float]:
    """How long ago each stimulus of a log was about to be delivered [s]; refused ones do not count.

    Args:
        salvaged: what was read from the log.
        now_ns: the time now [ns since 1970].
    """
    now_ns = time.time_ns() if now_ns is None else now_ns
    at_ns: list[int] = []
    for message in salvaged.messages:
        if message.topic == "/intent":
            at_ns.append(message.log_time_ns)
        elif message.topic == "/event" and at_ns and _refuses(message.data):
            at_ns.pop()
    return [max(0.0, (now_ns - each_ns) / 1e9) for each_ns in at_ns]


def _refuses(data: bytes) -> bool:
    try:
        event = decode("/event", data)
    except ValueError:
        return False
    return isinstance(event, Event) and event.kind == "refused"


def earlier_pulses_s(folder: str | Path, subject: str, period_s: float, *, but: Path) -> list[float]:
    """How long ago each stimulus of a subject was, by the logs of a folder [s]; those of simulations do not count.

    Args:
        folder: the folder.
        subject: the person's code.
        period_s: how far back it matters [s].
        but: a log that does not count, finished or not.

    Raises:
        LogError: there is no such folder, or a log in it cannot be read: nobody knows what it holds.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise LogError("there is no such folder of logs", got=str(folder), remedy="Check Safeguards.earlier_logs.")
    since_s = time.time() - period_s
    recent = (file for file in folder.glob("*.mcap*") if file.suffix in {".mcap", ".part"})
    logs = {log_of(file) for file in recent if file.stat().st_mtime >= since_s} - {log_of(but)}
    ages_s = [age_s for log in sorted(logs) for age_s in _of_subject(log, subject)]
    return sorted((age_s for age_s in ages_s if age_s <= period_s), reverse=True)


def _of_subject(log: Path, subject: str) -> list[float]:
    salvaged = salvage(log)
    header = read_salvaged(salvaged).header
    return pulses_s(salvaged) if header.subject == subject and not header.device.simulated else []
