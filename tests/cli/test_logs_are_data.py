"""A log of a stranger: nothing that it names is run, imported or opened, and what is not needed stops nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from benchmarks.log_mutations import messages_of, write_messages

import isiw as library
from cli.conftest import Command

SPACE = library.DesignSpace(0, 500, reference="valve")


def write_log(path: Path, run: Any) -> Path:
    """A log of four trials whose header has this run section."""
    strategy = library.make_strategy("random", space=SPACE, seed=0, max_trials=10, particles=60)
    config = {"isiw_run": run}
    with library.open_session(strategy, log=path, config=config, clock=library.VirtualClock()) as session:
        for trial in range(4):
            session.tell(session.ask(), 0.1 + 0.01 * trial)
    return path


def test_resuming_a_log_runs_no_function_that_it_names(isiw: Command, tmp_path: Path) -> None:
    command = {"cmd": f"touch {tmp_path}/RUN"}
    write_log(tmp_path / "evil.mcap", {"device": {"factory": "subprocess:getoutput", "settings": command}})
    result = isiw("resume", "evil.mcap")
    assert result.exit_code == 1
    assert "the session's device is not known here" in result.output
    assert "Continue it where it was run" in result.output
    assert "Traceback" not in result.output
    assert not (tmp_path / "RUN").exists()


def test_resuming_a_log_imports_no_module_from_a_folder_that_it_names(isiw: Command, tmp_path: Path) -> None:
    folder = tmp_path / "mod"
    folder.mkdir()
    (folder / "planted_rig.py").write_text(f"open({str(tmp_path / 'IMPORTED')!r}, 'w')\n")
    write_log(tmp_path / "evil.mcap", {"device": {"factory": "planted_rig:make", "folder": str(folder)}})
    assert isiw("resume", "evil.mcap").exit_code == 1
    assert not (tmp_path / "IMPORTED").exists()


@pytest.mark.slow
@pytest.mark.parametrize("person", [{"cohort": "of-an-older-version"}, {"number": -1}, {"kind": "cloned"}, "nobody"])
@pytest.mark.parametrize("command", ["plot", "report"])
def test_a_log_of_an_unknown_person_is_drawn_without_the_truth(
    isiw: Command, tmp_path: Path, command: str, person: Any
) -> None:
    write_log(tmp_path / "odd.mcap", {"subject": person})
    result = isiw(command, "odd.mcap")
    assert result.exit_code == 0, result.output
    assert "The true window of the simulated person is not known" in result.output


def test_a_word_of_another_version_in_the_run_section_stops_nothing(isiw: Command, tmp_path: Path) -> None:
    write_log(tmp_path / "odd.mcap", {"subject": {"cohort": "gaussian", "age": 7}, "limits": 3, "robot": {"arm": 1}})
    result = isiw("plot", "odd.mcap")
    assert result.exit_code == 0
    assert "not known" not in result.output


@pytest.mark.slow
def test_recordings_are_opened_only_where_the_operator_names_them(
    isiw: Command, short: Path, recordings_folder: Path
) -> None:
    arguments = ("--subject", "recorded", "--data", recordings_folder, "--log", "r.mcap")
    assert isiw("run", short, *arguments).exit_code == 0
    refused = isiw("resume", "r.mcap")
    assert refused.exit_code == 1
    assert "nor taken from a log" in refused.output
    assert "--data DIR" in refused.output
    assert isiw("resume", "r.mcap", "--data", recordings_folder).exit_code == 0


def changed_header(log: Path, **parts: Any) -> None:
    """Write a log again with other parts in its headers."""
    messages = messages_of(log)
    for topic, values in messages:
        if topic == "/header":
            values.update(parts)
    write_messages(log, messages)


ODD: dict[str, Any] = {
    "limits": {"of_another_version": 1},
    "protocol": {"iti_s": "long"},
    "visit": "in the morning",
    "signals": {"mep_window_ms": "wide"},
    "device": {"name": "rig", "reference": "another"},
    "strategy": {"name": "default", "seed": 0, "settings": {"conditioning": "a sound"}},
    "timeout_s": "long",
    "versions": 7,
}
"""Parts of a header as this version cannot read them."""


@pytest.mark.parametrize("part", ODD)
def test_a_part_of_the_header_that_cannot_be_read_stops_what_needs_it_only(isiw: Command, log: Path, part: str) -> None:
    changed_header(log, **{part: ODD[part]})
    shown = isiw("show", log)
    assert shown.exit_code == 0, shown.output
    assert f"The log's {part} cannot be read by this version" in shown.output
    nothing = library.Measurement(mep_mv=0.1, isi_ms=100.0)
    with pytest.raises(library.errors.LogError, match=f"cannot be read: {part}"):
        library.resume(log, library.CallbackDevice(lambda *_: nothing, library.DeviceInfo("rig", reference="valve")))


@pytest.mark.slow
def test_a_log_whose_whole_header_is_odd_is_drawn_and_exported(isiw: Command, log: Path) -> None:
    changed_header(log, config="none", **ODD)
    for arguments in (("plot", log), ("report", log, "-o", "r.html")):
        result = isiw(*arguments)
        assert result.exit_code == 0, result.output
        assert result.output.count("cannot be read by this version") == len(ODD) + 1
    assert "cannot be read by this version" in Path("r.html").read_text("utf-8")
    assert isiw("export", log, "tables").exit_code == 3


def test_keys_of_another_version_in_the_header_stop_nothing(isiw: Command, log: Path) -> None:
    header = dict(messages_of(log)[0][1])
    more = {part: {**header[part], "more": 1} for part in ("limits", "protocol", "visit")}
    changed_header(log, more={"x": 1}, **more)
    result = isiw("show", log)
    assert (result.exit_code, "cannot be read" in result.output) == (0, False)
    assert library.read_session(log).unread == {}


def test_a_header_with_a_key_twice_is_not_read(isiw: Command, log: Path) -> None:
    write_messages(log, messages_of(log), doubled="subject")
    result = isiw("show", log)
    assert result.exit_code == 3
    assert "Traceback" not in result.output


def test_show_lists_the_head_and_the_end_of_a_long_log_and_all_of_it_where_asked(isiw: Command, log: Path) -> None:
    (header, *_), last = messages_of(log), [values for topic, values in messages_of(log) if topic == "/trial"][-1]
    write_messages(log, [header, *(("/trial", {**last, "index": number}) for number in range(1000))])
    shown = isiw("show", log).output
    assert "… 600 trials in between are not listed; --all lists them …" in shown
    rows = [line.split()[0] for line in shown.splitlines() if line[:1].isdigit()]
    assert (len(rows), rows[0], rows[-1]) == (400, "0", "999")
    assert len([line for line in isiw("show", log, "--all").output.splitlines() if line[:1].isdigit()]) == 1000


def test_a_log_of_more_trials_than_are_read_says_which_are_left(log: Path) -> None:
    header, *_ = messages_of(log)
    trial = next(values for topic, values in messages_of(log) if topic == "/trial")
    numbers = (0, 1, 99_999, 100_000, 123_456)
    write_messages(log, [header, *(("/trial", {**trial, "index": number}) for number in numbers)])
    record = library.read_session(log)
    assert [each.index for each in record.table] == [0, 1, 99_999]
    assert record.losses == ("Only trials up to 99999 are read: 2 records are of later ones.",)
