"""Write the description of the server's calls, as it is in the code.

    python docs/write_openapi.py

writes `docs/lab/openapi.json`. Needs the serve extra.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from isiw.server import Rules, make_app

DESCRIPTION = Path(__file__).parent / "lab" / "openapi.json"


def description() -> str:
    """The description as text."""
    with tempfile.TemporaryDirectory() as folder:
        return json.dumps(make_app(folder, Rules("of no server at all")).openapi(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    DESCRIPTION.write_text(description(), encoding="utf-8")
