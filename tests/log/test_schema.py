from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from isiw.decision import StopDecision
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.findings import Kind
from isiw.log.headers import Header, Production
from isiw.log.salvage import salvage
from isiw.log.schema import (
    CHANNEL_IDS,
    Correction,
    EstimateRecord,
    Event,
    Intent,
    PulseOutcome,
    Record,
    ThresholdEstimateRecord,
    Waveform,
    decode,
)
from isiw.log.writer import LogWriter, encode, json_schema, log_time_ns, topic_of
from isiw.session.examination import recorded
from isiw.strategy.threshold import ThresholdEstimate
from isiw.summary import summary
from isiw.sweeps import Channel
from isiw.trials import Status, Trial
from isiw.window import Window
from known import instance
from log.written import make_header


@pytest.mark.parametrize(
    "record",
    [
        Intent(trial=3, isi_ms=0.1 + 0.2, t_s=1.5),
        Intent(trial=3, isi_ms=None),
        Trial(0, Status.ACCEPTED, 12.0, isi_ms=12.345678901234567, mep_mv=1e-17, background_rms_uv=3.0),
        Trial(1, Status.MISTRIAL, None, Kind.OUTCOME_UNKNOWN),
        EstimateRecord(trial=1, probability=None, start_ms=-math.inf, end_ms=math.inf, stop=True, reason="µ"),
        Event(kind="fault", text="line one\nline two"),
        Event(kind="correction", trial=3, text="the amplifier's gain", corrected=Correction(mep_mv=0.2)),
        Trial(2, Status.ACCEPTED, 12.0, isi_ms=12.0, mep_mv=0.3, mep_sd_mv=0.02),
        Trial(3, Status.ACCEPTED, 12.0, isi_ms=12.0, mep_interval_mv=(0.5, math.inf)),
        Trial(4, Status.ACCEPTED, None, isi_ms=60.0, mep_mv=0.1, tap_alone=True),
        Intent(trial=3, isi_ms=None, intensity_pct_mso=62.0),
        PulseOutcome(trial=3, intensity_pct_mso=62.0, mep_mv=0.08),
        PulseOutcome(trial=3, intensity_pct_mso=62.0, reason="lost"),
        ThresholdEstimateRecord(
            trial=3,
            estimate=ThresholdEstimate(None, 50.0, 60.0, 3.0, "why"),
            decision=StopDecision(stop=True, reason="r"),
        ),
    ],
)
def test_a_record_survives_being_written_and_read(record: Record) -> None:
    topic = topic_of(record)
    assert decode(topic, encode(topic, record)) == record


def test_a_waveform_survives_with_what_is_not_finite() -> None:
    channel = Channel(np.array([0.1, math.nan, math.inf, -math.inf, -0.0]), 3000.0, "mV", t0_ms=-50.0)
    record = Waveform.of(7, channel)
    again = instance(Waveform, decode("/emg", encode("/emg", record))).channel()
    np.testing.assert_array_equal(again.values, channel.values)
    assert (again.rate_hz, again.unit, again.t0_ms) == (3000.0, "mV", -50.0)


def test_a_header_in_which_a_version_is_a_number_can_be_read(header: Header) -> None:
    written = json.loads(encode("/header", header))
    written["device"]["version"] = 2.1
    assert instance(Header, decode("/header", json.dumps(written).encode())).device.version == "2.1"


def test_a_header_from_before_the_times_allowed_were_logged_can_be_read(header: Header) -> None:
    written = json.loads(encode("/header", header))
    assert written.pop("timeout_s") == 30.0
    assert written.pop("ask_deadline_s") is None
    assert decode("/header", json.dumps(written).encode()) == header


def test_what_is_not_finite_is_written_as_a_string() -> None:
    written = json.loads(encode("/estimate", EstimateRecord(trial=0, probability=0.9, end_ms=math.inf)))
    assert written["end_ms"] == "Infinity"


@pytest.mark.parametrize("topic", CHANNEL_IDS)
def test_every_schema_is_an_object_without_references_to_elsewhere(topic: str) -> None:
    _, schema = json_schema(topic)
    root = json.loads(schema)
    assert root["type"] == "object"
    assert all(f'"$ref": "{outside}' not in schema.decode() for outside in ("http", "file"))


def test_the_channel_numbers_are_frozen() -> None:
    topics = ("header", "intent", "trial", "estimate", "event", "emg", "acceleration", "pressure", "force", "valve")
    assert dict(CHANNEL_IDS) == {f"/{topic}": number for number, topic in enumerate(topics, start=1)}


