"""Taps rendered with every disturbance at once, and sweeps to judge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from isiw.devices.robot.mechanism import Geometry, SensorNoise, Taps, draw_taps
from isiw.devices.robot.tapper import preset
from isiw.devices.robot.waveforms import record_emg, record_robot, sample_times_ms
from isiw.sweeps import Channel, Sweep
from isiw.types import FloatArray

RATE_HZ = 5000.0


@dataclass(frozen=True)
class Rendered:
    taps: Taps
    waves: dict[str, FloatArray]

    @property
    def true_hit_ms(self) -> FloatArray:
        return self.taps.hit_ms + 500.0


def disturbed(waves: FloatArray, noise_sd: float, rng: np.random.Generator) -> FloatArray:
    """50 Hz hum of three noise SDs, and a baseline that drifts by ten noise SDs, on top of the waves."""
    n, w = waves.shape
    time_s = np.arange(w) / RATE_HZ
    hum = 3 * noise_sd * np.sin(2 * np.pi * (50 * time_s + rng.uniform(size=(n, 1))))
    drift = 10 * noise_sd * rng.choice((-1.0, 1.0), size=(n, 1)) * time_s
    return waves + hum + drift


def render(name: str, n: int = 100, seed: int = 0, *, harsh: bool = False, **changes: Any) -> Rendered:
    geometry: Geometry = replace(preset(name), **changes)
    rng = np.random.default_rng(seed)
    if harsh:
        noise = SensorNoise(**{name: 2.0 * value for name, value in vars(geometry.noise).items()})
        geometry = replace(geometry, noise=noise)
    taps = draw_taps(geometry, n, rng)
    taps = replace(taps, speed_m_s=0.9 * taps.speed_m_s) if harsh else taps
    times = sample_times_ms(RATE_HZ, 1000.0, valve_ms=500.0)
    waves = record_robot(times, taps, rng)
    nothing = np.full(n, np.nan)
    waves["emg"] = record_emg(times, RATE_HZ, taps, rng, pulse_ms=nothing, evoked_mv=np.zeros(n))
    if harsh:
        sd = preset(name).noise.acceleration_m_s2
        waves["acceleration"] = disturbed(waves["acceleration"], sd, rng)
    return Rendered(taps, waves)


def sweep_of(**changes: Any) -> Sweep:
    """A clean sweep of 1 s with an impact at 680 ms, a pulse 100 ms later, and an MEP of 0.1 mV."""
    rng = np.random.default_rng(1)
    time_ms = np.arange(5000) / 5
    emg = 0.002 * rng.standard_normal(5000)
    emg += 0.05 * np.sin(2 * np.pi * (time_ms - 800) / 10) * ((time_ms >= 800) & (time_ms <= 810))
    acceleration = 0.3 * rng.standard_normal(5000)
    acceleration[(time_ms >= 630) & (time_ms < 680)] += 15.0
    acceleration[(time_ms >= 680) & (time_ms < 695)] -= 50.0
    channels = {"emg": Channel(emg, RATE_HZ, "mV"), "acceleration": Channel(acceleration, RATE_HZ, "m/s^2")}
    return replace(Sweep(channels, t_valve_ms=500.0, t_tms_ms=780.0), **changes)
