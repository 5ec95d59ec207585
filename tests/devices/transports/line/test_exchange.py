"""One open connection: answers are told from what else arrives, and memory is bounded."""

from __future__ import annotations

import io
import time
import tracemalloc
from contextlib import suppress
from typing import cast

import hypothesis
import pytest
from hypothesis import strategies as st

from isiw.devices.transports.line_exchange import Line, LineSettings
from isiw.devices.transports.line_table import Connection, LineExchange, LineHeartbeat, crc_of
from isiw.errors import DeviceError, DeviceTimeoutError

ASKED = LineExchange("{sequence} GET", r"(?P<sequence>\d+) ISI (?P<isi_ms>\S+)")
PLAIN = LineExchange("GET", r"ISI (?P<isi_ms>\S+)")


class Scripted:
    """Answers each command with what a script makes of it, {0} being its sequence number."""

    def __init__(self, script: bytes, *, endless: bool = False) -> None:
        self.script, self.endless, self.sent, self.waiting, self.open = script, endless, b"", b"", True

    def send(self, data: bytes) -> None:
        self.sent += data
        number = int(data.split()[0]) if data[:1].isdigit() else 0
        self.waiting += self.script.replace(b"{-1}", b"%d" % (number - 1)).replace(b"{0}", b"%d" % number)

    def receive(self, *, wait: bool = True) -> bytes:
        del wait
        if not self.open:
            raise OSError("closed")
        if self.endless:
            return b"9" * 4096
        come, self.waiting = self.waiting[:7], self.waiting[7:]  # in pieces
        return come

    def close(self) -> None:
        self.open = False


def line(script: bytes, *, endless: bool = False, refusal: str = "", line_end: str = "\n") -> tuple[Line, Scripted]:
    connection = Scripted(script, endless=endless)
    return Line(cast("Connection", connection), LineSettings(line_end=line_end), refusal), connection


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n"])
def test_an_answer_ends_by_a_line_feed_a_carriage_return_or_both(end: bytes) -> None:
    assert line(b"{0} ISI 50" + end)[0].ask(ASKED, timeout_s=1.0)["isi_ms"] == "50"


def test_an_answer_without_the_number_that_it_must_have_is_none() -> None:
    optional = LineExchange("{sequence} GET", r"(?:(?P<sequence>\d+) )?ISI (?P<isi_ms>\S+)")
    assert line(b"ISI 40\n{0} ISI 50\n")[0].ask(optional, timeout_s=1.0)["isi_ms"] == "50"


def test_a_command_ends_as_the_settings_say() -> None:
    asking, connection = line(b"ISI 50\n", line_end="\r\n")
    asking.ask(PLAIN, timeout_s=1.0)
    assert connection.sent == b"GET\r\n"


def test_an_answer_to_an_earlier_command_is_none_to_this_one() -> None:
    assert line(b"{-1} ISI 40\n{0} ISI 50\n{0} ISI 60\n")[0].ask(ASKED, timeout_s=1.0)["isi_ms"] == "50"


def test_without_numbers_what_came_before_the_command_is_thrown_away_and_said(warned: io.StringIO) -> None:
    asking, connection = line(b"ISI 50\n")
    connection.waiting = b"ISI 40\nIS"
    assert asking.ask(PLAIN, timeout_s=1.0)["isi_ms"] == "50"
    assert "thrown away before a command: 2 lines, last ['ISI 40', 'IS']" in warned.getvalue()


def test_a_missing_answer_says_what_came_instead_and_the_connection_is_not_trusted_any_more() -> None:
    asking, _ = line(b"what?\n")
    with pytest.raises(DeviceTimeoutError, match=r"GET.*what\?.*ISI"):
        asking.ask(ASKED, timeout_s=0.05)
    assert not asking.trusted


