"""The pneumatic tapping robot as a mechanism: from the valve command to the hammer at rest on the wrist.

    valve ── line delay ──▶ chamber fills ──▶ static friction breaks ──▶ descent ──▶ contact ⇄ flight ──▶ rest

The pressure approaches the supply's exponentially; on contact the tendon is a damped spring. Break-away pressure,
travel and stiffness follow from the dissertation's event times (Table 3.2). Times are in ms from the valve command.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from isiw.checks import Checked, NonNegative, Positive, Share
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.types import ArrayLike, FloatArray

SUPPLY_KPA = 413.7
"""60 psi [Kim2020, 3.2.2, where it is printed as 416.7 kPa]."""

LINE_DELAY_MS = 23.0  # t_fill of every preset; sound needs 22 ms for the 7.5 m line
FILL_MS = 100.0  # time constant of the chamber
DRIVE_M_S2 = 120.0  # acceleration of the hammer at the full supply pressure without friction
BREAK_AWAY_M_S2 = 6.0  # what static friction exceeds kinetic friction by
DAMPING = 0.3  # of the contact, as a share of the critical one
_ROOT = math.sqrt(1 - DAMPING**2)
SEPARATION_RAD = (math.pi - math.atan2(2 * DAMPING * _ROOT, 1 - 2 * DAMPING**2)) / _ROOT
"""The natural phase at which a damped spring has pushed its load back to zero force."""


@dataclass(frozen=True)
class SensorNoise:
    """Noise SD of each sensor: white, but for the EMG at rest, in the amplifier's band of 10–1000 Hz [µV RMS]."""

    valve_v: float = 0.02
    pressure_kpa: float = 0.5
    acceleration_m_s2: float = 0.3
    force_n: float = 0.1
    emg_uv: float = 1.0


@dataclass(frozen=True)
class EventTime(Checked):
    """The time of an event of a tap, and its SD from tap to tap [ms]."""

    mean_ms: Positive
    sd_ms: NonNegative


@dataclass(frozen=True)
class Faults(Checked):
    """Shares of taps in which the hammer does not move, or the valve opens late."""

    stuck_probability: Share = 0.0
    late_probability: Share = 0.0
    late_ms: tuple[float, float] = (0.0, 0.0)  # uniform between the two

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.late_ms[0] <= self.late_ms[1]:
            raise InvalidValueError("Faults.late_ms must ascend from 0", got=self.late_ms)


