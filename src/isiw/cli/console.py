"""The parts that all commands share: printing, and errors that end as a message and an exit code."""

from __future__ import annotations

import itertools
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

import isiw
from isiw.text.sanitize import counted, plain

if TYPE_CHECKING:
    from isiw.log.record import SessionRecord

_SILENT_S = 1.5

DAMAGED = 3
NOT_OVER = 5  # a session that a person should look at, or that its operator ended early
INTERRUPTED = 130  # what shells report for Ctrl-C

SESSIONS, LOGS, STUDIES = "Sessions and devices", "Logs", "Strategies, priors and studies"  # panels of isiw --help


Beside = Annotated[Path | None, typer.Option("--output", "-o", help="The file to write; by default beside the log.")]
Picture = Annotated[Path | None, typer.Option("--output", "-o", help="Picture to draw.")]
Overwrite = Annotated[bool, typer.Option(help="Replace an existing file (never a log).")]


def show(text: str, *, style: str | None = None, stderr: bool = False) -> None:
    """Print, coloured if the output is a terminal; what the terminal would obey is left out."""
    Console(stderr=stderr, highlight=False, soft_wrap=True, emoji=False).print(plain(text), style=style, markup=False)


def show_statement(text: str) -> None:
    """Print a statement line by line, as wide as the terminal; a command at a line's end has one, to be copied."""
    console = Console(highlight=False, emoji=False)
    for number, line in enumerate(text.split("\n")):
        said, found, way_on = line.rpartition(": isiw ")
        if not (found and console.is_terminal):
            said, found, way_on = line, "", ""
        style = "yellow" if line.startswith("Warning: ") else "bold" if not number or line.startswith("Do: ") else None
        console.print(plain(said + found[:1]), style=style, markup=False, soft_wrap=not console.is_terminal)
        if found:
            show(f"isiw {way_on}", style="bold")


@contextmanager
def ticking(said: Callable[[], str]) -> Iterator[None]:
    """Within, a pipe gets a line after a second, and then ever less often: nobody takes a silent command for dead."""
    begun_s, ended = time.monotonic(), threading.Event()

    def tick() -> None:
        with suppress(OSError):  # nobody reads any more
            while not ended.wait(max(_SILENT_S, (time.monotonic() - begun_s) / 4)):
                show(said(), stderr=True)

    thread = threading.Thread(target=tick, daemon=True)
    if not Console(stderr=True).is_terminal:
        thread.start()
    try:
        yield
    finally:
        ended.set()
        if thread.ident is not None:
            thread.join()


@contextmanager
def working(doing: str, *, stderr: bool = True) -> Iterator[Callable[[str], None]]:
    """Print what is done; within, nothing else is printed, and a terminal or pipe shows how far it is."""
    begun_s, far = time.monotonic(), ""
    show(f"{doing} …", stderr=stderr)
    with Console(stderr=True).status("") as status:

        def note(said: str) -> None:
            nonlocal far
            far = said
            status.update(said)

        with ticking(lambda: far or f"{doing}: {time.monotonic() - begun_s:.0f} s"):
            yield note


@contextmanager
def counting(doing: str, number: int, thing: str) -> Iterator[Callable[[int], None]]:
    """Print what is done with how many things, and within how many are done; nothing of none."""
    if not number:
        yield lambda _done: None
        return
    with working(f"{doing} {counted(number, thing)}", stderr=False) as note:
        yield lambda done: note(f"{done} of {number}")


def exit_if_damaged(losses: Sequence[str]) -> None:
    """Print what is lost of a log and end with the exit code of damaged ones; nothing if all is there."""
    for loss in losses:
        show(loss, style="red")
    if losses:
        raise typer.Exit(DAMAGED)


def say_unread(record: SessionRecord) -> None:
    """Print which parts of a log's header this version cannot read."""
    for sentence in record.unread_said:
        show(sentence, style="yellow", stderr=True)


@contextmanager
def errors_reported(interrupted: str = "Interrupted.") -> Iterator[None]:
    """Turn errors into a message and an exit code; those of a lab's own code keep their traceback."""
    try:
        with _interruptible():
            yield
    except isiw.errors.IsiwError as error:
        show(f"error: {error}", style="red", stderr=True)
        raise typer.Exit(DAMAGED if isinstance(error, isiw.errors.DamagedLogError) else 1) from error
    except OSError as error:
        way_on = "Check that path, its permissions, and the room on its disk."
        text = f"{error.filename}: {error.strerror}. {way_on}" if error.filename and error.strerror else str(error)
        show(f"error: {text}", style="red", stderr=True)
        raise typer.Exit(1) from error
    except KeyboardInterrupt as error:
        show(interrupted, style="red", stderr=True)
        raise typer.Exit(INTERRUPTED) from error
    except (typer.Exit, typer.Abort):
        raise
    except (Exception, SystemExit) as error:
        if isinstance(error.__context__, BrokenPipeError):  # whoever read the output has enough of it
            raise typer.Exit(1) from error
        show(traceback.format_exc(), stderr=True)
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}, line {place.lineno}"
        show(f"error: {type(error).__name__}: {error} ({where})", style="red", stderr=True)
        raise typer.Exit(1) from error


@contextmanager
def _interruptible() -> Iterator[None]:
    """Within, Ctrl-C is a KeyboardInterrupt."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler or signal.SIG_DFL)  # None if it was not set by Python


def is_given(context: typer.Context, name: str) -> bool:
    """True if an option stands on the command line, be it with its default."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def refuse_ignored(why: str, context: typer.Context, *names: str) -> None:
    """Refuse options that would be ignored."""
    given = [f"--{name.replace('_', '-')}" for name in names if is_given(context, name)]
    if given:
        raise isiw.errors.ConfigError(why, got=", ".join(given), remedy="Leave these options out.")


def log_exists(source: str | Path) -> bool:
    """True if there is a log of this name, closed or not."""
    closed = str(source).removesuffix(".part")
    return Path(closed).is_file() or Path(f"{closed}.part").is_file()


def free_beside(log: Path, suffix: str, *, overwrite: bool = False) -> Path:
    """Where a file goes that nobody gave a place: beside its log, under a free name, or the log's to overwrite."""
    stem = Path(log.name.removesuffix(".part")).stem
    if overwrite:
        return log.with_name(f"{stem}{suffix}")
    names = itertools.chain([stem], (f"{stem}_{number}" for number in itertools.count(2)))
    return next(path for path in (log.with_name(f"{name}{suffix}") for name in names) if not os.path.lexists(path))
