"""Nothing is lost over the Lab Streaming Layer, in a run of a few seconds."""

from __future__ import annotations

import numpy as np
import pytest

import lsl_network

throughput = pytest.importorskip("benchmarks.lsl_throughput", reason="the extra lsl is not installed")
assert lsl_network


@pytest.mark.slow
def test_every_sample_of_eight_channels_arrives_once_and_in_its_place() -> None:
    with throughput.staged(5000.0, sweep_s=1.0) as device:
        numbers, took_s, mixed = throughput.measure(device, 2.0)
    assert (np.diff(numbers) == 1).all()
    assert numbers.size > 5000
    assert mixed == 0
    assert took_s.size >= 2
