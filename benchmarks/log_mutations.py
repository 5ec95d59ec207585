"""What the commands make of logs in which values, keys, records and topics are other ones than isiw wrote.

    python -m benchmarks.log_mutations > benchmarks/results/log_mutations.md    2,000 logs
    python -m benchmarks.log_mutations --cases 200

Every checksum of such a log is right, as in one that another version or somebody else wrote. Each goes through
`isiw show`, `isiw resume` and one other command; a case fails where a command ends in anything but an answer or a
message. The picture at the end of a resumed session is not drawn; `isiw plot` is among the other commands.
"""

from __future__ import annotations

import argparse
import collections
import copy
import io
import json
import math
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import nullcontext, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, Final, NamedTuple
from unittest import mock

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from typer.main import get_command

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.cli import app

ABSURD: Final[tuple[Any, ...]] = (
    None, True, -1, 0, 0.5, 1e30, 1e308, -1e308, 10**400, "", "x", "of-another-version", "\x1b]0;x\x07", "é" * 2000,
    "../../etc/passwd", "subprocess:getoutput", "NaN", "Infinity", "-Infinity", [], [1, 2], {}, {"a": {"b": 1}}, [[]],
)  # fmt: skip
"""What takes the place of a value."""

OTHERS: Final[tuple[tuple[str, ...], ...]] = (
    ("plot", "LOG", "-o", "OUT.png"),
    ("report", "LOG", "-o", "OUT.html"),
    ("export", "LOG", "OUT"),
    ("export", "LOG", "OUT", "--pseudonymise"),
    ("export", "LOG", "OUT", "--to", "bids"),
    ("compare", "LOG", "WHOLE", "-o", "OUT.html"),
    ("timing", "LOG"),
    ("exclude", "LOG", "1", "--reason", "cough"),
    ("include", "LOG", "1"),
    ("prior", "learn", "LOG", "-o", "OUT.toml"),
    ("run", "CONFIG", "--after", "LOG", "--log", "OUT.mcap"),
    ("threshold", "LOG", "--show"),
    ("threshold", "LOG", "--resume"),
    ("interval", "LOG", "--show"),
)
"""The other commands that read a log."""

CONFIG: Final = "[strategy.settings]\nmax_trials = 1\nparticles = 50\n"

_APP: Final = get_command(app)

Message = tuple[str, Any]
"""A topic, and the values of a record."""


class Fault(NamedTuple):
    """A command that ended in anything but an answer or a message."""

    case: int
    mutations: tuple[str, ...]
    command: str
    detail: str


def write_log(path: Path, trials: int = 5) -> Path:
    """The log of a short session with a simulated person and waveforms of two channels."""
    space = isiw.DesignSpace(0, 100, 5, reference="valve")
    run = {"seed": 7, "subject": {"kind": "simulated", "cohort": "recruitment", "number": 0}}
    person = isiw.subjects.cohort("recruitment", 1, 7)[0].begin(7)
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(lambda isi_ms: person.respond(isi_ms, "valve"), "valve"))
    strategy = isiw.make_strategy("random", space, particles=50, max_trials=trials)
    isiw.Session(device, strategy, log=path, subject="P07", config={"isiw_run": run}).run()
    return path


def messages_of(path: Path) -> list[Message]:
    """The records of a log, in their order."""
    with path.open("rb") as file:
        return [(channel.topic, json.loads(message.data)) for _, channel, message in make_reader(file).iter_messages()]


def write_messages(path: Path, messages: list[Message], *, doubled: str | None = None) -> None:
    """A log of these records, whole as MCAP.

    Args:
        path: where to.
        messages: the records.
        doubled: a key that the first header has twice.
    """
    stream = io.BytesIO()
    writer = Writer(stream, enable_data_crcs=True)
    writer.start(profile="isiw", library="isiw")
    schema, channels = writer.register_schema("any", "jsonschema", b"{}"), dict[str, int]()
    for number, (topic, values) in enumerate(messages):
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "json", schema)
        data = json.dumps(values)
        if doubled is not None and topic == "/header":
            data, doubled = f"{{{json.dumps(doubled)}: 0, {data[1:]}", None
        at_ns = 1_800_000_000_000_000_000 + number
        writer.add_message(channels[topic], at_ns, data.encode(), at_ns, number)
    writer.finish()
    path.write_bytes(stream.getvalue())


def mutated(messages: list[Message], rng: np.random.Generator) -> tuple[list[Message], str | None, tuple[str, ...]]:
    """Records with one to three changes, a key of the header that is to be there twice, and what was changed."""
    changed, doubled, said = copy.deepcopy(messages), None, []
    for _ in range(int(rng.integers(1, 4))):
        kind = rng.choice(["value", "value", "value", "run", "key", "extra", "topic", "drop", "twice", "order"])
        headers = [number for number, (topic, _) in enumerate(changed) if topic == "/header"]
        number = int(rng.choice(headers)) if headers and rng.random() < 0.6 else int(rng.integers(len(changed)))
        topic, values = changed[number]
        if kind in {"value", "key", "extra"} and isinstance(values, dict):
            said.append(f"{topic} {_change(values, str(kind), rng)}")
        elif kind == "run" and headers:
            said.append(_change_run(changed[headers[0]][1], rng))
        elif kind == "topic":
            other = str(rng.choice(["/trial", "/header", "/event", "/x", "/production", "/threshold/pulse", "/"]))
            changed[number] = (other, values)
            said.append(f"{topic} as {other}")
        elif kind == "drop" and len(changed) > 1:
            del changed[number]
            said.append(f"{topic} left out")
        elif kind == "twice":
            doubled = str(rng.choice(["seed", "limits", "config", "strategy", "space"]))
            said.append(f"{doubled} twice")
        else:
            changed.insert(int(rng.integers(len(changed))), changed.pop(number))
            said.append(f"{topic} elsewhere")
    return changed, doubled, tuple(said)


