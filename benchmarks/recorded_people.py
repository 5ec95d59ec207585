"""People whose MEPs were recorded: a trial is one recorded amplitude at the intensity that facilitation makes of 90 %.

The recordings, single pulses over recruitment curves of ten people under three coils each [OfirGeva], are in no
repository of ours: a folder of them is handed over. A bank is one recruitment curve, five pulses a level, smoothed: its
trials, and pulses that are given first, are drawn from the same law. Or a bank is all of a coil, which is two curves:
trials are then drawn from every second pulse of a level, and the other half says what was known beforehand. A person is
left out, and drawn for errors, with all banks.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Final, Literal, TypeAlias

import numpy as np
import pandas as pd

from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.subjects import EmgFloor, PeakProfile, RecruitmentResponse, SimulatedSubject, TrialNoise
from isiw.subjects.responses import log_normal
from isiw.trials import Status, Trial
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

ADDED_MV: Final = 0.002
"""What is added to an amplitude before its logarithm is taken [mV]."""
LEAST_MV: Final = 2e-4
"""No smaller amplitude is drawn: no amplifier shows it, and a strategy refuses it [mV]."""
LEAST_PULSES, LEAST_LEVELS = 3, 5
"""Curves with fewer pulses at a level, or with fewer levels, are left out."""

RMT_PCT_MSO, MOST_SEARCHED = 50.0, 60
"""The motor threshold in searches for it, as recordings have intensities in % of it [% MSO], and their most pulses."""

Half: TypeAlias = Literal["drawn", "other"]
Banks: TypeAlias = Literal["curves", "coils"]
"""What a bank is: a smoothed recruitment curve, or both curves of a coil, split in halves."""


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
        kernel_log_sds: SD of the normal law of log(amplitude + 2 µV) around each of them, by level, shape (k,); None
            for the amplitudes themselves.
    """

    person: int
    coil: str
    levels_pct_rmt: FloatArray
    amplitudes_mv: tuple[FloatArray, ...]
    kernel_log_sds: FloatArray | None = None

    def half(self, which: Half) -> Bank:
        """Every second pulse of each level: the first, third ... are those that trials are drawn from.

        A smoothed bank is a law, and has no halves: all of it is either.
        """
        if self.kernel_log_sds is not None:
            return self
        first = ("drawn", "other").index(which)
        return replace(self, amplitudes_mv=tuple(level[first::2] for level in self.amplitudes_mv))

    @property
    def means_mv(self) -> FloatArray:
        """Mean amplitude of each level [mV], shape (k,)."""
        means_mv = np.array([level.mean() for level in self.amplitudes_mv])
        if self.kernel_log_sds is None:
            return means_mv
        return np.asarray((means_mv + ADDED_MV) * np.exp(0.5 * self.kernel_log_sds**2) - ADDED_MV)

    def places(self, intensity_pct_rmt: ArrayLike) -> FloatArray:
        """Where intensities lie among the levels, 1.5 being halfway from the second to the third; same shape."""
        numbers = np.arange(len(self.levels_pct_rmt))
        return np.asarray(np.interp(intensity_pct_rmt, self.levels_pct_rmt, numbers))

    def drawn_mv(self, place: float, rng: np.random.Generator) -> float:
        """One amplitude of the level below or above a place [mV], the nearer the more probable."""
        which, among = rng.random(2)
        number = int(place + which)
        level = self.amplitudes_mv[number]
        drawn_mv = float(level[int(among * len(level))])
        if self.kernel_log_sds is None:
            return drawn_mv
        factor = float(np.exp(self.kernel_log_sds[number] * rng.standard_normal()))
        return max(LEAST_MV, (drawn_mv + ADDED_MV) * factor - ADDED_MV)


