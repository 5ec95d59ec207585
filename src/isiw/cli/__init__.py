"""The command line. Everything else is loaded only once a command runs, so that `--help` is there at once."""

from isiw.cli.main import app

__all__ = ["app"]
