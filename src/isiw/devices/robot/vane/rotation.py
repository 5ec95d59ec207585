"""The vane actuator: its rotor, load and supply of air, and its equations, solved for many at once [Kim2020, 7.1–7.9].

    reservoir ── valve ── line (7.5 m) ── fitting ──▶ chamber 1 │vane│ chamber 2 ──▶ fitting ── line ── valve ── room

Values that the dissertation gives are those of its Table 7.1. It gives neither the conductances of valve and fitting,
nor the critical ratio, the bore of the line, or the air that is left in a chamber when the vane is at its stop; what
was chosen for them, and what they change, is in `docs/vane.md`.

The air in a volume is counted as P V = m R T [J]; at one temperature everywhere that is a mass. A step of the solver:

1. The valve's flow at this moment is put into a line of flows that are under way; what was put in L/c ago arrives.
   The step is far shorter than that delay, so no equation has to be solved for it.
2. The flow through the fitting is implicit: its conductance is that of the moment, its pressures are those after the
   step. However small a chamber, the pressures on both sides meet and do not overshoot, and no air is lost.
3. Speed under damping and dry friction is implicit too: a moment below the friction stops the vane within the step, and
   a vane at rest stays there until the moment exceeds the friction. Stops end the motion.

The text's equations were judged as follows. (7.2) prints the inequality the wrong way round: a flow is choked if the
downstream pressure is *less* than C_r of the upstream one. (7.7) lacks R T, which (7.5) has. (7.3) lets no air flow
back from the line into the reservoir; here it may, if the line's pressure is higher. (7.8) is judged at
`Rotor.lever_m3`. The leak is proportional to what a chamber has above the room's pressure, so that none flows at rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, NamedTuple

import numpy as np

from isiw.checks import Checked, NonNegative, Number, Positive, number, whole
from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, FloatArray, IntArray

ATMOSPHERE_BAR = 1.0
"""Pressure of the room, in which both chambers begin (Table 7.1), and the one that ISO 6358 refers flows to [bar]."""

SOUND_M_S = 343.0  # in air of 293 K
GRAVITY_M_S2 = 9.81
PA_PER_BAR = 1e5


@dataclass(frozen=True)
class Rotor(Checked):
    """The vane and its two chambers.

    Args:
        height_mm: from the shaft's surface to the vane's edge, h [mm].
        depth_mm: along the shaft, d [mm].
        radius_mm: of the shaft, r [mm].
        friction_nm: moment that it takes to break away, and to keep moving against friction, M_f [N m].
        damping_nm_s: moment by speed, B, which stands for air that leaks past the vane [N m s/rad].
        leak_l_min: air that a chamber at the reservoir's pressure loses [l/min of free air].
        dead_ml: air that is left in a chamber when the vane is at its stop [ml].

    Raises:
        InvalidValueError: a size that is not positive, or a friction, a damping or a leak below 0.
    """

    height_mm: Positive
    depth_mm: Positive
    radius_mm: Positive = 12.5
    friction_nm: NonNegative = 2.7
    damping_nm_s: NonNegative = 0.3
    leak_l_min: NonNegative = 0.5
    dead_ml: Positive = 2.0

    @property
    def lever_m3(self) -> float:
        """Moment by pressure difference, which is also the volume that a turn of 1 rad sweeps [m³].

        It is h d (h/2 + r): pressure acts at the middle of the vane's height. Equation 7.8 prints d/2 for h/2, by which
        a turn would do more work than the air that it takes in; and a friction of 2.7 N m, derived in the text from a
        break-away pressure of 0.4 bar, is that of a vane with h = 20 mm and d = 150 mm with h/2, to the last digit.
        """
        return self.height_mm * self.depth_mm * (self.height_mm / 2 + self.radius_mm) * 1e-9

    @property
    def break_away_bar(self) -> float:
        """Pressure difference at which the vane begins to move if nothing else turns it [bar]."""
        return self.friction_nm / (self.lever_m3 * PA_PER_BAR)


@dataclass(frozen=True)
class Load(Checked):
    """The load of the rotor; in the text the forearm is a cylinder of 0.9 kg and 40 mm that turns about its axis."""

    payload_n: NonNegative = 5.0  # weight of the added load, G_load
    arm_n: NonNegative = 5.0  # weight of the forearm that hangs off the axis, G_arm
    shaft_n: NonNegative = 2.0  # weight of the shaft that holds the arm, G_shaft
    arm_mm: NonNegative = 60.0  # from the axis to the centre of forearm and load, l
    shaft_mm: NonNegative = 25.0  # from the axis to the centre of the shaft, l_eq
    arm_kg_m2: Positive = 7.2e-4  # inertia of the forearm, I_arm
    shaft_kg_m2: Positive = 3.3e-4  # inertia of the shaft, I_shaft

    @property
    def inertia_kg_m2(self) -> float:
        """Of everything that turns; the added load is a point [kg m²]."""
        added = self.payload_n / GRAVITY_M_S2 * (self.arm_mm / 1000) ** 2
        return self.arm_kg_m2 + self.shaft_kg_m2 + added

    @property
    def moment_nm(self) -> float:
        """Moment of the weights with the arm level; it is this times sin(θ − π/2) (7.9) [N m]."""
        return ((self.arm_n + self.payload_n) * self.arm_mm + self.shaft_n * self.shaft_mm) / 1000


@dataclass(frozen=True)
class Supply(Checked):
    """The air: a reservoir, a small five-port valve [CKD2020], and from each of its outlets a line to one chamber."""

    reservoir_bar: Number = 4.0  # absolute
    valve_l_s_bar: Positive = 0.99  # sonic conductance of the valve, C_0
    fitting_l_s_bar: Positive = 0.75  # that of the fitting, C_f, less what the line's friction takes away
    critical_ratio: Annotated[float, partial(number, least=0, below=1)] = 0.2  # C_r: below it either flow is choked
    line_m: Positive = 7.5
    bore_mm: Positive = 6.0  # of a line, inside

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.reservoir_bar <= ATMOSPHERE_BAR:
            raise InvalidValueError(
                "a reservoir at the room's pressure drives nothing",
                got=self.reservoir_bar,
                expected=f"more than {ATMOSPHERE_BAR:g} bar",
                remedy="Pressures are absolute: add 1 bar to what a gauge shows.",
            )

    @property
    def line_m3(self) -> float:
        """Volume of a line [m³]."""
        return math.pi / 4 * (self.bore_mm / 1000) ** 2 * self.line_m

    @property
    def delay_ms(self) -> float:
        """The delay of the valve's flow by a line, L/c (7.6) [ms]."""
        return 1000 * self.line_m / SOUND_M_S