@dataclass(frozen=True)
class Geometry(Checked):
    """One person's wrist under the robot, by its mean event times and how they vary from tap to tap."""

    descent: EventTime  # its start after the valve command, which varies by the static friction
    hit: EventTime  # the impact after the valve command, which varies by friction and travel together
    contact: EventTime  # for how long the tendon decelerates the hammer
    memg: EventTime = EventTime(20.0, 0.5)  # artefact of the impact in the EMG, after the impact
    artefact_mv: NonNegative = 0.1
    load_cell: bool = False  # tapped instead of a person
    faults: Faults = field(default_factory=Faults)
    noise: SensorNoise = field(default_factory=SensorNoise)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not LINE_DELAY_MS < self.descent.mean_ms < self.hit.mean_ms:
            raise InvalidValueError(
                "a tap's events are out of order",
                got=(LINE_DELAY_MS, self.descent.mean_ms, self.hit.mean_ms),
                expected="line delay < descent < hit",
            )
        if self.travel_sd_ms is None:
            raise InvalidValueError(
                "the friction alone makes the hit vary more than that",
                got=self.hit.sd_ms,
                expected=f"at least {self.friction_share * self.descent.sd_ms:.2f} ms",
                remedy="Raise the SD of the hit or lower that of the descent.",
            )

    @cached_property
    def kinetic_share(self) -> float:
        """Kinetic friction, as a share of the supply pressure."""
        return float(_pressure_share(self.descent.mean_ms)) - BREAK_AWAY_M_S2 / DRIVE_M_S2

    @cached_property
    def hit_speed_m_s(self) -> float:
        """Speed of the hammer at the mean impact [m/s]."""
        return float(_speed(self.descent.mean_ms, self.hit.mean_ms, self.kinetic_share))

    @cached_property
    def travel_mm(self) -> float:
        """Mean travel of the hammer from its initial position to the tendon [mm]."""
        return float(_travel(self.descent.mean_ms, self.hit.mean_ms, self.kinetic_share))

    @property
    def friction_share(self) -> float:
        """By how much the hit is later when the descent is 1 ms later: a late start has more pressure behind it."""
        return BREAK_AWAY_M_S2 * (self.hit.mean_ms - self.descent.mean_ms) / (1000 * self.hit_speed_m_s)

    @property
    def travel_sd_ms(self) -> float | None:
        """The travel's share in the SD of the hit [ms]; None if nothing is left for it."""
        left = self.hit.sd_ms**2 - (self.friction_share * self.descent.sd_ms) ** 2
        return math.sqrt(left) if left >= 0 else None

    @cached_property
    def stiffness_rad_ms(self) -> float:
        """Natural frequency of the hammer on the tendon [rad/ms], from the contact's length."""
        drive_m_s2 = float(drive(self.hit.mean_ms, self.kinetic_share))
        phase = np.linspace(0, SEPARATION_RAD, 2001)

        def too_short(rad_ms: float) -> float:
            peak_m_s2 = 1000 * self.hit_speed_m_s * rad_ms
            exceeds = np.flatnonzero(-rebound(phase) * peak_m_s2 > drive_m_s2)
            decelerated_ms = float(phase[exceeds[-1]] / rad_ms) if exceeds.size else 0.0
            return decelerated_ms - self.contact.mean_ms

        softest = 3 * drive_m_s2 / (1000 * self.hit_speed_m_s)  # below it the drive all but wins against the spring
        if too_short(softest) < 0:
            raise InvalidValueError("the hammer is too slow to be pushed back for so long", got=self.contact.mean_ms)
        return float(scipy.optimize.brentq(too_short, softest, 2 * math.pi / self.contact.mean_ms))


@dataclass(frozen=True, eq=False)
class Taps:
    """The course of n taps, which detectors do not see: times after the valve command, NaN if nothing came, (n,)."""

    descent_ms: FloatArray
    hit_ms: FloatArray
    rad_ms: FloatArray  # natural frequency of each contact [rad/ms]
    speed_m_s: FloatArray  # at contact
    memg_ms: FloatArray  # artefact in the EMG
    late_ms: FloatArray  # by how much the valve opened late, included in the others
    geometry: Geometry

    def none(self) -> Taps:
        """As many taps that do not happen: no air, no hammer."""
        nowhere = np.full_like(self.hit_ms, math.nan)
        never = np.full_like(self.hit_ms, math.inf)
        return replace(self, descent_ms=nowhere, hit_ms=nowhere, memg_ms=nowhere, late_ms=never)


def draw_taps(geometry: Geometry, n: int, rng: np.random.Generator) -> Taps:
    """Taps with the variation of a geometry, n of them."""
    z = rng.standard_normal((4, n))
    fault = rng.uniform(size=(3, n))
    stuck = np.where(fault[2] < geometry.faults.stuck_probability, math.nan, 0.0)
    late = np.where(
        fault[0] < geometry.faults.late_probability,
        geometry.faults.late_ms[0] + fault[1] * np.ptp(geometry.faults.late_ms),
        0,
    )
    kinetic = geometry.kinetic_share
    # However low the static friction, nothing moves before the pressure exceeds the kinetic one.
    earliest_ms = LINE_DELAY_MS - FILL_MS * math.log1p(-kinetic) + 1.0
    descent = np.maximum(geometry.descent.mean_ms + geometry.descent.sd_ms * z[0], earliest_ms)
    travel_sd_ms = geometry.travel_sd_ms or 0.0
    travel = geometry.travel_mm + geometry.hit_speed_m_s * travel_sd_ms * z[1]
    hit = _arrival(descent, travel, kinetic, geometry.hit.mean_ms)
    contact_ms = np.maximum(geometry.contact.mean_ms + geometry.contact.sd_ms * z[2], 0.5)
    return Taps(
        descent_ms=descent + late + stuck,
        hit_ms=hit + late + stuck,
        rad_ms=geometry.stiffness_rad_ms * geometry.contact.mean_ms / contact_ms,
        speed_m_s=_speed(descent, hit, kinetic),
        memg_ms=hit + late + stuck + geometry.memg.mean_ms + geometry.memg.sd_ms * z[3],
        late_ms=late,
        geometry=geometry,
    )


