"""The terminal: a thread reads single keys, and another writes, so that keys are heard if no output is taken."""

from __future__ import annotations

import codecs
import os
import queue
import re
import select
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final, Self

from isiw.text.sanitize import plain

if sys.platform == "win32":
    import msvcrt
else:
    import termios
    import tty

COLUMNS: Final = 80
"""The width of all that is shown, if nobody knows that of the terminal."""

_GLANCE_S = 0.1
_LAST_WORDS_S = 1.0
ERASED: Final = "\b \b"
"""The text that takes back the last sign that was typed."""

ESCAPE: Final = "\x1b"

# What a terminal sends for an arrow, a function key, or a letter with Alt: Escape and more, all at once.
_SEQUENCE = re.compile(
    r"\x1b+(\[\[.|\[[ -?]*[^ -?\[]|O[ -?]*[^ -?]|[]PX^_].*?(\x07|\x1b\\)|[^\x1b\[O\]PX^_])", re.DOTALL
)
_BEGUN = re.compile(r"\x1b+(\[\[|\[[ -?]*|O[ -?]*|[]PX^_].*)?$", re.DOTALL)

_as_they_were: dict[int, Any] = {}
"""The settings of terminals that are read key by key, for `restore`: a process that ends itself runs nothing else."""


def is_terminal(stream: object) -> bool:
    """True if somebody sits at the other end of a stream."""
    return bool(getattr(stream, "isatty", lambda: False)())


def columns() -> int:
    """The width of the terminal in which the operator reads; 80 if nobody knows."""
    return _wide() or COLUMNS


def _wide() -> int | None:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns
    except (AttributeError, OSError, ValueError):  # no terminal
        return None


def folded(text: str) -> str:
    """A text whose lines are no longer than the terminal, broken between words."""
    wide, lines = _wide() or len(text), text.split("\n")
    folds = (line if len(line) <= wide else textwrap.fill(line, wide, break_on_hyphens=False) for line in lines)
    return "\n".join(folds)


def is_attended() -> bool:
    """True if an operator at a terminal sees what is shown, and can press keys."""
    here = threading.current_thread() is threading.main_thread()  # a program with threads of its own has its own keys
    return here and is_terminal(sys.stdin) and is_terminal(sys.stderr)


def drop_typed_ahead() -> None:
    """Forget what was typed before it was asked for, if somebody sits at a terminal."""
    if not is_terminal(sys.stdin):
        return
    if sys.platform == "win32":
        while msvcrt.kbhit():
            msvcrt.getwch()
    else:
        with suppress(OSError, termios.error):  # the terminal is gone
            termios.tcflush(sys.stdin, termios.TCIFLUSH)


def restore() -> None:
    """Give every terminal its settings back; from any thread."""
    for terminal in list(_as_they_were):
        _set_back(terminal)


