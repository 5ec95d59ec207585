"""People whose MEPs were recorded: a trial is one recorded amplitude at the intensity that facilitation makes of 90 %.

The recordings, single pulses over recruitment curves of ten people under three coils each [OfirGeva], are in no
repository of ours: a folder of them is handed over. Trials are drawn from every second pulse of a level, so that the
other half can say what was known beforehand. A person is left out, and drawn for errors, with all three coils.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Final, Literal, TypeAlias

import numpy as np
import pandas as pd

from isiw.subjects import EmgFloor, PeakProfile, RecruitmentResponse, SimulatedSubject, TrialNoise
from isiw.subjects.responses import log_normal
from isiw.types import ArrayLike, FloatArray

FOLDER: Final = "ISIW_SHARED_DATA"
"""The environment variable that names the folder of the recordings, instead of that beside the repository."""

PAIRS_PCT_RMT: Final = 90.0
BOOSTS_PCT_RMT: Final = (10.0, 30.0)
STARTS_MS: Final = (5.0, 90.0)
WIDTHS_MS: Final = (100.0, 0.42, 40.0, 230.0)
"""Median, log SD, and the ends to which widths are clipped."""
HIT_DELAYS_MS: Final = (168.0, 192.0)
STATED_HIT_DELAY_MS: Final = (180.0, 8.0)
NO_FLOOR: Final = EmgFloor(1e-6, 0.0)
"""A recorded sweep has its floor already."""

Half: TypeAlias = Literal["drawn", "other"]


def recordings() -> Path:
    """The folder of the recordings; it need not be there."""
    beside = Path(__file__).parents[2] / "shared" / "data"
    return Path(os.environ.get(FOLDER, beside))


@dataclass(frozen=True, eq=False)
class Bank:
    """Recorded amplitudes of one person under one coil.

    Args:
        person: the person, from 1.
        coil: the coil.
        levels_pct_rmt: intensities that pulses were given at [% RMT], ascending, shape (k,).
        amplitudes_mv: those of each level in the order of recording [mV], k arrays.
    """

    person: int
    coil: str
    levels_pct_rmt: FloatArray
    amplitudes_mv: tuple[FloatArray, ...]

    def half(self, which: Half) -> Bank:
        """Every second pulse of each level: the first, third ... are those that trials are drawn from."""
        first = ("drawn", "other").index(which)
        return replace(self, amplitudes_mv=tuple(level[first::2] for level in self.amplitudes_mv))

    @property
    def means_mv(self) -> FloatArray:
        """Mean amplitude of each level [mV], shape (k,)."""
        return np.array([level.mean() for level in self.amplitudes_mv])

    def places(self, intensity_pct_rmt: ArrayLike) -> FloatArray:
        """Where intensities lie among the levels, 1.5 being halfway from the second to the third; same shape."""
        numbers = np.arange(len(self.levels_pct_rmt))
        return np.asarray(np.interp(intensity_pct_rmt, self.levels_pct_rmt, numbers))

    def drawn_mv(self, place: float, rng: np.random.Generator) -> float:
        """One amplitude of the level below or above a place [mV], the nearer the more probable."""
        which, among = rng.random(2)
        level = self.amplitudes_mv[int(place + which)]
        return float(level[int(among * len(level))])


@cache
def banks(folder: Path) -> tuple[Bank, ...]:
    """The banks of all people, coil by coil, so that the first ten are of ten people.

    Args:
        folder: of the recordings.
    """
    table = pd.read_csv(folder / "shayofir" / "fdi_recruitment_trials.csv").query("use == 1")
    found = []
    for (coil, person), pulses in table.groupby(["coil", "person"]):
        levels = {level: rows["mep_mv"].to_numpy() for level, rows in pulses.groupby("intensity_pct_rmt")}
        found.append(Bank(int(person), str(coil), np.array(list(levels), dtype=float), tuple(levels.values())))
    return tuple(found)


def made_up(bank: Bank, pulses: int, rng: np.random.Generator) -> Bank:
    """A bank of so many pulses a level of a hand as the default expects it, in the place of a recorded one."""
    slope = 0.23 * np.exp(0.1 * rng.standard_normal())
    curve = RecruitmentResponse(
        EmgFloor(0.009 * np.exp(0.38 * rng.standard_normal()), 0.2),
        amplitude_mv=0.8 * np.exp(0.85 * rng.standard_normal()),
        slope_per_pct=slope,
        x50_pct_rmt=117.0 + 3.5 * rng.standard_normal(),
        boost_pct_rmt=0.0,
        sigma_x_pct_rmt=1.65 * np.exp(0.25 * rng.standard_normal()) / slope,
        sigma_y=0.39,
    )

    def pulse(pct_rmt: float) -> float:
        there = replace(curve, intensity_pct_rmt=pct_rmt)
        evoked_mv = there.sample_evoked_mv(0.0, TrialNoise(rng.standard_normal()), rng)
        return evoked_mv + log_normal(rng, curve.floor.median_mv, curve.floor.log_sd)

    levels = tuple(np.array([pulse(pct_rmt) for _ in range(pulses)]) for pct_rmt in bank.levels_pct_rmt.tolist())
    return replace(bank, amplitudes_mv=levels)


@dataclass(frozen=True, eq=False)
class RecordedResponse:
    """The response of a person to the pulses of pairs, a recorded amplitude each; half of a bank.

    Args:
        bank: what is drawn from.
        boost_pct_rmt: by how much facilitation shifts the intensity at the best ISI [% RMT].
    """

    bank: Bank
    boost_pct_rmt: float
    floor: EmgFloor = field(default=NO_FLOOR)

    def places(self, facilitation: ArrayLike) -> FloatArray:
        """Where trials lie among the bank's levels; same shape."""
        return self.bank.places(PAIRS_PCT_RMT + self.boost_pct_rmt * np.asarray(facilitation, dtype=np.float64))

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Mean amplitude, linear between the levels [mV]; same shape."""
        numbers = np.arange(len(self.bank.levels_pct_rmt))
        return np.asarray(np.interp(self.places(facilitation), numbers, self.bank.means_mv))

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """One recorded amplitude [mV]."""
        del noise  # recorded amplitudes have theirs
        return self.bank.drawn_mv(float(self.places(facilitation)), rng)


@dataclass(frozen=True)
class RecordedPerson:
    """One of the cohort: a bank, and a window and a rig drawn for it.

    Args:
        number: which one, from 0; the banks come in turn.
        seed: of the cohort.
        folder: of the recordings.
        pulses: how many a level a made-up person has, in the place of who was recorded; None for who was.
    """

    number: int
    seed: int
    folder: Path
    pulses: int | None = None

    @cached_property
    def bank(self) -> Bank:
        """All that was recorded."""
        all_banks = banks(self.folder)
        recorded = all_banks[self.number % len(all_banks)]
        rng = np.random.default_rng([self.seed, self.number, 3])
        return recorded if self.pulses is None else made_up(recorded, self.pulses, rng)

    def subject(self, half: Half = "drawn") -> SimulatedSubject:
        """The person whose responses are those of one half."""
        rng = np.random.default_rng([self.seed, self.number])
        median_ms, log_sd, *ends_ms = WIDTHS_MS
        boost_pct_rmt, start_ms, hit_delay_ms, sd_ms = (
            float(rng.uniform(*ends)) for ends in (BOOSTS_PCT_RMT, STARTS_MS, HIT_DELAYS_MS, (1.0, 4.0))
        )
        width_ms = float(np.clip(median_ms * np.exp(log_sd * rng.standard_normal()), *ends_ms))
        return SimulatedSubject(
            PeakProfile(start_ms, width_ms),
            RecordedResponse(self.bank.half(half), boost_pct_rmt),
            hit_delay_ms,
            sd_ms,
            stated_hit_delay_ms=STATED_HIT_DELAY_MS,
        )

    def single_pulses(self, count: int) -> list[tuple[float, float]]:
        """Pulses alone given first: intensity [% RMT] and amplitude [mV] of each, from the other half.

        All levels in turn, in a new random order each time round; of more pulses the first ones are the same.

        Args:
            count: how many.
        """
        rng, half = np.random.default_rng([self.seed, self.number, 1]), self.bank.half("other")
        pulses: list[tuple[float, float]] = []
        while len(pulses) < count:
            places = rng.permutation(len(half.levels_pct_rmt)).tolist()
            pulses += [(float(half.levels_pct_rmt[place]), half.drawn_mv(place, rng)) for place in places]
        return pulses[:count]