def _pressure_share(time_ms: ArrayLike) -> FloatArray:
    """Pressure of the chamber, as a share of the supply's."""
    since_fill = np.maximum(np.asarray(time_ms, dtype=np.float64) - LINE_DELAY_MS, 0.0)
    return -np.expm1(-since_fill / FILL_MS)


def pressure_kpa(time_ms: ArrayLike) -> FloatArray:
    """Pressure of the chamber above the room's [kPa]."""
    return SUPPLY_KPA * _pressure_share(time_ms)


def drive(time_ms: ArrayLike, kinetic_share: float) -> FloatArray:
    """Acceleration of the moving hammer by the chamber's pressure [m/s²]."""
    return DRIVE_M_S2 * (_pressure_share(time_ms) - kinetic_share)


def _speed(descent_ms: ArrayLike, time_ms: ArrayLike, kinetic_share: float) -> FloatArray:
    """Speed of the hammer [m/s]: the drive integrated from the start of the descent."""
    start, now = (np.asarray(time, dtype=np.float64) - LINE_DELAY_MS for time in (descent_ms, time_ms))
    decay = FILL_MS * (np.exp(-now / FILL_MS) - np.exp(-start / FILL_MS))
    speed: FloatArray = DRIVE_M_S2 * ((1 - kinetic_share) * (now - start) + decay) / 1000
    return speed


def _travel(descent_ms: ArrayLike, time_ms: ArrayLike, kinetic_share: float) -> FloatArray:
    """Distance of the hammer from its initial position [mm]: the speed integrated from the start of the descent."""
    start, now = (np.asarray(time, dtype=np.float64) - LINE_DELAY_MS for time in (descent_ms, time_ms))
    gone = now - start
    initial = np.exp(-start / FILL_MS)
    decay = FILL_MS * (FILL_MS * (initial - np.exp(-now / FILL_MS)) - initial * gone)
    travel: FloatArray = DRIVE_M_S2 * ((1 - kinetic_share) * gone**2 / 2 + decay) / 1000
    return travel


def _arrival(descent_ms: FloatArray, travel_mm: FloatArray, kinetic_share: float, first_ms: float) -> FloatArray:
    """When the hammer has travelled so far: Newton's method on a convex function, from beyond the solution."""
    time = np.full(descent_ms.shape, first_ms + 50.0)
    for _ in range(12):
        excess = _travel(descent_ms, time, kinetic_share) - travel_mm
        time = time - excess / _speed(descent_ms, time, kinetic_share)
    return time


def rebound(phase_rad: ArrayLike) -> FloatArray:
    """Acceleration by a damped spring that a load hits with unit speed, over speed times natural frequency."""
    phase = np.asarray(phase_rad, dtype=np.float64)
    turn = _ROOT * phase
    swing = 2 * DAMPING * np.cos(turn) + (1 - 2 * DAMPING**2) / _ROOT * np.sin(turn)
    force: FloatArray = -np.exp(-DAMPING * phase) * swing
    return np.where((phase >= 0) & (phase <= SEPARATION_RAD), force, 0.0)


def restitution() -> float:
    """Speed of the hammer as it leaves the tendon, as a share of that with which it came."""
    turn = _ROOT * SEPARATION_RAD
    return -math.exp(-DAMPING * SEPARATION_RAD) * (math.cos(turn) - DAMPING / _ROOT * math.sin(turn))
