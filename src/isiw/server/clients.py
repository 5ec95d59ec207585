"""The clients of a session: one at a time drives it, by the key that it states, and no trial is given to two."""

from __future__ import annotations

from typing import Final

from isiw.log.record import SessionRecord
from isiw.log.schema import Event
from isiw.server.answers import Refusal

KEY: Final = r"^[A-Za-z0-9_-]{1,64}$"
"""What a client may call itself, or something that it says; a random text, so that no other has it."""


def logged_client(record: SessionRecord) -> str | None:
    """The client that drove a session last, by its log; None if that one stated no key."""
    return next((event.client for event in reversed(record.events) if event.kind == "client"), None)


def driven_from_here(client: str | None) -> Event:
    """That a client drives a session from here on, and no other one."""
    return Event(kind="client", client=client, text="Another client drives the session from here on.")


def require_free(holder: str | None, client: str | None, *, takeover: bool) -> None:
    """Raise if another client drives a session, which whoever resumes it has not said to be over."""
    if holder not in {None, client} and not takeover:
        raise Refusal(
            409,
            "OtherClient",
            "another client drives the session",
            got=client,
            remedy="Deliver nothing. Only where that client has ended and delivers nothing any more, resume with "
            "takeover=true: it is refused from then on.",
            field="client",
        )


def require_own(holder: str | None, client: str | None, trial: int | None) -> None:
    """Raise if a client is not the one that drives a session, and was given the open trial, if any."""
    if client != holder:
        given = (
            "the session is driven by another client" if trial is None else f"trial {trial} was given to another client"
        )
        raise Refusal(
            409,
            "OtherClient",
            given,
            got=client,
            expected="the key that was stated when the session was created or resumed last",
            remedy="Deliver nothing. Only where that client has ended, resume with your own key and takeover=true.",
            field="client",
        )


def given_once(trial: int, isi_ms: float | None) -> Refusal:
    """That an ISI is not given again to who states no key: it may be another client, and may have been delivered."""
    return Refusal(
        409,
        "TrialOpen",
        f"trial {trial} was requested and has no outcome; it may have been delivered, by another client than this one",
        got=isi_ms,
        remedy="Tell its outcome, or make it a mistrial. A client that states a key when it creates or resumes the "
        "session, and in each ask, is answered again.",
    )