@dataclass(frozen=True)
class Vane:
    """A vane actuator with what it carries and what drives it.

    Args:
        rotor: the vane and its chambers.
        load: what it turns.
        supply: the air that drives it.
    """

    rotor: Rotor = field(default_factory=lambda: Rotor(height_mm=15.0, depth_mm=150.0))
    load: Load = field(default_factory=Load)
    supply: Supply = field(default_factory=Supply)


ROOM_PA = ATMOSPHERE_BAR * PA_PER_BAR
LITRE_PER_S_BAR = 1e-3  # a flow of 1 l/s of free air in J/s of P V, for each Pa: 1e-3 m³ · 1e5 Pa / 1e5 Pa
LONGEST_STEP_MS = 1.0
LONGEST_S = 60.0


@dataclass(frozen=True, eq=False)
class Rotations:
    """Rotations of n actuators: angle [rad], (n, w), and of both chambers and their lines (n, 2, w)."""

    t_ms: FloatArray  # after the first command, (w,)
    angle_rad: FloatArray  # θ, from 0 to π
    chamber_bar: FloatArray
    line_bar: FloatArray  # at the fitting
    valve_l_s: FloatArray  # of free air into each line
    delay_ms: FloatArray  # from the first command to the first motion, NaN without one, (n,)

    def one(self, index: int) -> Rotations:
        """One of them, as the only one."""
        rows = {name: values[index : index + 1] for name, values in vars(self).items() if name != "t_ms"}
        return Rotations(self.t_ms, **rows)


def orifice_flow(conductance: ArrayLike, critical_ratio: ArrayLike, from_pa: ArrayLike, to_pa: ArrayLike) -> FloatArray:
    """Flow from one side of an orifice to the other by ISO 6358 (7.1, 7.2), as P V in unit time [J/s]."""
    one, other = np.asarray(from_pa, dtype=np.float64), np.asarray(to_pa, dtype=np.float64)
    high, low = np.maximum(one, other), np.minimum(one, other)
    ratio = np.asarray(critical_ratio, dtype=np.float64)
    excess = np.maximum((low / high - ratio) / (1 - ratio), 0.0)
    flow: FloatArray = LITRE_PER_S_BAR * np.asarray(conductance) * np.sign(one - other) * high * np.sqrt(1 - excess**2)
    return flow


