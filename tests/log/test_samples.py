"""A log of which the samples of some channels alone are read says the same of all else, in less memory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isiw
from isiw.log.record import read_session
from isiw.log.schema import Waveform, without_samples
from isiw.log.writer import LogWriter, encode
from isiw.sweeps import Channel
from log.written import make_header, write_trials

PEAK = """
import sys, resource
import isiw
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
isiw.read_session(sys.argv[1], channels=())
before = peak()
record = isiw.read_session(sys.argv[2], channels=())
assert len(record.waveforms) == 600, len(record.waveforms)
print(peak() - before)
"""


def written(path: Path, trials: int, samples: int = 50) -> Path:
    rng = np.random.default_rng(1)
    with LogWriter.create(path, make_header()) as log:
        for trial in range(trials):
            write_trials(log, [trial])
            log.append(Waveform.of(trial, Channel(rng.standard_normal(samples), 5000.0, "m/s²", -20.0)), "acceleration")
    return path


@pytest.mark.parametrize("wanted", [["emg"], "emg"])
def test_samples_of_other_channels_are_not_read_and_all_else_is(tmp_path: Path, wanted: Any) -> None:
    log = written(tmp_path / "one.mcap", 5)
    whole, some, none = read_session(log), read_session(log, channels=wanted), read_session(log, channels=())
    for record, kept in ((some, {"emg"}), (none, set[str]())):
        assert (record.history, record.losses, record.onsets) == (whole.history, whole.losses, whole.onsets)
        assert list(record.waveforms) == list(whole.waveforms)
        for (trial, name), channel in record.waveforms.items():
            full = whole.waveforms[trial, name]
            assert (channel.rate_hz, channel.unit, channel.t0_ms) == (full.rate_hz, full.unit, full.t0_ms)
            np.testing.assert_array_equal(channel.values, full.values if name in kept else [])
    assert some.trials.equals(whole.trials)


@pytest.mark.parametrize(
    ("data", "has_samples"),
    [
        (b'{"trial":1,"t0_ms":0.0,"rate_hz":5000.0,"unit":"mV","values":[0.1,-2e-05]}', True),
        (b'{"trial":1,"t0_ms":0.0,"rate_hz":5000.0,"unit":"mV","values":["NaN"]}', False),
        (b'{"trial":1,"t0_ms":0.0,"rate_hz":5000.0,"unit":"mV","values":[1],"values":[2]}', False),
        (b'{"trial":1,"t0_ms":0.0,"rate_hz":5000.0,"unit":"m\\"V","values":[1]}', False),
        (b'{"trial":1,"values":[1],"t0_ms":0.0,"rate_hz":5000.0,"unit":"mV"}', False),
        (b'{"trial":1,"isi_ms":3.0}', False),
    ],
)
def test_a_waveform_that_is_not_as_isiw_writes_it_is_kept_whole(data: bytes, *, has_samples: bool) -> None:
    assert without_samples(data) == (data[: data.index(b"[") + 1] + b"]}" if has_samples else None)


def test_what_isiw_writes_is_known_by_its_beginning() -> None:
    channel = Channel(np.random.default_rng(0).standard_normal(50) * 1e-7, 5000.0, "µV", -1.5)
    assert without_samples(encode("/emg", Waveform.of(3, channel))) is not None


def test_a_damaged_log_is_damaged_without_samples_too(tmp_path: Path) -> None:
    log = written(tmp_path / "one.mcap", 5)
    content = bytearray(log.read_bytes())
    content[len(content) // 2] ^= 1
    log.write_bytes(content)
    assert isiw.read_session(log).losses
    assert isiw.read_session(log, channels=()).losses == isiw.read_session(log).losses


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no resource module")
def test_a_log_without_its_samples_takes_little_memory(tmp_path: Path) -> None:
    small, large = written(tmp_path / "small.mcap", 2), written(tmp_path / "large.mcap", 300, 10_000)
    said = subprocess.run(  # noqa: S603 - this Python
        [sys.executable, "-c", PEAK, str(small), str(large)],
        check=True, capture_output=True, text=True, env=os.environ,
    )  # fmt: skip
    assert int(said.stdout) < 40 * 2**20  # 150 MB of text and numbers with them