def _change(values: dict[str, Any], kind: str, rng: np.random.Generator) -> str:
    """Change a value, leave out a key, or add one, anywhere in a record; says what."""
    place: Any = values
    way: list[str] = []
    while isinstance(place, dict) and place:
        key = str(rng.choice(list(place)))
        way.append(key)
        if not (isinstance(place[key], dict) and place[key]) or rng.random() < 0.15:
            break
        place = place[key]
    if not way:
        return "nothing"
    if kind == "key":
        del place[way[-1]]
    elif kind == "extra":
        place["of_another_version"] = {"x": 1}
    else:
        place[way[-1]] = copy.deepcopy(ABSURD[int(rng.integers(len(ABSURD)))])
    return f"{kind} {'.'.join(way)} = {str(place.get(way[-1]))[:40]}"


def _change_run(header: Any, rng: np.random.Generator) -> str:
    """Put something else into the section that says who was simulated; says what."""
    sections: list[Any] = [
        *ABSURD,
        {"device": {"factory": "subprocess:getoutput", "settings": {"cmd": "false"}}},
        {"device": {"factory": "planted_rig:make", "folder": "/"}},
        {"prior": "/etc/passwd", "after": ["/etc/passwd"], "log": "/etc/passwd"},
        {"subject": {"kind": "recorded", "data": "/etc"}},
        {"subject": {"cohort": "of-another-version"}},
        {"seed": -5},
        {"seed": 10**400},
    ]
    section = sections[int(rng.integers(len(sections)))]
    if isinstance(header, dict):
        header["config"] = {"isiw_run": section}
    return f"run section {str(section)[:60]}"


def outcome_of(*arguments: str) -> str:
    """What is wrong with how a command ended; empty where it ended in an answer or a message."""
    drawn = mock.patch.object(isiw.plots, "save_session_plot") if arguments[0] == "resume" else nullcontext()
    said, code = io.StringIO(), None
    with drawn, mock.patch("sys.stdin", io.StringIO()), redirect_stdout(said), redirect_stderr(said):
        try:
            _APP(list(arguments), prog_name="isiw")
        except SystemExit as end:
            code = end.code
        except BaseException as error:  # noqa: BLE001 - which is what is looked for
            return repr(error)[:300]
    if "Traceback" in said.getvalue():
        return said.getvalue()[-600:]
    return "" if code in {0, None, 1, 3, 5} else f"exit code {code}"


def write_base(folder: Path, trials: int = 5) -> None:
    """Write the log that the others are made of, and a configuration."""
    write_log(folder / "whole.mcap", trials)
    (folder / "config.toml").write_text(CONFIG, encoding="utf-8")


def faults(
    folder: Path, cases: int, seed: int = 0, first: int = 0, others: tuple[tuple[str, ...], ...] = OTHERS
) -> Iterator[Fault]:
    """What went wrong with which command.

    Args:
        folder: with what `write_base` writes; the working one as well.
        cases: how many logs.
        seed: of the mutations.
        first: the number of the first of them.
        others: of which commands one is drawn for each log.
    """
    whole = folder / "whole.mcap"
    messages = messages_of(whole)
    for case in range(first, first + cases):
        rng = np.random.default_rng([seed, case])
        changed, doubled, said = mutated(messages, rng)
        other = others[int(rng.integers(len(others)))]
        for command in (("show", "LOG"), ("resume", "LOG"), other):
            log = folder / f"{case}.mcap"
            write_messages(log, changed, doubled=doubled)
            words = {"LOG": str(log), "WHOLE": str(whole), "CONFIG": str(folder / "config.toml")}
            out = str(folder / f"{case}_out")
            detail = outcome_of(*(words.get(word, word.replace("OUT", out)) for word in command))
            for left in folder.glob(f"{case}*"):
                if left.is_file():
                    left.unlink()
            if detail:
                yield Fault(case, said, " ".join(command), detail)


def main() -> None:
    """Change logs in many ways, and say which command failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2000, help="how many logs (default: 2000)")
    parser.add_argument("--seed", type=int, default=10_000, help="of the mutations (default: 10000)")
    parser.add_argument("--minutes", type=float, default=math.inf, help="end after so long, with what was done")
    chosen = parser.parse_args()
    begin_s, done, found, before = time.monotonic(), 0, list[Fault](), Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        write_base(Path(folder))
        while done < chosen.cases and time.monotonic() - begin_s < 60 * chosen.minutes:
            found += faults(Path(folder), 1, chosen.seed, done)
            done += 1
        os.chdir(before)
    ended = collections.Counter(fault.command.split()[0] for fault in found)
    print(f"- command: `{command_of('log_mutations')}`")
    print(f"- {made_with('mcap', 'pydantic')}, seed {chosen.seed}; {time.monotonic() - begin_s:.0f} s\n")
    print(f"{done:,} logs, each through `isiw show`, `isiw resume` and one of {len(OTHERS)} other commands.\n")
    print(f"Commands that ended in anything but an answer or a message: {len(found):,}.")
    for command, count in ended.most_common():
        print(f"- `isiw {command}`: {count:,}")
    for fault in found[:40]:
        print(f"\n{fault}")


if __name__ == "__main__":
    understood("log_mutations", prints=True)
    main()
