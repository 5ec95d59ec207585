"""What a notebook's kernel runs first: commands print without colours, wrapped as in a terminal."""

import os
import subprocess
import textwrap

from IPython.core.magic import register_cell_magic

for _name in ("FORCE_COLOR", "CLICOLOR", "CLICOLOR_FORCE"):
    os.environ.pop(_name, None)
os.environ |= {"NO_COLOR": "1", "TERM": "dumb", "COLUMNS": "90"}


@register_cell_magic
def bash(line: str, cell: str) -> None:
    """Run a cell in a shell, and print what it printed."""
    del line
    ended = subprocess.run(  # noqa: S603 - the cells are ours
        ["bash", "-e", "-c", cell],  # noqa: S607
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    for long in ended.stdout.splitlines():
        print(textwrap.fill(long, 90) if len(long) > 90 else long)  # noqa: T201
    if ended.returncode:
        raise RuntimeError(f"the cell ended with exit code {ended.returncode}")
