"""The repeatability study: times of taps and rotations, and ISI errors, found in waveforms [Kim2020, 3.3.2, 5.2–5.3].

Its precision study reports an SD of the ISI error of 1.93 ms, and 8 mistrials of 900, all at an ISI of 10 ms, which is
more than five SDs. No single Gaussian does both, so `cushion` has that SD and no mistrials, and `timing-fault` has
valves that open late occasionally: about 8 in 100 trials at 10 ms are lost, and none elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from isiw.checks import number, whole
from isiw.devices.robot.mechanism import Geometry, draw_taps
from isiw.devices.robot.tapper import preset
from isiw.devices.robot.vane.rotation import Vane
from isiw.devices.robot.vane.tapper import RATE_HZ, draw_strokes, record_strokes
from isiw.devices.robot.waveforms import record_emg, record_robot, sample_times_ms
from isiw.errors import InvalidValueError
from isiw.lazy import pd, scipy
from isiw.log.record import SessionRecord
from isiw.signals.events import EMG_DELAY_MS, TapEvents, detect_events, first_rise, impact_times_in_emg, sweep_events
from isiw.signals.impact import VALVE_MS
from isiw.signals.waveforms import as_waveforms, crossing_before, first_true, rest_level
from isiw.sweeps import Sweep
from isiw.types import ArrayLike, FloatArray

_LEAST_FREEDOM = 2
"""Repeats of an ISI behind its first trial that an SD needs: that of two trials says next to nothing."""

FULL_RANGE_DEG = 178.0
"""A turn that counts as the full range of 180°: ten noise SDs of a coarse angle sensor less."""


@dataclass(frozen=True, eq=False)
class RotationEvents:
    """The events of n rotations [ms from the first sample], each of shape (n,), NaN where not found.

    Args:
        fill_ms: the pressure difference of the chambers begins to rise.
        motion_ms: the rotation begins.
        end_ms: the full range is reached.
    """

    fill_ms: FloatArray
    motion_ms: FloatArray
    end_ms: FloatArray

    def columns(self) -> dict[str, FloatArray]:
        """The events by name, in order of occurrence."""
        return {field.name.removesuffix("_ms"): getattr(self, field.name) for field in fields(self)}


def detect_rotations(
    angle_deg: ArrayLike, pressure: ArrayLike, rate_hz: float, valve_ms: float = VALVE_MS
) -> RotationEvents:
    """Find the events of n rotations."""
    angles = as_waveforms(angle_deg, rate_hz, "angle")
    level, _ = rest_level(angles, round(valve_ms * rate_hz / 1000), rate_hz)
    full = first_true(angles > level + FULL_RANGE_DEG)
    return RotationEvents(
        fill_ms=first_rise(as_waveforms(pressure, rate_hz, "pressure"), rate_hz, valve_ms),
        motion_ms=first_rise(angles, rate_hz, valve_ms),
        end_ms=np.where(full >= 0, crossing_before(angles, level + FULL_RANGE_DEG, full) * 1000 / rate_hz, math.nan),
    )


STUDY_ISI_MS = (10.0, 30.0, 50.0, 51.0, 52.0, 53.0, 54.0, 70.0, 90.0)
"""The ISIs of the precision study [ms] (5.2.1)."""

TRIAL_MS = 1000.0
CALIBRATION_TAPS = 21
BATCH = 100
MOST_TAPS = 100_000  # for each ISI
MOST_ROTATIONS = 2000  # each keeps a second of angle, pressures and flows

ERROR_BANDS_MS = (0.0, 1.0, 2.0, 3.0, 4.0, np.inf)
"""Between which an ISI error's magnitude is counted [ms], as in Table 5.1."""

HIT_DELAY_SD_MS = 6.0
"""SD over people of the hit delay of one rig, as on the tapping robot (dissertation, 4.2) [ms]."""