def rotate(
    vanes: Sequence[Vane],
    *,
    duration_s: float = 1.0,
    half_wave_s: float = 0.5,
    start_rad: float = math.pi / 2,
    step_ms: float = 0.1,
    sample_ms: float = 1.0,
) -> Rotations:
    """Fill chamber 1 and empty chamber 2, then the other way round, from rest at the room's pressure."""
    duration_s = number("duration_s", duration_s, above=0, most=LONGEST_S)
    half_wave_s = number("half_wave_s", half_wave_s, above=0)
    start_rad = number("start_rad", start_rad, least=0, most=math.pi)
    step_s = number("step_ms", step_ms, above=0, most=LONGEST_STEP_MS) / 1000
    every = round(number("sample_ms", sample_ms, least=step_ms) / step_ms)
    parts = _parts(vanes, step_s)
    state = _at_rest(parts, start_rad)
    under_way = np.zeros((int(parts.delay_steps.max()) + 1, *state.line_j.shape))
    delay_s, kept = np.full(len(vanes), math.nan), []
    for step in range(round(duration_s / step_s)):
        filled = int(step * step_s / half_wave_s + 1e-9) % 2
        valve = _valve_flow(parts, state, filled)
        under_way[step % len(under_way)] = valve
        arriving = under_way[(step - parts.delay_steps) % len(under_way), :, parts.columns].T
        if step % every == 0:
            kept.append((step, state, valve))
        state = _advanced(parts, state, arriving, step_s)
        delay_s = np.where(np.isnan(delay_s) & (state.speed_rad_s != 0), (step + 1) * step_s, delay_s)
    return _rotations(parts, kept, step_ms, 1000 * delay_s)


class _Parts(NamedTuple):
    """The constants of n actuators as arrays of shape (n,), in SI units but for the conductances."""

    lever_m3: FloatArray
    dead_m3: FloatArray
    friction_nm: FloatArray
    damping_nm_s: FloatArray
    leak_m3_s: FloatArray
    inertia_kg_m2: FloatArray
    weight_nm: FloatArray
    reservoir_pa: FloatArray
    valve: FloatArray
    fitting: FloatArray
    critical_ratio: FloatArray
    line_m3: FloatArray
    delay_steps: IntArray
    columns: IntArray


class _Motion(NamedTuple):
    """Air in the lines and chambers [J], shape (2, n), volumes of the chambers, and the vanes' motion, shape (n,)."""

    line_j: FloatArray
    chamber_j: FloatArray
    chamber_m3: FloatArray
    angle_rad: FloatArray
    speed_rad_s: FloatArray


def _parts(vanes: Sequence[Vane], step_s: float) -> _Parts:
    if not vanes:
        raise InvalidValueError("there is no actuator to rotate", got=0, expected="at least one Vane")

    def of_each(values: list[float]) -> FloatArray:
        return np.array(values, dtype=np.float64)

    rotors, loads, supplies = zip(*((vane.rotor, vane.load, vane.supply) for vane in vanes), strict=True)
    reservoir_pa = PA_PER_BAR * of_each([supply.reservoir_bar for supply in supplies])
    leak_w = LITRE_PER_S_BAR * PA_PER_BAR / 60 * of_each([rotor.leak_l_min for rotor in rotors])
    return _Parts(
        lever_m3=of_each([rotor.lever_m3 for rotor in rotors]),
        dead_m3=1e-6 * of_each([rotor.dead_ml for rotor in rotors]),
        friction_nm=of_each([rotor.friction_nm for rotor in rotors]),
        damping_nm_s=of_each([rotor.damping_nm_s for rotor in rotors]),
        leak_m3_s=leak_w / (reservoir_pa - ROOM_PA),
        inertia_kg_m2=of_each([load.inertia_kg_m2 for load in loads]),
        weight_nm=of_each([load.moment_nm for load in loads]),
        reservoir_pa=reservoir_pa,
        valve=of_each([supply.valve_l_s_bar for supply in supplies]),
        fitting=of_each([supply.fitting_l_s_bar for supply in supplies]),
        critical_ratio=of_each([supply.critical_ratio for supply in supplies]),
        line_m3=of_each([supply.line_m3 for supply in supplies]),
        delay_steps=np.rint([supply.delay_ms / 1000 / step_s for supply in supplies]).astype(np.int64),
        columns=np.arange(len(vanes)),
    )


def _at_rest(parts: _Parts, start_rad: float) -> _Motion:
    angle = np.full(len(parts.columns), start_rad)
    volumes = _chamber_m3(parts, angle)
    return _Motion(
        line_j=ROOM_PA * np.stack([parts.line_m3, parts.line_m3]),
        chamber_j=ROOM_PA * volumes,
        chamber_m3=volumes,
        angle_rad=angle,
        speed_rad_s=np.zeros_like(angle),
    )


