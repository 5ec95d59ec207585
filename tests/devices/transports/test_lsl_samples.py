"""What is kept of a stream of samples, and what is told of its timing; without a network."""

from __future__ import annotations

import numpy as np
import pytest

from isiw.devices.transports.lsl_samples import SampleStream, check_timing
from isiw.errors import DeviceError, NotDelivered
from isiw.types import FloatArray

RATE_HZ = 1000.0
CORRECTION_S = 250.0


class LostError(Exception):
    """As liblsl raises it."""


class FakeInlet:
    """Gives a sample a millisecond, of which each has its number, on a clock that is 250 s behind the local one."""

    def __init__(self, *chunks: FloatArray) -> None:
        self.chunks, self.correction_s, self.lost = list(chunks), CORRECTION_S, False

    def pull_chunk(self, timeout: float, max_samples: int, *, as_numpy: bool) -> tuple[FloatArray, FloatArray]:
        assert (timeout, as_numpy) == (0.0, True)
        if self.lost:
            raise LostError("the stream has been lost.")
        stamps_s = self.chunks.pop(0)[:max_samples] if self.chunks else np.empty(0)
        return np.round(RATE_HZ * stamps_s)[:, None], stamps_s

    def time_correction(self, timeout: float) -> float:
        assert timeout > 0
        return self.correction_s


def stamps(first: int, last: int) -> FloatArray:
    return np.arange(first, last) / RATE_HZ


def stream(inlet: FakeInlet, kept_s: float = 10.0) -> SampleStream:
    return SampleStream(inlet, "emg", RATE_HZ, 1.0, kept_s, (LostError,))


def test_a_cut_is_made_on_the_local_clock() -> None:
    begin_s, values = stream(FakeInlet(stamps(0, 400), stamps(400, 900))).cut(250.1995, 250.6995, np.inf)
    assert begin_s == pytest.approx(250.2, abs=1e-9)
    assert values[:, 0].tolist() == list(range(200, 700))


def test_the_correction_of_the_clock_is_that_of_the_moment() -> None:
    inlet = FakeInlet(stamps(0, 900))
    made = stream(inlet)
    made.require_live(lambda: CORRECTION_S + 0.9, 0.5)
    inlet.correction_s, inlet.chunks = CORRECTION_S + 0.1, [stamps(900, 1000)]
    assert made.cut(250.2995, 251.05, np.inf)[1][0, 0] == 200.0


def test_jitter_of_chunks_averages_out() -> None:
    jitter_s = np.repeat([0.0, 0.0005, -0.0004, 0.0003, 0.0, 0.0, 0.0], 100)
    begin_s, _ = stream(FakeInlet(stamps(0, 700) + jitter_s)).cut(250.1, 250.6, np.inf)
    assert begin_s == pytest.approx(250.1, abs=2e-4)


def test_only_the_newest_samples_are_kept() -> None:
    made = stream(FakeInlet(stamps(0, 4096), stamps(4096, 6000)), kept_s=1.0)
    with pytest.raises(DeviceError, match=r"got '4.75 s later'"):
        made.cut(250.25, 250.5, np.inf)


@pytest.mark.parametrize(
    ("chunk", "words"),
    [
        (np.delete(stamps(0, 700), slice(300, 310)), "were dropped; got '10 ms after 200 ms of the sweep'"),
        (np.concatenate([stamps(0, 300), stamps(280, 700)]), "jumped back; got '20 ms after"),
        (stamps(0, 700) * 1.02, "do not come at their rate; got '980.392 Hz in the sweep'; expected 1000 Hz"),
    ],
)
def test_what_is_wrong_with_the_timing_of_samples_is_told(chunk: FloatArray, words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        stream(FakeInlet(chunk)).cut(250.1, 250.6, np.inf)


@pytest.mark.parametrize("edge", [100, 600])
def test_a_gap_at_the_edge_of_a_sweep_is_seen(edge: int) -> None:
    chunk = np.delete(stamps(0, 700), slice(edge - 5, edge + 5))
    with pytest.raises(DeviceError, match="were dropped; got '10 ms"):
        stream(FakeInlet(chunk)).cut(250.1, 250.6, np.inf)


def test_a_gap_shorter_than_the_jitter_is_not_seen() -> None:
    check_timing("emg", np.delete(stamps(0, 700), 300), RATE_HZ, max_jitter_ms=1.1)
    with pytest.raises(DeviceError, match="were dropped"):
        check_timing("emg", np.delete(stamps(0, 700), 300), RATE_HZ, max_jitter_ms=0.9)


def test_a_sweep_without_samples_is_told() -> None:
    with pytest.raises(DeviceError, match="no samples in the sweep"):
        check_timing("emg", stamps(0, 1), RATE_HZ, 1.0)


@pytest.mark.parametrize(("now_s", "words"), [(255.0, "are late; got '4.1 s'"), (247.0, "are ahead of time")])
def test_nothing_is_delivered_while_samples_are_late_or_ahead(now_s: float, words: str) -> None:
    with pytest.raises(NotDelivered, match=words):
        stream(FakeInlet(stamps(0, 900))).require_live(lambda: now_s, 0.5)


def test_nothing_is_delivered_while_a_stream_is_lost_or_silent() -> None:
    inlet = FakeInlet()
    with pytest.raises(NotDelivered, match=r"emg has fallen silent.* not delivered"):
        stream(inlet).require_live(lambda: 0.0, 0.5)
    inlet.lost = True
    with pytest.raises(NotDelivered, match=r"emg is lost.* not delivered"):
        stream(inlet).require_live(lambda: 0.0, 0.5)
