"""Waveforms of taps and MEPs: what the sensors of the tapping robot would record, n sweeps at once.

Every function takes times as shape (n, w) or (w,) and gives samples of shape (n, w).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from isiw.devices.robot.mechanism import SEPARATION_RAD, Taps, drive, pressure_kpa, rebound, restitution
from isiw.lazy import scipy
from isiw.signals.spans import MEP_WINDOW_MS
from isiw.types import ArrayLike, FloatArray

UNITS: Mapping[str, str] = MappingProxyType(
    {"valve": "V", "pressure": "kPa", "acceleration": "m/s^2", "force": "N", "emg": "mV"}
)
"""The unit of each channel; `force` is recorded on the load cell only."""

VALVE_V = 10.0
ACCELEROMETER_M_S2 = 100.0  # full scale of the axes of Fig. 3.6 and 3.7
REST_FORCE_N = 10.68  # 2.401 lbf (Fig. 3.6)
MOVING_KG = 0.06  # gives an impact of some 20 lbf at the bench's speed and stiffness
SETTLING_MS = 10.0
CONTACTS = 3  # what is left after these is below the sensors' noise

EMG_BAND_HZ = (10.0, 1000.0)
TAP_ARTEFACT_HZ, TAP_ARTEFACT_DECAY_MS = 250.0, 1.6
PULSE_ARTEFACT_MS = 0.2
PULSE_ARTEFACT_MV = (0.1, 0.5)
LATENCY_SD_MS, STRETCH_SD = 0.7, 0.05  # of the MEP from sweep to sweep

MEP_TURNS = ((-0.60, 21.3, 1.5), (-0.16, 25.3, 1.2), (0.33, 29.9, 1.7), (0.10, 36.5, 5.5))
"""Amplitude, centre [ms after the pulse] and SD [ms] of the turns of a forearm MEP (trough 21.3, peak 29.9 ms)."""


def sample_times_ms(rate_hz: float, duration_ms: float, valve_ms: float) -> FloatArray:
    """Times of a sweep's samples after its valve command [ms], shape (w,)."""
    return np.arange(round(duration_ms * rate_hz / 1000), dtype=np.float64) * (1000 / rate_hz) - valve_ms


