"""Scripts in a process of their own that has everything imported already, which takes most of the time of a new one."""

from __future__ import annotations

import gc
import os
import sys
import traceback
from typing import IO, Never, Self

__all__ = ["Forked", "fork", "run_and_end"]


def fork() -> int:
    """`os.fork`, whose child frees nothing that is garbage already.

    An outlet that a test before left behind ends threads when it is freed, and the child has none of them.
    """
    gc.freeze()
    child = os.fork()
    if child:
        gc.unfreeze()
    return child


class Forked:
    """A script in a fork of this process, as `python -c` would run it; what it prints can be read.

    Args:
        script: the source text.
    """

    def __init__(self, script: str) -> None:
        (out, child_out), (err, child_err) = os.pipe(), os.pipe()
        self.process = fork()
        if self.process == 0:
            os.dup2(child_out, 1)
            os.dup2(child_err, 2)
            run_and_end(script)
        os.close(child_out)
        os.close(child_err)
        self.stdout: IO[str] = os.fdopen(out)
        self.stderr: IO[str] = os.fdopen(err)
        self._status: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        _ = self.returncode
        self.stdout.close()
        self.stderr.close()

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        os.kill(self.process, number)

    @property
    def returncode(self) -> int:
        """How it ended, once it has: its exit code, or minus the signal that ended it."""
        if self._status is None:
            self._status = os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])
        return self._status


def run_and_end(script: str) -> Never:
    """Run a script in a process that was just forked, and end that process.

    Args:
        script: the source text.
    """
    code = 0
    sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w")
    try:
        exec(compile(script, "<script>", "exec"), {"__name__": "__main__"})  # noqa: S102 - a script of a test
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:  # noqa: BLE001 - whatever it is, it ends this process alone
        traceback.print_exc()
        code = 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
