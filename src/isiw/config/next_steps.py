"""What to type next once a session has ended: to go on with it, or with the same person in a new one."""

from __future__ import annotations

from pathlib import Path

from isiw.config.taught import learns_from_earlier
from isiw.errors import IsiwError, LimitExceededError
from isiw.log.kinds import continued_by
from isiw.log.reader import read_session
from isiw.log.schema import RUN_KEY
from isiw.session.loop import Session
from isiw.text.commands import command


def after_error(session: Session, config: Path | None, error: BaseException | None, *, delivered: bool) -> list[str]:
    """How to go on with a session that an error has ended, in lines; the command comes last.

    A session that was over when the error came, as where the device could not be let go of, has nothing to go on with.

    Args:
        session: the session.
        config: the configuration that it was run with; None where there was none.
        error: what ended it.
        delivered: whether it had delivered anything since it was begun or resumed.
    """
    if _is_over(session.log_path):
        seen = command("show", session.log_path)
        return [f"The session is over, and its log is complete. See what was found with: {seen}"]
    limited = config is not None and isinstance(error, LimitExceededError)
    lines = (
        [f"The limits are under [limits] in {config}; they are read again when the session is resumed."]
        if limited
        else []
    )
    safe = "The session ended early. Its log is safe" if delivered else "No stimulus was delivered. The log is kept"
    return [*lines, f"{safe}; go on with: {continued_by(session.log_path, session.header, config, changed=limited)}"]


def _is_over(log: Path) -> bool:
    """Whether the log's last decision was to stop, so that nothing is missing in it."""
    try:
        decision = read_session(log).decision
    except IsiwError:
        return False
    return decision is not None and decision.stop


def after_end(session: Session, config: Path | None, *, delivered: bool) -> str | None:
    """How more can be delivered to the same person after a session is over; None where nobody has asked for that.

    Args:
        session: the session, after a decision that stops.
        config: the configuration that it was run with; None where there was none.
        delivered: whether it has delivered anything since it was begun or resumed.
    """
    if not session.strategy.decision().stop:  # so that it was the limits
        where = f"in {config}" if config is not None else "of a configuration"
        way_on = continued_by(session.log_path, session.header, config, changed=True)
        return f"For more pulses set a higher max_pulses under [limits] {where}, then go on with: {way_on}"
    if delivered:
        return None
    same = "" if config else ", with the same configuration if there was one"
    more = f"For more trials with this person begin a new session{same}: {_anew(session, config)}"
    return f"The session is over, so no stimulus was delivered. {more}"


def _anew(session: Session, config: Path | None) -> str:
    """The command that begins a session of the same person, from what this one has found where its strategy can."""
    header = session.header
    seed = ["--seed", header.seed] if RUN_KEY in header.config else []
    after = ["--after", session.log_path] if learns_from_earlier(header.strategy.name) else []
    return command("run", *([config] if config else []), *seed, *after)