@pytest.mark.parametrize(
    ("record", "topic"),
    [
        (PulseOutcome(trial=0, intensity_pct_mso=50.0, mep_mv=0.1), "/threshold/pulse"),
        (Production(trial=0, block=0, produced_ms=300.0, score_pct=100.0), "/production"),
    ],
)
def test_a_topic_without_a_frozen_number_is_announced_and_survives_being_written_and_read(
    tmp_path: Path, header: Header, record: Record, topic: str
) -> None:
    with LogWriter.create(tmp_path / "a.mcap", header) as log:
        log.append(record)
    assert b"channel 11" in (tmp_path / "a.mcap").read_bytes()
    assert topic not in CHANNEL_IDS
    assert decode(topic, salvage(tmp_path / "a.mcap").messages[-1].data) == record


@pytest.mark.parametrize("name", ["trial", "header", "", None])
def test_a_channel_cannot_take_the_name_of_another_topic(name: str) -> None:
    waveform = Waveform.of(0, Channel(np.zeros(3), 1000.0, "mV"))
    with pytest.raises(InvalidValueError, match="channel cannot have this name"):
        topic_of(waveform, name)


def test_an_estimate_keeps_window_intervals_and_profile() -> None:
    grid = np.arange(0.0, 50.0)
    estimate = WindowEstimate(
        probability=0.8,
        window=Window(10, 40, ((10, 20), (30, 40))),
        start_ms=10.5,
        end_ms=math.inf,
        grid_ms=grid,
        edge_samples_ms=np.array([[9.0, 38.0], [10.0, math.inf], [11.0, math.inf]]),
        profile_quantiles_mv=np.stack([grid, grid + 1, grid + 2]),
        split_probability=0.25,
    )
    written = encode("/estimate", recorded(estimate, 4, StopDecision(stop=False, reason="r"), 7.0))
    record = instance(EstimateRecord, decode("/estimate", written))
    assert record.window == estimate.window
    assert (record.start_low_ms, record.start_high_ms, record.end_low_ms, record.end_high_ms) == (9, 11, 38, math.inf)
    assert (record.start_beyond, record.split) == (0.0, 0.25)
    assert record.end_beyond == pytest.approx(2 / 3)
    assert record.band_high_mv == tuple(grid + 2)
    assert record.decision == StopDecision(stop=False, reason="r")
    assert record.next_isi_ms == 7.0


def test_an_estimate_keeps_the_isis_that_depress_the_mep() -> None:
    estimate = WindowEstimate(0.9, Window(50, 80), depressed=Window(10, 35), depressed_probability=0.7)
    written = encode("/estimate", recorded(estimate, 4, StopDecision(stop=False, reason="r"), 7.0))
    record = instance(EstimateRecord, decode("/estimate", written))
    assert (record.depressed, record.depressed_probability) == (Window(10, 35), 0.7)
    assert summary(record) == str(estimate)
    assert "Depressed: 10–35 ms (probability of it: 0.70)" in summary(record)


def test_an_estimate_of_a_strategy_that_looks_for_enhancement_alone_says_nothing_of_depression() -> None:
    record = recorded(WindowEstimate(0.9, Window(50, 80)), 4, StopDecision(stop=False, reason="r"), 7.0)
    assert (record.depressed, record.depressed_probability) == (None, None)
    assert "epressed" not in summary(record)


def test_an_estimate_of_a_method_without_posterior_has_gaps() -> None:
    record = recorded(WindowEstimate(None, Window(1, 2)), 0, StopDecision(stop=True, reason=""), None)
    assert record.window == Window(1, 2)
    assert record.start_low_ms is None
    assert record.grid_ms == ()


def test_a_record_from_a_later_version_with_more_keys_is_read() -> None:
    assert decode("/intent", b'{"trial": 1, "isi_ms": 2.0, "mood": "good"}') == Intent(trial=1, isi_ms=2.0)


@pytest.mark.parametrize("data", [b"", b"{}", b'{"trial": "x", "isi_ms": 1}', b"\xff\xfe"])
def test_what_is_not_a_record_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="validation error"):
        decode("/intent", data)


def test_a_logged_space_without_a_reference_counts_from_the_impact() -> None:
    logged = json.loads(make_header().model_dump_json())
    del logged["space"]["reference"]
    assert Header.model_validate_json(json.dumps(logged)).space.reference == "impact"


@pytest.mark.parametrize(("now_ns", "held_ns"), [(0, 0), (2**64 - 1, 2**64 - 1), (2**64, 0), (-1, 0)])
def test_every_time_is_held_that_fits_into_a_record(now_ns: int, held_ns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.log.writer.time.time_ns", lambda: now_ns)
    assert log_time_ns() == held_ns