@dataclass(frozen=True, eq=False)
class TimingStudy:
    """The findings of a repeatability study.

    Args:
        events: those of all taps, or of all rotations [ms from the trial's start, 500 ms before its valve command].
        commanded_ms: commanded ISIs from the impact [ms], NaN for a tap without a pulse, shape (n,).
        realised_ms: realised ISIs [ms], NaN where no impact was found, shape (n,).
        hit_sd_ms: SD of an error that all hits share, if they were found in the EMG alone [ms]; else 0.
    """

    name: str
    events: TapEvents | RotationEvents
    commanded_ms: FloatArray
    realised_ms: FloatArray
    hit_sd_ms: float = 0.0

    @property
    def kind(self) -> str:
        """The repeated event: "taps" or "rotations"."""
        return "taps" if isinstance(self.events, TapEvents) else "rotations"

    @property
    def event_table(self) -> pd.DataFrame:
        """Mean, SD and range of each event that was found at least once."""
        rows = {}
        for name, times in self.events.columns().items():
            found = times[~np.isnan(times)]
            if found.size:
                sd_ms = found.std(ddof=1) if found.size > 1 else 0.0
                rows[name] = (found.mean(), sd_ms, found.min(), found.max(), found.size)
        table = pd.DataFrame.from_dict(rows, orient="index", columns=["mean_ms", "sd_ms", "low_ms", "high_ms", "n"])
        return table.rename_axis("event")

    @property
    def error_table(self) -> pd.DataFrame:
        """The ISI error, realised minus commanded, by commanded ISI.

        Mistrials, with a realised ISI below 0 or none at all, are counted and left out of the statistics (5.3.1). An
        ISI with fewer than three trials has no SD (NaN).
        """
        trials = pd.DataFrame({"isi_ms": self.commanded_ms, "error_ms": self.realised_ms - self.commanded_ms})
        trials["mistrial"] = ~(self.realised_ms >= 0)
        trials = trials.dropna(subset="isi_ms")
        trials["accepted_ms"] = trials["error_ms"].mask(trials["mistrial"])
        table = trials.groupby("isi_ms").agg(
            n=("accepted_ms", "count"),
            mean_ms=("accepted_ms", "mean"),
            sd_ms=("accepted_ms", "std"),
            mistrials=("mistrial", "sum"),
        )
        return table.assign(sd_ms=table["sd_ms"].mask(table["n"] <= _LEAST_FREEDOM))

    @property
    def mistrials(self) -> int:
        """Trials whose pulse came before the impact, or whose impact was not found."""
        return int(self.error_table["mistrials"].sum())

    @property
    def pulse_table(self) -> pd.DataFrame:
        """Variation of the pulse against the valve command, by commanded ISI (Fig. 5.9): columns n and sd_ms."""
        hit_ms = self.events.hit_ms if isinstance(self.events, TapEvents) else np.nan
        pulses = pd.DataFrame({"isi_ms": self.commanded_ms, "pulse_ms": self.realised_ms + hit_ms})
        return pulses.dropna().groupby("isi_ms").agg(n=("pulse_ms", "count"), sd_ms=("pulse_ms", "std"))

    @property
    def error_probabilities(self) -> pd.DataFrame:
        """Probability of an ISI error by its size, as `error_probabilities`."""
        return error_probabilities(self.commanded_ms, self.realised_ms, self.pooled_sd_ms)

    @property
    def pooled_sd_ms(self) -> float:
        """SD of the ISI error, each set's mean removed (5.2.1) [ms]; NaN of one ISI that came twice, or of none."""
        accepted = (self.realised_ms >= 0) & np.isfinite(self.commanded_ms)
        sets, errors = self.commanded_ms[accepted], (self.realised_ms - self.commanded_ms)[accepted]
        apart = [errors[sets == isi] - errors[sets == isi].mean() for isi in np.unique(sets)]
        left = len(errors) - len(apart)
        return math.sqrt(sum(float(part @ part) for part in apart) / left) if left >= _LEAST_FREEDOM else math.nan


def hit_delay_ms(study: TimingStudy) -> tuple[float, float] | None:
    """From the valve command to the impact, as a setting of a strategy [ms]; None if no impact was found."""
    if not isinstance(study.events, TapEvents):
        return None
    hits_ms = study.events.hit_ms[~np.isnan(study.events.hit_ms)] - VALVE_MS
    if not hits_ms.size:
        return None
    error_ms = hits_ms.std(ddof=1) / np.sqrt(hits_ms.size) if hits_ms.size > 1 else 0.0
    shared_ms = math.hypot(error_ms, study.hit_sd_ms)
    return float(hits_ms.mean()), float(np.hypot(math.sqrt(2.0) * HIT_DELAY_SD_MS, shared_ms))


def error_probabilities(commanded_ms: FloatArray, realised_ms: FloatArray, sd_ms: float) -> pd.DataFrame:
    """Probability of an ISI error by its magnitude: by a Gaussian, as in Table 5.1, and as counted."""
    low, high = np.array(ERROR_BANDS_MS[:-1]), np.array(ERROR_BANDS_MS[1:])
    trials = pd.DataFrame({"isi_ms": commanded_ms, "error_ms": realised_ms - commanded_ms})[realised_ms >= 0].dropna()
    size_ms = (trials["error_ms"] - trials.groupby("isi_ms")["error_ms"].transform("mean")).abs().to_numpy()
    counted = ((size_ms[:, None] >= low) & (size_ms[:, None] < high)).sum(axis=0) / max(len(size_ms), 1)
    gaussian = 2 * (scipy.stats.norm.sf(low, scale=sd_ms) - scipy.stats.norm.sf(high, scale=sd_ms))
    return pd.DataFrame({"from_ms": low, "to_ms": high, "gaussian": gaussian, "counted": counted})


