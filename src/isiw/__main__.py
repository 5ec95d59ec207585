"""`python -m isiw`, where the command `isiw` is not found."""

from isiw.cli import app

app()
