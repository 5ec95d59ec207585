"""The exception tree.

Every message says what is wrong, what was got, what was expected, and the way out.

    IsiwError
    ├── InvalidValueError (ValueError)    an invalid value: NaN, negative, not finite, wrong shape
    │   └── OutOfSpaceError               an ISI beyond the design space and its tolerance
    ├── ConfigError (ValueError)          a configuration file, key or value that cannot be used
    ├── StrategyError (ValueError)        a strategy that cannot be built from these parts
    ├── DeviceError                       a device that failed, refused, or did not answer
    │   ├── LimitExceededError            a stimulus refused by a limit, before anything was delivered
    │   ├── NotDelivered                  a stimulus that the device refused before firing; it may be tried again
    │   ├── DeviceTimeoutError            no answer within the time allowed
    │   └── StillArmedError               a device that cannot be disarmed
    ├── RequestError                      a request that the server refuses
    ├── StudyError                        a study that cannot be run, continued or read
    └── LogError                          a log that cannot be written or read
        └── DamagedLogError               a log that ends too early or fails its checksums

Warnings, which are no errors:

    ClockWarning                          the computer's clock was set, so what was given counts by other evidence
    DiskWarning                           a disk cannot do all that a log asks of one
    ImplausibleDataWarning                data that look like a slip of unit; they are learnt all the same
    OtherVersionsWarning                  a session or study continues with other versions, and may choose other ISIs
"""

from __future__ import annotations

import difflib
import inspect
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager


class IsiwError(Exception):
    """The root of everything that isiw raises on purpose."""

    def __init__(
        self,
        what: str,
        *,
        got: object = None,
        expected: str | None = None,
        remedy: str | None = None,
        found: str | None = None,
    ) -> None:
        self.what, self.got, self.expected, self.remedy, self.found = what, got, expected, remedy, found
        parts = [_cut(what, _LONGEST_TEXT // 10)]
        if got is not None:
            parts.append(f"got {shortened(got)}")
        if expected is not None:
            parts.append(f"expected {_cut(expected, _LONGEST_TEXT // 10)}")
        remedy = remedy and _cut(remedy, _LONGEST_TEXT // 5)
        message = "; ".join(parts)
        super().__init__(f"{message}. {remedy}" if remedy else message)


class InvalidValueError(IsiwError, ValueError):
    """An invalid value: NaN, negative, not finite, of the wrong shape or unit."""


class OutOfSpaceError(InvalidValueError):
    """An ISI beyond the design space and its tolerance."""


class ConfigError(IsiwError, ValueError):
    """A configuration file, key or value that cannot be used."""


class StrategyError(IsiwError, ValueError):
    """A strategy that cannot be built from these parts."""


class DeviceError(IsiwError):
    """A device that failed, refused, or did not answer."""


class LimitExceededError(DeviceError):
    """A stimulus that a limit refused before anything was delivered."""


class NotDelivered(DeviceError):  # noqa: N818 - an outcome; that nothing was given is what it says
    """A stimulus that the device refused before firing: nothing was given, nothing counts, it may be tried again."""


class DeviceTimeoutError(DeviceError):
    """A device that did not answer within the time allowed."""


class StillArmedError(DeviceError):
    """A device that could not be disarmed, however often it was tried."""


class RequestError(IsiwError):
    """A request that the server refuses."""


class StudyError(IsiwError):
    """A study that cannot be run, continued or read."""


class ClockWarning(UserWarning):
    """The computer's clock was set, or is wrong: stimuli count for limits by other evidence, or as given just now."""


class DiskWarning(UserWarning):
    """A disk cannot do all that a log asks of one; what is written there is not as safe as elsewhere."""


class OtherVersionsWarning(UserWarning):
    """A session or a study continues with other versions than it began with, and may choose other ISIs."""


class ImplausibleDataWarning(UserWarning):
    """Data that were taken as they are, although they look like a slip of unit or order."""


class LogError(IsiwError):
    """A log that cannot be written or read."""


class DamagedLogError(LogError):
    """A log that ends too early or fails its checksums."""


_LONGEST_TEXT = 10_000
_LONGEST_GOT = 200


def shortened(value: object) -> str:
    """A value as it prints, of a long one the beginning and the end."""
    try:
        return _cut(repr(value), _LONGEST_GOT)
    except Exception:  # noqa: BLE001 - a whole number of thousands of digits, or an object that fails in any way
        return f"a value of the type {type(value).__name__} that cannot be printed"


def _cut(text: str, most: int) -> str:
    """A text without its middle, if it is longer than it may be; a path keeps its name at the end."""
    half = (most - 3) // 2
    return text if len(text) <= most else f"{text[:half]} … {text[-half:]}"


def error_text(error: BaseException) -> str:
    """An error's type and message, whatever its `__str__` does, as text that any file can hold."""
    try:
        text = str(error)
    except Exception:  # noqa: BLE001 - a device's own error may fail in any way when asked for its message
        text = "(its message cannot be shown)"
    whole = f"{type(error).__name__}: {text[:_LONGEST_TEXT]}"
    return whole.encode(errors="backslashreplace").decode()


@contextmanager
def os_errors(kind: type[IsiwError], what: str, got: object, remedy: str | None = None) -> Iterator[None]:
    """Within, an error of the operating system becomes one of isiw's."""
    try:
        yield
    except OSError as error:
        raise kind(f"{what}: {error.strerror}", got=str(got), remedy=remedy) from error


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line that called isiw, however deep inside it the reason was found."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)


def did_you_mean(given: object, known: Iterable[object]) -> str:
    """The known word that was probably meant, as a question; empty if none is near. Capitals make no difference."""
    words = {word.casefold(): word for word in map(str, known)}
    near = (
        difflib.get_close_matches(given.casefold(), words, n=1)
        if isinstance(given, str) and len(given) <= _LONGEST_GOT
        else []
    )
    return f"Did you mean {words[near[0]]}?" if near else ""
