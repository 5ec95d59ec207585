"""How a log is continued, in words, and which logs are not, as they are of no session or of no search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from isiw.errors import LogError
from isiw.log.headers import RUN_KEY, SERVED_KEY, AnyHeader, Header
from isiw.log.kinds import LogKind, kind_of
from isiw.log.places import log_of
from isiw.text.sanitize import command

OWN_LOOP: Final = "a loop of the lab's own"
"""The device's name in the log of a session whose loop is not isiw's."""


def continued_by(
    path: Path, header: AnyHeader, config: Path | None = None, *, end_lost: bool = False, changed: bool = False
) -> str:
    """The way to continue what a log is of: a command, or the call that a loop of the lab's own was begun with."""
    if not isinstance(header, Header) or header.imported:
        return kind_of(header).continued_by(path)
    if SERVED_KEY in header.config:
        lost = ", with N as lost_pulses in its body" if end_lost else ""
        return f"POST /sessions/{log_of(path).stem}/resume to isiw serve{lost}"
    if header.device.name == OWN_LOOP:
        lost = ", lost_pulses=N" if end_lost else ""
        return f'isiw.open_session(strategy, "{path}", resume=True{lost})'
    words, run = ["resume", *(["--lost-pulses", "N"] if end_lost else []), path], header.config.get(RUN_KEY)
    if isinstance(run, Mapping) and "device" not in run and not changed:
        subject = run.get("subject")
        recorded = isinstance(subject, Mapping) and subject.get("kind") == "recorded"
        return command(*words, *(["--data", "DIR"] if recorded else []))  # no log says where recorded EMG is
    if config is not None or changed:
        return command(*words, config or "CONFIG")
    by_hand = "where CONFIG names your device, or in your own software isiw.resume(path, device).run()"
    return f"{command(*words, 'CONFIG')}, {by_hand}"


def require_session(path: Path, header: Header) -> None:
    """Raise if a log's trials were delivered without isiw, so that nothing can be continued or judged again."""
    if header.imported:
        raise LogError(
            f"the log is of {LogKind.IMPORTED}, and stays as it was imported",
            got=str(path),
            remedy="To leave a trial out, mark it in the file that it is from, and analyse that again. To continue "
            f"with the person, begin a session that knows the trials: {LogKind.IMPORTED.continued_by(path)}",
        )


def require_search(path: Path, header: Header) -> None:
    """Raise if a log is of an intervention: its trials are no search for a window, even once its arm is open."""
    if header.intervention is not None:
        raise LogError(
            "an intervention is meant to change the person, and teaches no window",
            got=str(path),
            remedy="Leave this log out, and give that of the search for the window.",
        )


def imported_sentence(names: Sequence[str]) -> str:
    """That some logs are of no session, in words; empty if there are none."""
    return f"Imported, and no sessions of isiw: {', '.join(names)}." if names else ""
