"""A log from anywhere is read within its limits, or refused in words."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from isiw.checks import MOST_TRIALS
from isiw.design import DesignSpace
from isiw.errors import LogError
from isiw.log.record import read_session
from isiw.log.records import MOST_LOSSES
from isiw.log.schema import CHANNEL_IDS
from isiw.log.writer import encode
from isiw.report import final_statement

ALLOWED_S = 2.0


@pytest.fixture
def foreign(tmp_path: Path, header: Any) -> Any:
    """Makes a log of any messages, by topic, and of any configuration."""

    def make(*messages: tuple[str, bytes], configuration: bytes = b"", with_header: bool = True) -> Any:
        path = tmp_path / "s.mcap"
        with path.open("wb") as file:
            writer = Writer(file, compression=CompressionType.ZSTD)
            writer.start(profile="isiw", library="foreign")
            for topic in CHANNEL_IDS:
                writer.register_channel(topic, "json", writer.register_schema(topic, "jsonschema", b"{}"))
            if configuration:
                writer.add_attachment(0, 0, "configuration.toml", "application/toml", configuration)
            first = [("/header", encode("/header", header))] if with_header else []
            for number, (topic, data) in enumerate([*first, *messages]):
                writer.add_message(CHANNEL_IDS[topic], 0, data, 0, number)
                writer.flush()
            writer.finish()
        return path

    return make


def read_in_time(path: Path) -> Any:
    begin = time.process_time()
    record = read_session(path)
    statement = final_statement(record)
    assert time.process_time() - begin < ALLOWED_S
    return record, statement


def unpacked_sizes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The size of each block that is unpacked from here on [bytes]."""
    sizes: list[int] = []
    usual = zstandard.decompress

    def decompress(data: bytes, size: int) -> bytes:
        sizes.append(size)
        return usual(data, size)

    monkeypatch.setattr(zstandard, "decompress", decompress)
    return sizes


