"""Runs commands on hostile files with an audit hook, and prints what they touched beyond what they may touch.

Usage: python watched.py FOLDER. In FOLDER/trap is what the files name; nothing of it may be imported or opened.
"""

from __future__ import annotations

import json
import os
import sys
import sysconfig
from pathlib import Path
from typing import Any

from benchmarks.log_mutations import messages_of, outcome_of, write_base, write_messages

from isiw.priors import population

FORBIDDEN = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.fork", "socket.connect", "socket.bind")

touched: list[str] = []
watching = False


def hostile_headers(trap: Path) -> list[dict[str, Any]]:
    """Parts of headers that name code and files."""
    rig = {"factory": "planted_rig:make", "folder": str(trap), "settings": {"cmd": f"touch {trap}/RUN"}}
    files = {"prior": str(trap / "lab.toml"), "after": [str(trap / "s.mcap")], "log": str(trap / "new.mcap")}
    data = {"subject": {"kind": "recorded", "data": str(trap)}}
    return [
        {"config": {"isiw_run": {"device": rig}}},
        {"config": {"isiw_run": {"device": rig | {"factory": "subprocess:getoutput"}}}},
        {"config": {"isiw_run": {**files, **data, "seed": 7}}},
        {"config": {"isiw_run": {"seed": 7}, "isiw_serve": {**files, "strategy": "planted_rig:make"}}},
        {"strategy": {"name": "planted_rig:make", "seed": 0, "settings": {}}},
        {"strategy": {"name": "default", "seed": 0, "settings": {"acquisition": "planted_rig:make"}}},
        {"strategy": {"name": "default", "seed": 0, "settings": {"prior": str(trap / "lab.toml")}}},
        {"subject": f"../../{trap.name}/P07", "visit": {"operator": f"file://{trap}/s.mcap", "electrodes": "${HOME}"}},
        {"device": {"name": f"<img src='file://{trap}/lab.toml'>", "reference": "valve", "address": str(trap)}},
    ]


def commands(folder: Path, number: int, log: str) -> list[tuple[str, ...]]:
    """All commands that read a log."""
    out = str(folder / f"out{number}")
    return [
        ("show", log),
        ("resume", log),
        ("plot", log, "-o", f"{out}.png"),
        ("report", log, "-o", f"{out}.html"),
        ("export", log, f"{out}_tables"),
        ("export", log, f"{out}_bids", "--to", "bids"),
        ("compare", log, str(folder / "whole.mcap"), "-o", f"{out}_both.html"),
        ("timing", log),
        ("threshold", log, "--show"),
        ("interval", log, "--show"),
        ("prior", "learn", log, "-o", f"{out}.toml"),
        ("run", str(folder / "config.toml"), "--after", log, "--log", f"{out}.mcap"),
    ]


def other_files(folder: Path, trap: Path) -> list[tuple[str, ...]]:
    """Commands on priors and studies that name code and files."""
    prior, study = folder / "prior.toml", folder / "study.toml"
    prior.write_text(f'schema_version = 2\nfactory = "planted_rig:make"\nfile = "{trap}/lab.toml"\n')
    study.write_text(f'strategies = ["planted_rig:make"]\ncohorts = ["{trap}"]\npeople = 1\ntrials = 1\n')
    (folder / "begun.study" / "parts").mkdir(parents=True)
    (folder / "begun.study" / "study.toml").write_text(study.read_text() + '[versions]\nisiw = "0.1.0"\n')
    (folder / "begun.study" / "parts" / "x.00000000.parquet").write_bytes(b"\x80\x04cposix\nsystem\n")
    return [
        ("prior", "show", str(prior)),
        ("run", str(folder / "config.toml"), "--prior", str(prior), "--log", str(folder / "p.mcap")),
        ("study", "run", str(study), "--workers", "1"),
        ("study", "run", str(folder / "begun.study"), "--workers", "1"),
        ("study", "run", str(folder / "begun.study"), "--out", str(folder / "elsewhere.study"), "--workers", "1"),
        ("study", "summary", str(folder / "begun.study")),
    ]


def watch(event: str, arguments: tuple[Any, ...]) -> None:
    """Note what may not be touched."""
    if not watching:
        return
    if event.startswith(FORBIDDEN) or (event == "import" and str(arguments[0]).startswith("planted")):
        touched.append(f"{event} {arguments[0]!r}")
    elif event in {"open", "os.listdir", "os.scandir"} and isinstance(arguments[0], str | bytes | os.PathLike):
        path = os.path.realpath(os.fsdecode(arguments[0]))
        if not path.startswith(ALLOWED) or path.startswith(TRAP):
            touched.append(f"{event} {path}")


if __name__ == "__main__":
    place = Path(sys.argv[1]).resolve()
    TRAP = str(place / "trap")
    own = [place / "work", Path(__file__).parents[2], sys.prefix, sys.base_prefix, sysconfig.get_path("stdlib")]
    ALLOWED = (*map(str, own), "/dev/", "/proc/", "/sys/", "/usr/share/", "/usr/lib/", "/etc/")
    work = place / "work"
    os.chdir(work)
    population.SWEEPS, population.BURN_IN = 60, 20  # type: ignore[misc] # what a lab's prior is learnt of is not its numbers
    write_base(work)
    for warmed_up in commands(work, 99, str(work / "whole.mcap")):  # what is cached on a first call is not the file's
        outcome_of(*warmed_up)
    messages = messages_of(work / "whole.mcap")
    runs = other_files(work, Path(TRAP))
    for number, parts in enumerate(hostile_headers(Path(TRAP))):
        log = work / f"hostile{number}.mcap"
        changed = [(topic, {**values, **parts} if topic == "/header" else values) for topic, values in messages]
        write_messages(log, changed)
        every = commands(work, number, str(log))
        runs += every if number < 1 else [every[0], every[1], every[2 + number]]
    sys.addaudithook(watch)
    watching = True
    (place / "trap" / "lab.toml").read_text()
    if not touched:
        sys.exit("the hook sees nothing")
    touched.clear()
    failed = [f"{' '.join(run)}: {wrong}" for run in runs if (wrong := outcome_of(*run))]
    watching = False
    sys.stdout.write(json.dumps({"touched": sorted(set(touched)), "failed": failed, "runs": len(runs)}))
