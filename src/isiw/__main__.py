"""The command `isiw`, and `python -m isiw` where that is not found."""

import os
import signal
import sys


def main() -> None:
    """Run the command line; Ctrl-C ends it in a sentence even before a command has begun."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # what is ignored, as under nohup, stays so
        signal.signal(signal.SIGINT, _ended)
    from isiw.cli import app  # noqa: PLC0415 - after the line above, since loading it takes a while

    app()


def _ended(*_: object) -> None:
    sys.stderr.write("Interrupted.\n")
    sys.stderr.flush()
    os._exit(130)  # nothing is open yet, or all is closed


if __name__ == "__main__":
    main()
