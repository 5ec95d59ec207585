"""The table of an instrument's commands is checked before anything is sent."""

from __future__ import annotations

from typing import Any

import pytest
from benchmarks.pulse_peer import PEER_COMMANDS

import isiw
from isiw.devices.transports.line_exchange import LineSettings
from isiw.devices.transports.line_table import LineCommands, LineExchange, command_values, isi_ms_of
from isiw.errors import InvalidValueError


@pytest.mark.parametrize(
    ("name", "exchange", "words"),
    [
        ("set", {"send": "{sequence} SET", "reply": r"(?P<sequence>\d+) OK"}, "set must hold the ISI"),
        ("set", {"send": "{isi_ms} {isi_us}", "reply": "OK"}, "set must hold the ISI, in one unit"),
        ("set", {"send": "{isi}", "reply": "OK"}, "cannot be filled in.*isi_ms"),
        ("set", {"send": "{isi_ms:d}", "reply": "OK"}, "cannot be filled in"),
        ("set", {"send": "{isi_ms", "reply": "OK"}, "cannot be filled in"),
        ("set", {"send": "SET {isi_ms}\n", "reply": "OK"}, "one line of ASCII"),
        ("set", {"send": "SET {isi_us} µs", "reply": "OK"}, "one line of ASCII"),
        ("set", {"send": "SET {isi_ms}", "reply": "OK ("}, "pattern is invalid"),
        ("set", {"send": "SET {isi_ms}", "reply": r"(?P<sequence>\d+)"}, "sent and answered, or neither"),
        ("set", {"send": "{sequence} {isi_ms}", "reply": "OK"}, "sent and answered, or neither"),
        ("set", {"send": "SET {isi_ms}", "reply": "OK", "timeout_s": 0.0}, "timeout_s"),
        ("set", "SET {isi_ms}", "set must be a table"),
        ("read_back", {"send": "GET", "reply": "OK"}, "read_back must say the ISI"),
        ("arm", {"send": "ARM {isi_ms}", "reply": "OK"}, "command of arm has something unknown.*isi_ms"),
        ("disarm", {"send": "OFF", "reply": "(?P<said>OK)"}, "answer of disarm has something unknown.*said"),
        ("fire", {"send": "GO", "reply": "OK"}, "realised ISI"),
        ("refusal", "(?P<sequenz>.*)", "refusal says something unknown"),
        ("refusal", "(", "refusal is invalid"),
    ],
)
def test_a_command_that_cannot_work_is_named(name: str, exchange: Any, words: str) -> None:
    with pytest.raises(InvalidValueError, match=words):
        LineCommands(**{**PEER_COMMANDS, name: exchange})


def test_what_an_instrument_must_understand_cannot_be_left_out() -> None:
    commands = {name: each for name, each in PEER_COMMANDS.items() if name != "disarm"}
    with pytest.raises(InvalidValueError, match=r"commands: .*'disarm'"):
        isiw.LineDevice("socket://127.0.0.1:5000", {"name": "bench", "reference": "impact"}, commands)


@pytest.mark.parametrize(
    ("send", "sent"),
    [
        ("{isi_ms}", "50.1"),
        ("{isi_us}", "50100"),
        ("{isi_s}", "0.0501"),
        ("{isi_ms:08.3f}", "0050.100"),
        ("{{}}", "{}"),
    ],
)
def test_the_isi_is_sent_in_the_unit_and_format_of_the_instrument(send: str, sent: str) -> None:
    assert LineExchange(send, "OK").command(command_values(1, 0, 50.1)) == sent


def test_the_isi_is_read_in_the_unit_of_the_instrument() -> None:
    assert isi_ms_of({"isi_us": "50100"}) == pytest.approx(50.1)
    assert isi_ms_of({"isi_s": "0.0501"}) == pytest.approx(50.1)
    assert isi_ms_of({}) is None


@pytest.mark.parametrize("said", ["nan", "inf", "1e999", "", "fifty"])
def test_what_is_no_finite_number_is_refused(said: str) -> None:
    with pytest.raises(InvalidValueError, match="no finite number"):
        isi_ms_of({"isi_ms": said})


@pytest.mark.parametrize(
    "wrong", [{"line_end": "\n\n"}, {"baud": 0}, {"timeout_s": 0.0}, {"connect_s": -1.0}, {"isi_tolerance_ms": -1.0}]
)
def test_settings_that_cannot_work_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="LineSettings"):
        LineSettings(**wrong)
