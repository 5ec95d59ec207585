"""Files of a stranger, through every command that reads them: only they and what was named are opened; nothing runs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_hostile_files_open_nothing_import_nothing_and_run_nothing(tmp_path: Path) -> None:
    trap, work = tmp_path / "trap", tmp_path / "work"
    trap.mkdir()
    work.mkdir()
    (trap / "planted_rig.py").write_text(f"open({str(trap / 'IMPORTED')!r}, 'w')\n")
    for name in ("lab.toml", "s.mcap"):
        (trap / name).write_text("precious")
    root = Path(__file__).parents[2]
    places = {"MPLCONFIGDIR": str(work / "mpl"), "HOME": str(work), "TMPDIR": str(work), "PYTHONDONTWRITEBYTECODE": "1"}
    path = os.pathsep.join([str(root / "src"), str(root)])
    script = Path(__file__).with_name("watched.py")
    ended = subprocess.run(  # noqa: S603 - this test's own script
        [sys.executable, str(script), str(tmp_path)],
        env={**os.environ, **places, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    said = json.loads(ended.stdout.splitlines()[-1])
    assert said["touched"] == []
    assert said["failed"] == []
    assert said["runs"] > 35
    assert sorted(file.name for file in trap.iterdir()) == ["lab.toml", "planted_rig.py", "s.mcap"]
    assert {file.name for file in tmp_path.iterdir()} == {"trap", "work"}
