"""The parts of a vane actuator: the rotor and its chambers, its load, and the air that drives it.

    reservoir ── valve ── line (7.5 m) ── fitting ──▶ chamber 1 │vane│ chamber 2 ──▶ fitting ── line ── valve ── room

Values that the dissertation gives are those of its Table 7.1. It gives neither the conductances of valve and fitting,
nor the critical ratio, the bore of the line, or the air that is left in a chamber when the vane is at its stop; what
was chosen for them, and what they change, is in `docs/vane.md`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

from isiw.checks import Checked, NonNegative, Number, Positive, number
from isiw.errors import InvalidValueError

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
