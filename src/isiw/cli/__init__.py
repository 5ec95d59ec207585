"""The command line. Everything else is loaded when a command runs, so that `--help` answers at once."""

from isiw.cli.main import app

__all__ = ["app"]