def study_preset(
    name: str,
    *,
    taps: int = 100,
    isi_ms: Sequence[float] = STUDY_ISI_MS,
    seed: int = 0,
    rate_hz: float = 5000.0,
    pulse_jitter_ms: float = 0.0,
    on_done: Callable[[int], None] = lambda _taps: None,
) -> TimingStudy:
    """Run the repeatability study on a preset of the tapping robot, open loop; `on_done` hears how many taps are."""
    taps, seed = whole("taps", taps, least=1, most=MOST_TAPS), whole("seed", seed, least=0)
    geometry, rng = preset(name), np.random.default_rng(seed)
    predicted_ms = float(np.nanmedian(_tap(geometry, np.full(CALIBRATION_TAPS, np.nan), rate_hz, rng).hit_ms))
    commanded = np.repeat(np.asarray(isi_ms, dtype=np.float64), taps) if len(isi_ms) else np.full(taps, np.nan)
    pulse = predicted_ms + commanded
    if number("pulse_jitter_ms", pulse_jitter_ms, least=0):
        pulse = pulse + pulse_jitter_ms * rng.standard_normal(len(pulse))
    parts = []
    for first in range(0, len(pulse), BATCH):
        parts.append(_tap(geometry, pulse[first : first + BATCH], rate_hz, rng))
        on_done(min(first + BATCH, len(pulse)))
    events = _joined(parts)
    return TimingStudy(name, events, commanded, pulse - events.hit_ms)


def study_vane(vane: Vane | None = None, *, rotations: int = 100, seed: int = 0) -> TimingStudy:
    """Run the repeatability study on the simulated vane actuator: how precisely does a rotation begin and end?

    Each rotation goes from one end of the range to the other, with the friction and the reservoir's pressure of that
    stroke. The dissertation leaves this to future work and names a precision of 40–60 ms that a rotation has to begin
    with [Kim2020, 7.1, 7.5].
    """
    rotations, seed = whole("rotations", rotations, least=1, most=MOST_ROTATIONS), whole("seed", seed, least=0)
    rng = np.random.default_rng(seed)
    waves = record_strokes(draw_strokes(vane or Vane(), rotations, rng), rng)
    events = detect_rotations(waves["angle"], waves["vane_pressure"], RATE_HZ, VALVE_MS)
    nowhere = np.full(rotations, np.nan)
    return TimingStudy("vane", events, nowhere, nowhere)


def study_sweeps(name: str, sweeps: Iterable[Sweep], commanded_isi_ms: Iterable[float | None]) -> TimingStudy:
    """Run the repeatability study on recorded sweeps."""
    return _study(name, sweeps, commanded_isi_ms, sweep_events)  # which raises if the valve's time is unknown


def study_emg(name: str, sweeps: Iterable[Sweep], commanded_isi_ms: Iterable[float | None]) -> TimingStudy:
    """Run the repeatability study on sweeps without an acceleration: by what the tap does to the EMG (3.3.3)."""
    return _study(name, sweeps, commanded_isi_ms, _events_in_emg, EMG_DELAY_MS[1])


def _events_in_emg(sweep: Sweep) -> TapEvents:
    """The impact that the EMG shows, on the sweep's clock."""
    emg, pulse_ms, unknown = sweep.channels["emg"], sweep.t_tms_ms, np.full(1, np.nan)
    pulses = None if pulse_ms is None else [pulse_ms - emg.t0_ms]
    valve_ms = (sweep.t_valve_ms or 0.0) - emg.t0_ms
    hit_ms = impact_times_in_emg(emg.values, emg.rate_hz, valve_ms=valve_ms, t_tms_ms=pulses) + emg.t0_ms
    return TapEvents(unknown, unknown, hit_ms, unknown, hit_ms + EMG_DELAY_MS[0])


def _study(
    name: str,
    sweeps: Iterable[Sweep],
    commanded_isi_ms: Iterable[float | None],
    events_of: Callable[[Sweep], TapEvents],
    hit_sd_ms: float = 0.0,
) -> TimingStudy:
    parts, realised = [], []
    for sweep in sweeps:
        events, shift_ms = events_of(sweep), VALVE_MS - (sweep.t_valve_ms or 0.0)
        realised.append(np.nan if sweep.t_tms_ms is None else sweep.t_tms_ms - events.hit_ms[0])
        parts.append(TapEvents(*(times_ms + shift_ms for times_ms in events.columns().values())))
    if not parts:
        raise InvalidValueError(
            "isiw timing needs sweeps with an acceleration and the time of the valve command",
            got=name,
            remedy="Run a session on a device that hands over its sweeps, with the channel acceleration.",
        )
    commanded = np.array([np.nan if isi is None else isi for isi in commanded_isi_ms])
    if len(commanded) != len(parts):
        raise InvalidValueError("each sweep has one commanded ISI", got=len(commanded), expected=str(len(parts)))
    return TimingStudy(name, _joined(parts), commanded, np.array(realised), hit_sd_ms)


