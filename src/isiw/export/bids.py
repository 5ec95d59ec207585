"""A BIDS data set (BIDS 1.11): all trials of each session as a table, and its sweeps as EMG where there are any."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import isiw
from isiw.errors import InvalidValueError
from isiw.export import emg
from isiw.export.collection import Part, log_losses, stimulus_of
from isiw.export.emg import Run
from isiw.export.tables import Columns, session_columns, session_facts, tidy
from isiw.files import write_output
from isiw.lazy import pd
from isiw.log.frames import trial_columns, trial_frame
from isiw.text.sanitize import one_line

BIDS_VERSION: Final = "1.11.0"
TASK: Final = "pairedstimulation"
_PEOPLE: Final[Columns] = {
    "subject": ("", "the person's code"),
    "simulated": ("", "whether this person was simulated in all sessions"),
}

_MUSCLE: Final = {False: "at rest", True: "contracted"}
"""What it is said to be, by whether the session has it contracted."""

_README: Final = """# Sessions of isiw

{sessions} sessions of paired stimulation, {simulated} of them with simulated people. isiw looks for the inter-stimulus
intervals (ISI) at which {given} enhances the motor evoked potential (MEP).

- beh: all trials of a session, with their onsets and the estimate after each.
- emg: the sweeps, written end to end ("epoched"). Onsets in _events.tsv are times in the file; when a trial was in the
  session is session_s.
- sourcedata: the logs (MCAP), which hold everything; left out where the sessions are pseudonymised.

What is lacking:

{lacking}
"""


def write_bids(parts: Sequence[Part], folder: Path) -> list[str]:
    """Write a data set."""
    _require_distinct(parts)
    lacking = [sentence for part in parts for sentence in _write_session(part, folder)]
    columns = session_columns(stimulus_of(parts))
    people = [_write_person(list(own), folder, columns) for _, own in groupby(parts, key=_label)]
    _tsv(folder / "participants.tsv", pd.DataFrame(people))
    _write_heads(folder, parts, lacking)
    return lacking


def _label(part: Part) -> str:
    """The person's label: the letters and digits of the code."""
    return re.sub("[^0-9A-Za-z]", "", part.subject)


def _require_distinct(parts: Iterable[Part]) -> None:
    codes: dict[str, str] = {}
    for part in parts:
        label = _label(part).casefold()
        if not label or codes.setdefault(label, part.subject) != part.subject:
            raise InvalidValueError(
                "a person's code looks like another one's in the names of files",
                got=part.subject,
                expected="codes that differ in Latin letters or digits",
                remedy="Export with --pseudonymise, which numbers the people.",
            )


def _write_person(parts: Sequence[Part], folder: Path, columns: Iterable[str]) -> dict[str, Any]:
    """Write what a person's sessions are, and return what the person is."""
    label = _label(parts[0])
    rows = pd.DataFrame([{"session_id": f"ses-{part.session}", **session_facts(part.record)} for part in parts])
    kept = [name for name in rows.columns if name in {"session_id", *columns}]
    _tsv(folder / f"sub-{label}" / f"sub-{label}_sessions.tsv", rows[kept].astype({"day": "Int64"}))
    simulated = all(part.record.header.device.simulated for part in parts)
    return {"participant_id": f"sub-{label}", "subject": parts[0].subject, "simulated": simulated}


def _write_session(part: Part, folder: Path) -> list[str]:
    """Write a session, and return what of it is left out."""
    name, home = _name(part), _home(part, folder)
    trials = trial_frame(part.record).rename_axis("trial").reset_index()
    _tsv(home / "beh" / f"{name}_task-{TASK}_beh.tsv", trials)
    files = [f"beh/{name}_task-{TASK}_beh.tsv"]
    found, left_out = emg.runs(part.record)
    onsets_s = {trial: onset.onset_s for trial, onset in part.record.onsets.items()}
    for number, run in enumerate(found, start=1):
        stem = f"{name}_task-{TASK}_run-{number:02d}"
        write_output(home / "emg" / f"{stem}_emg.bdf", emg.bdf(run))
        _json(home / "emg" / f"{stem}_emg.json", _sidecar(run, part))
        _tsv(home / "emg" / f"{stem}_channels.tsv", pd.DataFrame(run.channels))
        _tsv(home / "emg" / f"{stem}_events.tsv", pd.DataFrame(run.events(onsets_s)))
        _json(home / "emg" / f"{stem}_events.json", _described(run.event_columns))
        files.append(f"emg/{stem}_emg.bdf")
    created = pd.to_datetime(part.record.header.created, errors="coerce", utc=True)
    begun = "" if pd.isna(created) else created.strftime("%Y-%m-%dT%H:%M:%SZ")
    scans = [{"filename": file, "acq_time": begun} for file in files]
    _tsv(home / f"{name}_scans.tsv", pd.DataFrame(scans))
    if part.record.path.is_file():
        source = folder / "sourcedata" / f"sub-{_label(part)}" / f"ses-{part.session}" / part.record.path.name
        write_output(source, part.record.path.read_bytes())
    return [f"{part}: {sentence}" for sentence in left_out]