def record_robot(since_valve_ms: FloatArray, taps: Taps, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Sensor signals of n taps, by channel in the units of `UNITS`, each of shape (n, w)."""
    noise, shape = taps.geometry.noise, (len(taps.hit_ms), len(since_valve_ms))
    times = np.broadcast_to(since_valve_ms, shape)
    moved = acceleration_m_s2(times, taps) + noise.acceleration_m_s2 * rng.standard_normal(shape)
    channels = {
        "valve": np.where(times >= taps.late_ms[:, None], VALVE_V, 0.0) + noise.valve_v * rng.standard_normal(shape),
        "pressure": pressure_kpa(times - taps.late_ms[:, None]) + noise.pressure_kpa * rng.standard_normal(shape),
        "acceleration": np.clip(moved, -ACCELEROMETER_M_S2, ACCELEROMETER_M_S2),
    }
    if taps.geometry.load_cell:
        channels["force"] = force_n(times, taps) + noise.force_n * rng.standard_normal(shape)
    return channels


def record_emg(
    since_valve_ms: FloatArray,
    rate_hz: float,
    taps: Taps,
    rng: np.random.Generator,
    *,
    pulse_ms: FloatArray,
    evoked_mv: FloatArray,
) -> FloatArray:
    """The EMG of n taps and pulses: noise, both artefacts, and the MEP [mV], shape (n, w)."""
    n = len(taps.hit_ms)
    resting = emg_noise_uv(n, len(since_valve_ms), rate_hz, taps.geometry.noise.emg_uv, rng) / 1000
    artefacts = tap_artefact_mv(since_valve_ms - taps.memg_ms[:, None], taps.geometry.artefact_mv)
    since_pulse = since_valve_ms - pulse_ms[:, None]
    sign, size = rng.choice((-1.0, 1.0), n), rng.uniform(*PULSE_ARTEFACT_MV, n)
    artefacts = artefacts + tms_artefact_mv(since_pulse, sign * size)
    shift, stretch = LATENCY_SD_MS * rng.standard_normal(n), 1 + STRETCH_SD * rng.standard_normal(n)
    first_turn = MEP_TURNS[0][1]
    since_turn = since_pulse - first_turn - shift[:, None]
    meps = np.nan_to_num(mep_shape(first_turn + since_turn / stretch[:, None]))
    in_window = (since_pulse >= MEP_WINDOW_MS[0]) & (since_pulse <= MEP_WINDOW_MS[1])
    for sweep in np.flatnonzero(in_window.any(axis=-1)):
        inside = in_window[sweep]
        meps[sweep] *= scale_of_mep(resting[sweep, inside], meps[sweep, inside], float(evoked_mv[sweep]))
    return resting + artefacts + meps


def scale_of_mep(resting_mv: FloatArray, mep_mv: FloatArray, amplitude_mv: float) -> float:
    """The factor on an MEP with which its sum with EMG at rest has an amplitude; 0 if the EMG at rest alone has it."""

    def missing_mv(scale: float) -> float:
        return amplitude_mv - float(np.ptp(resting_mv + scale * mep_mv))

    if missing_mv(0.0) <= 0:
        return 0.0
    # The sum's amplitude is at least scale * ptp(mep) - ptp(rest), so this scale is enough.
    return float(scipy.optimize.brentq(missing_mv, 0.0, (amplitude_mv + np.ptp(resting_mv)) / np.ptp(mep_mv)))


def acceleration_m_s2(since_valve_ms: FloatArray, taps: Taps) -> FloatArray:
    """Acceleration of the hammer, positive towards the tendon, before its sensor's limits [m/s²]."""
    late, kinetic = taps.late_ms[:, None], taps.geometry.kinetic_share
    moving = (since_valve_ms >= taps.descent_ms[:, None]) & ~(since_valve_ms >= _rest_ms(taps)[:, None])
    driven = np.where(moving, drive(since_valve_ms - late, kinetic), 0.0)
    return driven + _by_the_tendon(since_valve_ms, taps)


def force_n(since_valve_ms: FloatArray, taps: Taps) -> FloatArray:
    """Force on the load cell under the hammer [N]."""
    settled = np.maximum(since_valve_ms - _rest_ms(taps)[:, None], 0.0)
    resting = -REST_FORCE_N * np.expm1(-settled / SETTLING_MS)
    return np.where(np.isnan(resting), 0.0, resting) - MOVING_KG * _by_the_tendon(since_valve_ms, taps)


def _contacts(taps: Taps) -> list[tuple[FloatArray, FloatArray]]:
    """Start [ms after the valve command] and speed [m/s] of each contact, then of the rest, shape (n,) each."""
    start, speed = taps.hit_ms, taps.speed_m_s
    contacts = [(start, speed)]
    for _ in range(CONTACTS):
        leaving = start + SEPARATION_RAD / taps.rad_ms
        pull = drive(leaving - taps.late_ms, taps.geometry.kinetic_share)
        speed = restitution() * speed
        start = leaving + 2000 * speed / pull
        contacts.append((start, speed))
    return contacts


def _rest_ms(taps: Taps) -> FloatArray:
    return _contacts(taps)[-1][0]


def _by_the_tendon(since_valve_ms: FloatArray, taps: Taps) -> FloatArray:
    total = np.zeros(np.broadcast_shapes(since_valve_ms.shape, (len(taps.hit_ms), 1)))
    for start, speed in _contacts(taps)[:-1]:
        phase = taps.rad_ms[:, None] * (since_valve_ms - start[:, None])
        touching = (phase >= 0) & (phase <= SEPARATION_RAD)
        peak = np.broadcast_to((1000 * speed * taps.rad_ms)[:, None], total.shape)
        total[touching] = peak[touching] * rebound(phase[touching])
    return total


def emg_noise_uv(n: int, samples: int, rate_hz: float, rms_uv: float, rng: np.random.Generator) -> FloatArray:
    """EMG at rest: Gaussian noise in the amplifier's band [µV], shape (n, w)."""
    settle = round(rate_hz / 10)  # the filter starts from zero
    high_hz = min(EMG_BAND_HZ[1], 0.45 * rate_hz)
    band = scipy.signal.butter(2, (EMG_BAND_HZ[0], high_hz), btype="bandpass", fs=rate_hz, output="sos")
    impulse = np.zeros(4 * settle)
    impulse[0] = 1.0
    passed_sd = math.sqrt(float(np.sum(scipy.signal.sosfilt(band, impulse) ** 2)))
    noise: FloatArray = scipy.signal.sosfilt(band, rng.standard_normal((n, settle + samples)), axis=-1)[:, settle:]
    return rms_uv / passed_sd * noise


def tap_artefact_mv(since_memg_ms: FloatArray, amplitude_mv: float) -> FloatArray:
    """The tap in the EMG: a burst that begins at once and has died away after some 8 ms [mV]."""
    since = np.maximum(since_memg_ms, 0.0)
    burst: FloatArray = np.exp(-since / TAP_ARTEFACT_DECAY_MS) * np.sin(2 * math.pi * TAP_ARTEFACT_HZ * since / 1000)
    return amplitude_mv * np.nan_to_num(burst)


def tms_artefact_mv(since_pulse_ms: FloatArray, amplitude_mv: FloatArray) -> FloatArray:
    """The magnetic pulse in the EMG: biphasic, gone within 1 ms [mV]."""
    turn = (since_pulse_ms - 2 * PULSE_ARTEFACT_MS) / PULSE_ARTEFACT_MS
    shape = -turn * np.exp((1 - turn**2) / 2)  # turns of height 1
    return amplitude_mv[:, None] / 2 * np.nan_to_num(shape)


def mep_shape(since_pulse_ms: ArrayLike) -> FloatArray:
    """The mean waveform of a forearm MEP of peak-to-peak amplitude 1; same shape."""
    return _turns(np.asarray(since_pulse_ms, dtype=np.float64)) / _PEAK_TO_PEAK


def _turns(time_ms: FloatArray) -> FloatArray:
    waves = [height * np.exp(-0.5 * ((time_ms - centre) / sd) ** 2) for height, centre, sd in MEP_TURNS]
    total: FloatArray = np.sum(waves, axis=0)
    return total


_PEAK_TO_PEAK = float(np.ptp(_turns(np.linspace(0, 100, 10001))))