def test_a_refusal_is_one_to_its_own_command() -> None:
    refusal = r"(?P<sequence>\d+) ERR (?P<reason>.*)"
    assert line(b"{-1} ERR hot\n{0} ISI 50\n", refusal=refusal)[0].ask(ASKED, timeout_s=1.0)["isi_ms"] == "50"
    asking, _ = line(b"{0} ERR too hot\n", refusal=refusal)
    with pytest.raises(DeviceError, match="refuses; got 'too hot'"):
        asking.ask(ASKED, timeout_s=1.0)
    assert asking.trusted


@pytest.mark.parametrize("exchange", [ASKED, PLAIN])
def test_a_line_without_end_takes_neither_memory_nor_more_than_its_time(exchange: LineExchange) -> None:
    costs = (cost_of_an_endless_line(exchange) for _ in range(3))  # what else goes on may disturb one of them
    assert any(spent_s < 0.5 and most_bytes < 100_000 for spent_s, most_bytes in costs)


def cost_of_an_endless_line(exchange: LineExchange) -> tuple[float, int]:
    asking, _ = line(b"", endless=True)
    tracemalloc.start()
    began_s = time.monotonic()
    with pytest.raises(DeviceTimeoutError):
        asking.ask(exchange, timeout_s=0.2)
    spent_s, most_bytes = time.monotonic() - began_s, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return spent_s, most_bytes


def test_bytes_that_are_no_text_are_told_as_they_are() -> None:
    asking, _ = line(b"\xff\x00{0}\n")
    with pytest.raises(DeviceTimeoutError, match=r"xff"):
        asking.ask(ASKED, timeout_s=0.05)


@hypothesis.given(script=st.binary(max_size=60))
@hypothesis.settings(max_examples=100)
def test_whatever_bytes_come_the_answer_is_a_valid_one_or_an_error_of_the_device(script: bytes) -> None:
    asking, _ = line(script, refusal=r"(?P<sequence>\d+) ERR (?P<reason>.*)")
    with pytest.raises(DeviceError):
        asking.ask(ASKED, timeout_s=0.002)
    with suppress(DeviceError):
        asking.ask(PLAIN, timeout_s=0.002)


def test_a_connection_that_breaks_is_an_error_of_the_device() -> None:
    asking, connection = line(b"")
    connection.close()
    with pytest.raises(DeviceError, match="broke"):
        asking.ask(ASKED, timeout_s=0.05)
    assert not asking.trusted


def test_who_is_given_up_stops_waiting() -> None:
    with pytest.raises(DeviceError, match="stopped"):
        line(b"")[0].ask(ASKED, timeout_s=10.0, given_up=lambda: True)


def sealed_line(script: bytes) -> tuple[Line, Scripted]:
    connection = Scripted(script)
    return Line(cast("Connection", connection), LineSettings(checksum="crc16"), ""), connection


def test_the_checksum_is_that_of_xmodem() -> None:
    assert crc_of("123456789") == "31C3"


def test_a_command_is_sent_with_its_checksum_and_an_answer_with_another_one_is_none() -> None:
    right = f"ISI 50*{crc_of('ISI 50')}\n".encode()
    asked, connection = sealed_line(b"ISI 40*" + right[-5:] + b"ISI 30\n" + right)
    assert asked.ask(PLAIN, timeout_s=1.0) == {"isi_ms": "50"}
    assert connection.sent == f"GET*{crc_of('GET')}\n".encode()


def test_a_sign_of_life_is_sent_as_long_as_an_answer_is_awaited() -> None:
    asked, connection = line(b"")
    with pytest.raises(DeviceTimeoutError):
        asked.ask(PLAIN, timeout_s=0.2, heartbeat=LineHeartbeat("BEAT", 0.04))
    beats = connection.sent.count(b"BEAT\n")
    assert 2 <= beats <= 5
    with pytest.raises(DeviceTimeoutError):
        asked.ask(PLAIN, timeout_s=0.1)
    assert connection.sent.count(b"BEAT\n") == beats