def _task(parts: Sequence[Part]) -> dict[str, Any]:
    given = stimulus_of(parts).given
    muscle = sorted({_MUSCLE[part.record.header.signals.contracted] for part in parts}, reverse=True)
    return {
        "TaskName": TASK,
        "TaskDescription": f"{given[0].upper()}{given[1:]}, and after an inter-stimulus interval a pulse of "
        "transcranial magnetic stimulation; in control trials one of them alone. "
        f"The muscle is {' or '.join(muscle)}.",
    }


def _sidecar(run: Run, part: Part) -> dict[str, Any]:
    """The contents of `_emg.json`; what nobody has noted is said to be so."""
    visit, device = part.record.header.visit, part.record.header.device
    return _task([part]) | {
        "SamplingFrequency": run.layout.rate_hz,
        "RecordingType": "epoched",
        "EpochLength": run.sweep_s,
        "RecordingDuration": run.sweep_s * len(run.trials),
        "EMGPlacementScheme": "Other",
        "EMGPlacementSchemeDescription": _said("Muscle", visit.muscle) + " " + _said("Electrodes", visit.electrodes),
        "EMGReference": "n/a",
        "EMGChannelCount": sum(channel["type"] == "EMG" for channel in run.channels),
        "PowerLineFrequency": "n/a",
        "SoftwareFilters": "n/a",
        "HardwareFilters": "n/a",
        "DeviceDescription": device.name,
    }


def _said(what: str, text: str) -> str:
    return f"{what}: {text or 'not noted'}."


def _write_heads(folder: Path, parts: Sequence[Part], lacking: Iterable[str]) -> None:
    every = stimulus_of(parts)
    _json(folder / f"task-{TASK}_beh.json", _behaviour(parts))
    for part in parts:  # of which each says what its task was, if not all have one
        if _task([part]) != _task(parts):
            _json(_home(part, folder) / "beh" / f"{_name(part)}_task-{TASK}_beh.json", _behaviour([part]))
    _json(folder / "sessions.json", _described(session_columns(every)))
    _json(folder / "participants.json", _described(_PEOPLE))
    _json(
        folder / "dataset_description.json",
        {
            "Name": "Sessions of isiw",
            "BIDSVersion": BIDS_VERSION,
            "DatasetType": "raw",
            "GeneratedBy": [{"Name": "isiw", "Version": isiw.__version__}],
        },
    )
    simulated = sum(part.record.header.device.simulated for part in parts)
    missing = [f"{part}: {loss}" for part in parts for loss in log_losses(part.record)]
    said = "\n".join(f"- {one_line(each)}" for each in [*missing, *lacking] or ["nothing"])
    text = _README.format(sessions=len(parts), simulated=simulated, given=every.given, lacking=said)
    write_output(folder / "README", text.encode())


def _behaviour(parts: Sequence[Part]) -> dict[str, Any]:
    return _task(parts) | _described({"trial": ("", "its number"), **trial_columns(stimulus_of(parts))})


def _name(part: Part) -> str:
    return f"sub-{_label(part)}_ses-{part.session}"


def _home(part: Part, folder: Path) -> Path:
    return folder / f"sub-{_label(part)}" / f"ses-{part.session}"


def _described(columns: Columns) -> dict[str, dict[str, str]]:
    """Descriptions of columns; one with a unit must be finite, so an edge, which may be infinite, has it in words."""
    return {
        name: {"Description": f"{meaning} [{unit}]"}
        if name.startswith(("start_", "end_"))
        else {"Description": meaning} | ({"Units": unit} if unit else {})
        for name, (unit, meaning) in columns.items()
    }


def _tsv(path: Path, frame: pd.DataFrame) -> None:
    rows = tidy(frame).itertuples(index=False, name=None)
    lines = ["\t".join(map(_cell, row)) for row in [tuple(frame.columns), *rows]]
    write_output(path, ("\n".join(lines) + "\n").encode())


def _cell(value: Any) -> str:
    if pd.isna(value) or value == "":
        return "n/a"
    if isinstance(value, bool):
        return str(value).lower()
    return value.isoformat() if isinstance(value, pd.Timestamp) else str(value)


def _json(path: Path, content: Mapping[str, Any]) -> None:
    write_output(path, (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode())
