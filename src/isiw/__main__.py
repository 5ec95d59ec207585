"""`python -m isiw`, where the command `isiw` is not found."""

from isiw.cli import app

if __name__ == "__main__":
    app()
