from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.devices.robot.mechanism import Faults
from isiw.errors import InvalidValueError
from isiw.signals import detect_events, load_cell_times, sweep_events
from isiw.signals.events import TapEvents
from isiw.sweeps import Channel, Sweep
from signals.made import Rendered, render, sweep_of


def found(tapped: Rendered, **options: Any) -> TapEvents:
    waves = tapped.waves
    return detect_events(waves["acceleration"], 5000.0, pressure=waves["pressure"], emg=waves["emg"], **options)


def test_events_come_in_order_of_occurrence() -> None:
    events = found(render("subject2", n=200))
    assert (np.diff(np.array(list(events.columns().values())), axis=0) > 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["subject1", "subject4"])
def test_events_are_found_where_the_plant_put_them(name: str) -> None:
    tapped = render(name, n=200, seed=3)
    events = found(tapped)
    np.testing.assert_allclose(events.fill_ms, 523.0, atol=1.0)
    # A descent that begins with hardly any pressure behind it takes a little longer to show.
    assert np.mean(np.abs(events.descent_ms - tapped.taps.descent_ms - 500) <= 0.3) >= 0.97
    np.testing.assert_allclose(events.memg_ms, tapped.taps.memg_ms + 500, atol=0.5)


def test_a_sweep_without_impact_has_no_event_of_the_impact() -> None:
    events = found(render("subject1", n=20, faults=Faults(stuck_probability=1.0)))
    for name in ("descent", "hit", "away", "memg"):
        assert np.isnan(events.columns()[name]).all(), name


def test_the_artefact_of_the_pulse_is_not_taken_for_that_of_the_tap() -> None:
    tapped = render("subject1", n=50, seed=4)
    pulse = np.round(tapped.true_hit_ms + 13.0)
    for row, at in zip(tapped.waves["emg"], pulse, strict=True):
        row[round(at * 5) : round(at * 5) + 4] += 0.3
    blind, told = found(tapped), found(tapped, t_tms_ms=pulse)
    assert np.abs(blind.memg_ms - tapped.taps.memg_ms - 500).min() > 1.0
    np.testing.assert_allclose(told.memg_ms, tapped.taps.memg_ms + 500, atol=0.5)


def test_the_load_cell_shows_the_hit_where_the_accelerometer_does() -> None:
    tapped = render("bench", n=50, seed=5)
    pressed_ms = load_cell_times(tapped.waves["force"], 5000.0)
    np.testing.assert_allclose(pressed_ms, tapped.true_hit_ms, atol=0.3)
    np.testing.assert_allclose(pressed_ms, found(tapped).hit_ms, atol=0.5)


def test_a_load_cell_that_nothing_hits_shows_no_hit() -> None:
    waves = render("bench", n=5, faults=Faults(stuck_probability=1.0)).waves
    assert np.isnan(load_cell_times(waves["force"], 5000.0)).all()


def test_channels_of_different_shapes_are_an_error() -> None:
    waves = render("subject1", n=5).waves
    with pytest.raises(InvalidValueError, match="one shape"):
        detect_events(waves["acceleration"], 5000.0, pressure=waves["pressure"][:, :-1])


def test_events_of_a_sweep_are_on_its_own_clock() -> None:
    sweep = sweep_of()
    shifted = {
        name: Channel(channel.values, channel.rate_hz, channel.unit, t0_ms=-780.0)
        for name, channel in sweep.channels.items()
    }
    moved = Sweep(shifted, t_valve_ms=-280.0, t_tms_ms=0.0)
    np.testing.assert_allclose(sweep_events(moved).hit_ms, sweep_events(sweep).hit_ms - 780.0)


def test_a_sweep_without_acceleration_has_no_events_but_an_error() -> None:
    sweep = sweep_of()
    with pytest.raises(InvalidValueError, match="acceleration"):
        sweep_events(Sweep({"emg": sweep.channels["emg"]}, t_valve_ms=500.0))