@cache
def banks(folder: Path, kind: Banks = "curves") -> tuple[Bank, ...]:
    """The banks of all people as they were recorded, coil by coil, so that the first ten are of ten people.

    Args:
        folder: of the recordings.
        kind: of the banks. Where the numbers of pulses begin again, another curve does.
    """
    table = pd.read_csv(folder / "shayofir" / "fdi_recruitment_trials.csv").query("use == 1")
    coils = [table["coil"], table["person"]]
    again = table["pulse"].groupby(coils).diff() <= 0
    table = table.assign(curve=again.groupby(coils).cumsum() if kind == "curves" else 0)
    found = []
    for (coil, _, person), pulses in table.groupby(["coil", "curve", "person"]):
        levels = {level: rows["mep_mv"].to_numpy() for level, rows in pulses.groupby("intensity_pct_rmt")}
        if kind == "coils" or (len(levels) >= LEAST_LEVELS and min(map(len, levels.values())) >= LEAST_PULSES):
            found.append(Bank(int(person), str(coil), np.array(list(levels), dtype=float), tuple(levels.values())))
    return tuple(found)


def smoothed(bank: Bank, others: Iterable[Bank]) -> Bank:
    """A curve whose log amplitudes have at each level the variance that its pulses say, without gaps between them.

    Around each of n pulses lies a normal law with the SD of the person's pulses about the means of their levels, at
    this intensity in all curves, over the root of n: so much the n pulses themselves vary too little.

    Args:
        bank: the curve.
        others: all curves, those of the same person among them.
    """
    own = [each for each in others if each.person == bank.person]

    def log_sd(pct_rmt: float) -> float:
        alike = [
            np.log(level + ADDED_MV)
            for each in own
            for at, level in zip(each.levels_pct_rmt.tolist(), each.amplitudes_mv, strict=True)
            if round(at, -1) == round(pct_rmt, -1)
        ]
        squares = sum(float(((logs - logs.mean()) ** 2).sum()) for logs in alike)
        return float(np.sqrt(squares / sum(len(logs) - 1 for logs in alike)))

    counts = np.array([len(level) for level in bank.amplitudes_mv])
    return replace(bank, kernel_log_sds=np.array([log_sd(at) for at in bank.levels_pct_rmt.tolist()]) / np.sqrt(counts))


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
    """The response of a person to the pulses of pairs, an amplitude of a bank each.

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
        banks: what a bank is.
    """

    number: int
    seed: int
    folder: Path
    pulses: int | None = None
    banks: Banks = "curves"

    @cached_property
    def bank(self) -> Bank:
        """All that was recorded, or its law."""
        all_banks = banks(self.folder, self.banks)
        recorded = all_banks[self.number % len(all_banks)]
        if self.pulses is not None:
            return made_up(recorded, self.pulses, np.random.default_rng([self.seed, self.number, 3]))
        return smoothed(recorded, all_banks) if self.banks == "curves" else recorded

    def subject(self, half: Half = "drawn") -> SimulatedSubject:
        """The person whose responses are those of the bank, or of one half of it."""
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
        """Pulses alone given first: intensity [% RMT] and amplitude [mV] of each, from the bank or its other half.

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

    def bank_of_pulses(self, count: int) -> Bank:
        """Single pulses given first as a bank: the amplitudes by level, and no law.

        Args:
            count: how many; every level had one at least.
        """
        pulses = self.single_pulses(count)
        levels = self.bank.levels_pct_rmt
        by_level = tuple(np.array([mep_mv for at, mep_mv in pulses if at == level]) for level in levels.tolist())
        return replace(self.bank, amplitudes_mv=by_level, kernel_log_sds=None)

    def searched_pulses(self) -> list[Trial]:
        """Pulses of a Bayesian search for the motor threshold, from the bank or its other half; none if it found none.

        As `isiw run --after` has them, their intensities are shares of the threshold that the search found.
        """
        rng, half = np.random.default_rng([self.seed, self.number, 4]), self.bank.half("other")
        search = make_threshold_search("bayes", IntensityRange(20, 100))
        while not search.decision().stop and len(search.pulses) < MOST_SEARCHED:
            pct_mso = search.ask()
            place = float(half.places(100.0 * pct_mso / RMT_PCT_MSO))
            search.tell(pct_mso, half.drawn_mv(place, rng))
        found_pct_mso = search.estimate().threshold_pct_mso
        if found_pct_mso is None:
            return []
        return [
            Trial(number, Status.ACCEPTED, None, mep_mv=pulse.mep_mv, intensity_pct_rmt=100.0 * pct_mso / found_pct_mso)
            for number, pulse in enumerate(search.pulses)
            if (pct_mso := pulse.intensity_pct_mso) is not None
        ]