class Screen:
    """Shows text on standard error; whoever shows something never waits for the terminal."""

    def __init__(self) -> None:
        self._texts: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._typed = self._counting = self._standing = ""
        self._thread = threading.Thread(target=self._write, name="isiw screen", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._line:
            self._texts.put("\n")
        self._texts.put(None)
        self._thread.join(_LAST_WORDS_S)  # a terminal that takes no output must not keep a session open

    def say(self, text: str, standing: str | None = None) -> None:
        """Show a line, above the last one, which stays."""
        cleared = self._cleared
        if standing is not None:
            self._standing = plain(standing)
        self._texts.put(f"{cleared}{folded(plain(text))}\n{self._line}")

    def type(self, text: str) -> None:
        """Show what is being typed, in the last line."""
        begun = "" if self._typed else self._cleared
        if text == "\n":
            self._typed = ""
            self._texts.put(f"\n{self._line}")
        else:
            self._typed = self._typed[:-1] if text == ERASED else self._typed + text
            too_long = len(self._typed) >= columns() - 1  # what went on in another line could not be taken back
            self._texts.put(f"\r{self._line}\x1b[K" if too_long else f"{begun}{text}")

    def count_down(self, text: str) -> None:
        """Show a line in the place of the last one that counted down."""
        self._counting = plain(text)
        if not self._typed:
            self._texts.put(f"\r{self._line}\x1b[K")

    def counted_down(self) -> None:
        """Clear the line that counted down, if there is one."""
        if self._counting:
            self._counting = ""
            self._texts.put(f"\r\x1b[K{self._line}")

    @property
    def _line(self) -> str:
        """The last line, which is written over: of what is typed its end, of anything else its beginning."""
        most = columns() - 1
        return self._typed[-most:] or (self._counting or self._standing)[:most]

    @property
    def _cleared(self) -> str:
        return "\r\x1b[K" if self._line else ""

    def _write(self) -> None:
        with suppress(OSError, ValueError):  # the terminal is gone
            while (text := self._texts.get()) is not None:
                encoding = sys.stderr.encoding or "utf-8"  # a question mark for each sign that the terminal lacks
                sys.stderr.write(text.encode(encoding, "replace").decode(encoding))
                sys.stderr.flush()


def typed(text: str) -> tuple[str, str]:
    """The characters that were typed, without arrows and function keys, whose letters mean nothing of their own."""
    text = _SEQUENCE.sub("", text)
    begun = _BEGUN.search(text)
    return (text, "") if begun is None else (text[: begun.start()], begun.group())


class Keys:
    """Reads single keys while it is entered, but not in the background, where reading would stop the process."""

    def __init__(self, press: Callable[[str], None], gone: Callable[[], None]) -> None:
        self._press, self._gone = press, gone
        self._over = threading.Event()
        self._terminal = sys.stdin.fileno()
        self._thread = threading.Thread(target=self._read, name="isiw keys", daemon=True)

    def __enter__(self) -> Self:
        self._take()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(_LAST_WORDS_S)
        _set_back(self._terminal)

    @contextmanager
    def away(self) -> Iterator[None]:
        """Within, the terminal has its own settings, as while the process is suspended."""
        _set_back(self._terminal)
        try:
            yield
        finally:
            self._take()

    def _read(self) -> None:
        try:
            self._listen()
        finally:
            if not self._over.is_set():
                self._gone()

    def _listen(self) -> None:
        decoder, begun = codecs.getincrementaldecoder("utf-8")(errors="ignore"), ""
        while not self._over.is_set() and (data := self._next()) != b"":
            if data is not None:
                characters, begun = typed(begun + decoder.decode(data))
            else:  # nothing more has come: Escape alone is a key, and the rest of a sequence is none
                characters, begun = ESCAPE if set(begun) == {ESCAPE} else "", ""
            for character in characters:
                self._press(character)

    if sys.platform == "win32":

        def _take(self) -> None:
            """Nothing has to be set."""

        def _next(self) -> bytes | None:
            if not msvcrt.kbhit():
                self._over.wait(_GLANCE_S)
                return None
            character = msvcrt.getwch()
            if character in "\x00\xe0":  # an arrow or a function key, which is two characters
                msvcrt.getwch()
                return None
            return character.encode()

    else:

        def _take(self) -> None:
            if _in_foreground(self._terminal):
                _as_they_were[self._terminal] = termios.tcgetattr(self._terminal)
                tty.setcbreak(self._terminal, termios.TCSANOW)

        def _next(self) -> bytes | None:
            """The bytes that were typed; None after a glance without, and none if the terminal is gone."""
            try:
                if not _in_foreground(self._terminal):
                    self._over.wait(_GLANCE_S)
                    return None
                ready, _, _ = select.select([self._terminal], [], [], _GLANCE_S)
                return os.read(self._terminal, 1024) if ready else None
            except OSError:
                return b""


if sys.platform == "win32":

    def _set_back(terminal: int) -> None:
        _as_they_were.pop(terminal, None)

else:

    def _in_foreground(terminal: int) -> bool:
        try:
            return os.tcgetpgrp(terminal) == os.getpgrp()
        except OSError:  # not the process's own terminal, which therefore does not stop it
            return True

    def _set_back(terminal: int) -> None:
        before = _as_they_were.pop(terminal, None)
        with suppress(OSError, termios.error):  # the terminal is gone
            if before is not None and _in_foreground(terminal):
                termios.tcsetattr(terminal, termios.TCSANOW, before)


def goes_on(reason: str) -> bool:
    """Ask in the terminal whether to go on; no, if there is no terminal."""
    if not (is_terminal(sys.stdin) and is_terminal(sys.stderr)):
        return False
    drop_typed_ahead()  # an earlier y arms nothing
    alarm(f"\n{reason} The device is disarmed. Continue? [y/N] ", end="")
    return sys.stdin.readline().strip().lower() in {"y", "yes"}


def alarm(text: str, *, end: str = "\n") -> None:
    """Say something on the screen at once."""
    if sys.stderr is not None:  # as under pythonw
        sys.stderr.write(f"{plain(text)}{end}")
        sys.stderr.flush()