def study_session(record: SessionRecord) -> TimingStudy:
    """Run the repeatability study on the taps of a logged session; without an acceleration, by the EMG."""
    record.require_open()
    from_impact = record.header.space.reference == "impact"
    sweeps, commanded = [], []
    known = {name for trial in record.table for name in record.sweep(trial.index)}
    channel = "emg" if "acceleration" not in known else "acceleration"
    for trial in record.table:
        channels = record.sweep(trial.index)
        if channel in channels and trial.t_valve_ms is not None:
            sweeps.append(Sweep(channels, t_valve_ms=trial.t_valve_ms, t_tms_ms=trial.t_tms_ms))
            commanded.append(trial.commanded_isi_ms if from_impact else None)
    if channel == "emg" and sweeps:
        return study_emg(str(record.path), sweeps, commanded)
    return study_sweeps(str(record.path), sweeps, commanded)


def timing_report(study: TimingStudy) -> str:
    """A study in words and tables."""
    events = study.event_table
    origin = "the valve command" if study.kind == "taps" else "the actuator's own valve opens"
    lines = [
        f"{study.name}: {len(study.commanded_ms)} {study.kind}",
        "",
        f"When each event comes, in ms after {origin}:",
        "event          mean     SD   range            n",
    ]
    lines += [
        f"t_{name:<8} {mean - VALVE_MS:8.1f} {sd:6.1f}   [{low - VALVE_MS:.0f}, {high - VALVE_MS:.0f}]   {n:7.0f}"
        for name, mean, sd, low, high, n in events.itertuples()
    ]
    errors = study.error_table
    if len(errors):
        lines += ["", "ISI [ms]   mean error [ms]    SD      n   mistrials"]
        lines += [
            f"{isi:7g} {_figure(mean):>14} {_figure(sd):>12} {n:6.0f} {mistrials:8.0f}"
            for isi, n, mean, sd, mistrials in errors.itertuples()
        ]
        pooled = f"Pooled SD of the ISI error: {study.pooled_sd_ms:.2f} ms."
        unknown = "No ISI has three accepted trials, nor have two ISIs two, so the SD of the error is not known."
        known = unknown if np.isnan(study.pooled_sd_ms) else pooled
        lines += ["", f"{known} Mistrials: {study.mistrials}."]
    if study.hit_sd_ms:
        how = f"hits are {EMG_DELAY_MS[0]:g} ms before the tap shows in the EMG"
        lines += ["", f"No acceleration: {how}, and all may be off by {study.hit_sd_ms:g} ms (SD over people)."]
    hit_delay = hit_delay_ms(study)
    if hit_delay is not None:
        mean_ms, sd_ms = hit_delay
        lines += [
            "",
            "For ISIs that count from the valve command, state when the tap hits:",
            f"    hit_delay_ms = [{mean_ms:.1f}, {sd_ms:.1f}]",
            "Write it into the DeviceInfo of your rig, or under [strategy.settings] of a configuration.",
            f"The mean is one person's; the SD of {sd_ms:.1f} ms says how far the next person's may differ from it.",
            f"If you measured several people, write their mean and an SD of {HIT_DELAY_SD_MS:g} ms.",
        ]
    return "\n".join(lines)


def _figure(value_ms: float) -> str:
    return "–" if np.isnan(value_ms) else f"{value_ms:.2f}"


def _tap(geometry: Geometry, pulse_ms: FloatArray, rate_hz: float, rng: np.random.Generator) -> TapEvents:
    """Events found in the waveforms of taps with pulses at times from the trial's start [ms], NaN for none."""
    taps = draw_taps(geometry, len(pulse_ms), rng)
    times = sample_times_ms(rate_hz, TRIAL_MS, valve_ms=VALVE_MS)
    waves = record_robot(times, taps, rng)
    emg = record_emg(times, rate_hz, taps, rng, pulse_ms=pulse_ms - VALVE_MS, evoked_mv=np.zeros(len(pulse_ms)))
    return detect_events(waves["acceleration"], rate_hz, pressure=waves["pressure"], emg=emg, t_tms_ms=pulse_ms)


def _joined(parts: Iterable[TapEvents]) -> TapEvents:
    return TapEvents(*map(np.concatenate, zip(*(part.columns().values() for part in parts), strict=True)))