@pytest.mark.slow
def test_a_block_that_unpacks_to_more_than_a_log_may_hold_is_left_out_unpacked(
    foreign: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = foreign(("/event", b'{"kind": "fault", "text": "' + b" " * (300 * 2**20) + b'"}'))
    assert path.stat().st_size < 100_000
    unpacked = unpacked_sizes(monkeypatch)
    record, _ = read_in_time(path)
    assert any("too large to be one" in loss for loss in record.losses)
    assert sum(unpacked) < 2 * 2**20


def test_a_block_that_unpacks_to_something_else_than_it_says_is_never_unpacked(
    foreign: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = foreign(("/event", b'{"kind": "fault", "text": "' + b" " * 2**20 + b'"}'))
    whole = path.read_bytes()
    at = whole.index(b"\x04\x00\x00\x00zstd", whole.index(b"\x04\x00\x00\x00zstd") + 1) - 12
    assert int.from_bytes(whole[at : at + 8], "little") > 2**20
    path.write_bytes(whole[:at] + (500).to_bytes(8, "little") + whole[at + 8 :])
    unpacked = unpacked_sizes(monkeypatch)
    record, _ = read_in_time(path)
    assert any("fails its checksum" in loss for loss in record.losses)
    assert len(unpacked) == 1  # the header


def test_blocks_of_empty_records_without_end_are_left_out_in_time(foreign: Any) -> None:
    path = foreign()
    whole, zeros = path.read_bytes(), zstandard.compress(bytes(60 * 2**20))
    content = (0).to_bytes(16, "little") + (60 * 2**20).to_bytes(8, "little") + bytes(4) + b"\x04\x00\x00\x00zstd"
    content += len(zeros).to_bytes(8, "little") + zeros
    block = b"\x06" + len(content).to_bytes(8, "little") + content
    at = whole.index(b"\x04\x00\x00\x00zstd") - 28
    behind_header = at + int.from_bytes(whole[at - 8 : at], "little")
    path.write_bytes(whole[:behind_header] + block * 50 + whole[behind_header:])
    assert path.stat().st_size < 200_000
    record, _ = read_in_time(path)
    assert any("too large to be one" in loss for loss in record.losses)


def test_marks_of_blocks_without_end_are_searched_in_time(foreign: Any) -> None:
    path = foreign()
    head = bytes(20) + b"\xff\xff\xff\x7f" + bytes(4) + b"\x04\x00\x00\x00zstd"
    path.write_bytes(path.read_bytes()[:-20] + 200_000 * (head + (4_000_000).to_bytes(8, "little")))
    read_in_time(path)


@pytest.mark.parametrize(
    ("topic", "record"),
    [
        ("/intent", {"trial": 10**15, "isi_ms": 5.0}),
        ("/intent", {"trial": -1, "isi_ms": 5.0}),
        ("/trial", {"index": 10**15, "status": "accepted", "commanded_isi_ms": 5.0, "isi_ms": 5.0, "mep_mv": 0.1}),
        ("/trial", {"index": 0, "status": "accepted", "commanded_isi_ms": 5.0, "isi_ms": 5.0, "mep_mv": 1e300}),
        ("/trial", {"index": 0, "status": "accepted", "commanded_isi_ms": 10**4000, "mep_mv": 0.1}),
        ("/emg", {"trial": 10**15, "t0_ms": 0.0, "rate_hz": 1.0, "unit": "mV", "values": [0.0]}),
        ("/emg", {"trial": 0, "t0_ms": 0.0, "rate_hz": -1.0, "unit": "mV", "values": [0.0]}),
        ("/event", {"kind": "exclusion", "trial": 10**15}),
        ("/event", {"kind": "a kind of its own"}),
    ],
)
def test_numbers_that_no_session_has_are_left_out_and_said(foreign: Any, topic: str, record: dict[str, Any]) -> None:
    found, _ = read_in_time(foreign((topic, json.dumps(record).encode())))
    assert len(found.losses) == 1
    number = record.get("trial", record.get("index", 0))
    said = "Only trials up to 99999 are read" if number > MOST_TRIALS else "makes no sense"
    assert said in found.losses[0]
    assert (found.history, dict(found.waveforms)) == ((), {})
    assert len(found.unknown) <= 1  # where the index counts a stimulus that no record tells of


@pytest.mark.slow
def test_as_many_gaps_as_a_log_may_have_are_counted_in_time(foreign: Any) -> None:
    record, _ = read_in_time(foreign(("/intent", json.dumps({"trial": MOST_TRIALS - 1, "isi_ms": 5.0}).encode())))
    assert len(record.unknown) == MOST_TRIALS


def test_nesting_without_end_is_a_record_that_makes_no_sense(foreign: Any, header: Any) -> None:
    deep = json.loads(encode("/header", header)) | {"config": {"a": 1}}
    data = json.dumps(deep).replace('{"a": 1}', '{"a":' * 50_000 + "1" + "}" * 50_000).encode()
    record, _ = read_in_time(foreign(("/header", data)))
    assert "makes no sense" in record.losses[0]
    assert record.header == header


@pytest.mark.parametrize("configuration", [b"a = " + b"[" * 100_000, b"a." * 100_000 + b"a = 1", b"\xff" * 100])
def test_a_configuration_nested_without_end_is_no_header(foreign: Any, configuration: Any) -> None:
    with pytest.raises(LogError, match="header is lost"):
        read_in_time(foreign(("/event", b'{"kind": "fit"}'), configuration=configuration, with_header=False))


@pytest.mark.parametrize(
    "space",
    [
        {"low_ms": 0, "high_ms": 1e15, "step_ms": 1e-3},
        {"low_ms": -1.7e308, "high_ms": 1.7e308},
        {"low_ms": 0, "high_ms": 1e6},
    ],
)
def test_a_grid_without_end_is_no_header(foreign: Any, header: Any, space: DesignSpace) -> None:
    hostile = json.loads(encode("/header", header))
    hostile["space"] |= space
    with pytest.raises(LogError, match="header is lost"):
        read_in_time(foreign(("/header", json.dumps(hostile).encode()), with_header=False))


def test_more_losses_than_anybody_reads_are_counted(foreign: Any) -> None:
    record, _ = read_in_time(foreign(*[("/event", b"{}")] * 300))
    assert len(record.losses) == MOST_LOSSES + 1
    assert record.losses[-1] == "250 more losses are not listed."