def _chamber_m3(parts: _Parts, angle_rad: FloatArray) -> FloatArray:
    return parts.dead_m3 + parts.lever_m3 * np.stack([angle_rad, math.pi - angle_rad])


def _valve_flow(parts: _Parts, state: _Motion, filled: int) -> FloatArray:
    """Flow through the valve into each line [J/s], shape (2, n) (7.3)."""
    outside_pa = np.full_like(state.line_j, ROOM_PA)
    outside_pa[filled] = parts.reservoir_pa
    return orifice_flow(parts.valve, parts.critical_ratio, outside_pa, state.line_j / parts.line_m3)


def _advanced(parts: _Parts, state: _Motion, arriving: FloatArray, step_s: float) -> _Motion:
    """The state a step later, with what arrives through the lines [J/s], shape (2, n)."""
    through = _fitting_flow(parts, state, step_s)
    leak = parts.leak_m3_s * (state.chamber_j / state.chamber_m3 - ROOM_PA)
    line_j = state.line_j + step_s * (arriving - through)
    chamber_j = state.chamber_j + step_s * (through - leak)
    one_pa, other_pa = chamber_j / state.chamber_m3
    angle, speed = _turned(parts, state, (one_pa - other_pa) * parts.lever_m3, step_s)
    return _Motion(line_j, chamber_j, _chamber_m3(parts, angle), angle, speed)


def _fitting_flow(parts: _Parts, state: _Motion, step_s: float) -> FloatArray:
    """Flow from each line into its chamber within a step [J/s], shape (2, n) (7.4)."""
    line_pa, chamber_pa = state.line_j / parts.line_m3, state.chamber_j / state.chamber_m3
    flow = orifice_flow(parts.fitting, parts.critical_ratio, line_pa, chamber_pa)
    difference = line_pa - chamber_pa
    conductance = np.divide(flow, difference, out=np.zeros_like(flow), where=difference != 0)
    implicit: FloatArray = flow / (1 + step_s * conductance * (1 / parts.line_m3 + 1 / state.chamber_m3))
    return implicit


def _turned(parts: _Parts, state: _Motion, moment_nm: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Angle and speed a step later, by a moment of the air (7.8, 7.9)."""
    weight_nm = parts.weight_nm * np.sin(state.angle_rad - math.pi / 2)
    push = parts.inertia_kg_m2 * state.speed_rad_s + step_s * (moment_nm - weight_nm)
    left = np.maximum(np.abs(push) - step_s * parts.friction_nm, 0.0)
    speed = np.sign(push) * left / (parts.inertia_kg_m2 + step_s * parts.damping_nm_s)
    free = state.angle_rad + step_s * speed
    angle = np.clip(free, 0.0, math.pi)
    return angle, np.where(angle == free, speed, 0.0)


def _rotations(
    parts: _Parts, kept: list[tuple[int, _Motion, FloatArray]], step_ms: float, delay_ms: FloatArray
) -> Rotations:
    def over_time(samples: list[FloatArray]) -> FloatArray:
        return np.moveaxis(np.stack(samples, axis=-1), -2, 0)

    lines_pa = [state.line_j / parts.line_m3 for _, state, _ in kept]
    return Rotations(
        t_ms=step_ms * np.array([step for step, *_ in kept], dtype=np.float64),
        angle_rad=over_time([state.angle_rad for _, state, _ in kept]),
        chamber_bar=over_time([state.chamber_j / state.chamber_m3 for _, state, _ in kept]) / PA_PER_BAR,
        line_bar=over_time(lines_pa) / PA_PER_BAR,
        valve_l_s=over_time([valve for *_, valve in kept]) / (LITRE_PER_S_BAR * PA_PER_BAR),
        delay_ms=delay_ms,
    )


@dataclass(frozen=True, eq=False)
class Performance:
    """Range of n rotations within a period, as a share of 180°, and break-away delay from rest in mid-range, (n,)."""

    range_share: FloatArray
    delay_ms: FloatArray  # NaN without motion


def performance(
    vanes: Sequence[Vane], *, period_s: float = 1.0, periods: int = 10, step_ms: float = 0.1
) -> Performance:
    """Range and delay of actuators that are commanded to and fro, there and back in each period (7.1)."""
    period_s, periods = number("period_s", period_s, above=0), whole("periods", periods, least=1)
    sample_ms = step_ms * max(1, round(2.0 / step_ms))
    done = rotate(vanes, duration_s=period_s * periods, half_wave_s=period_s / 2, step_ms=step_ms, sample_ms=sample_ms)
    last = done.angle_rad[:, done.t_ms >= 1000 * period_s * (periods - 1)]
    return Performance(np.ptp(last, axis=1) / math.pi, done.delay_ms)
