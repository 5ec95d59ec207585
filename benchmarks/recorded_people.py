"""People whose MEPs were recorded: every trial's amplitude is that of a real sweep.

Profiles and hit delays are those of the cohort `gaussian`; what facilitation does to the amplitude is put together from
sweeps that were recorded at rest and after stronger pulses. The sweeps (University of Eastern Finland, BSD-3-Clause,
repository NeuromodulationUEF/MEPFeatX) are those of the tests.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import norm

from isiw.studies import SimulatedSession
from isiw.subjects.cohorts import person_of
from isiw.subjects.responses import EmgFloor, ResponseCurve, TrialNoise
from isiw.subjects.subject import SimulatedSubject
from isiw.types import ArrayLike, FloatArray

FOLDER = Path(__file__).parents[1] / "tests" / "data" / "uef"
AT_REST_MV = 0.013
"""The forearm's recruitment curve has fourteen sweeps without an MEP, below this."""
NO_FLOOR = EmgFloor(1e-6, 0.0)
"""A recorded sweep has its floor already."""


@cache
def sweeps_mv(dataset: str, folder: Path = FOLDER) -> FloatArray:
    """Peak-to-peak amplitudes of the recorded sweeps of one muscle [mV], the smallest first."""
    table = pd.read_csv(folder / "uef_trials.csv")
    return np.sort(table.loc[table["dataset"] == dataset, "p2p_uV"].to_numpy() / 1000.0)


def hand_mv() -> FloatArray:
    """152 hand sweeps (FDI) after pulses of one intensity [mV]."""
    return sweeps_mv("ID01")


def forearm_mv() -> FloatArray:
    """70 forearm sweeps (ECR) over a whole recruitment curve [mV]."""
    return sweeps_mv("ID10_1")


def rest_mv() -> FloatArray:
    """Forearm sweeps without an MEP [mV]."""
    return forearm_mv()[forearm_mv() < AT_REST_MV]


@dataclass(frozen=True, eq=False)
class Switched:
    """A trial is one of some recorded sweeps, or one at rest; facilitation says how often.

    Args:
        evoked_mv: the sweeps with an MEP [mV].
        least: how often without facilitation.
        most: how often at the best ISI.
    """

    evoked_mv: FloatArray
    least: float = 0.0
    most: float = 1.0
    floor: EmgFloor = NO_FLOOR

    def _share(self, facilitation: ArrayLike) -> FloatArray:
        return self.least + (self.most - self.least) * np.asarray(facilitation, dtype=np.float64)

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Expected amplitude [mV]."""
        share = self._share(facilitation)
        return share * self.evoked_mv.mean() + (1.0 - share) * rest_mv().mean()

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """The amplitude of a sweep [mV]."""
        responds = rng.random() < self._share(facilitation)
        return float(rng.choice(self.evoked_mv if responds else rest_mv()) * np.exp(noise.log_gain))


@dataclass(frozen=True, eq=False)
class Scaled:
    """A trial is a recorded sweep times the facilitation, on an EMG floor.

    Args:
        evoked_mv: the sweeps [mV].
        floor: the EMG floor.
    """

    evoked_mv: FloatArray
    floor: EmgFloor

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Expected amplitude above the floor [mV]."""
        return np.asarray(facilitation, dtype=np.float64) * self.evoked_mv.mean()

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """The amplitude above the floor [mV]."""
        return float(facilitation * rng.choice(self.evoked_mv) * np.exp(noise.log_gain))


@dataclass(frozen=True, eq=False)
class Climbed:
    """Facilitation, and noise, climb a recorded recruitment curve: the sweeps of one person in the order of their size.

    Args:
        low: where on the curve a trial without facilitation is, 0 being its smallest sweep and 1 its largest.
        high: where one at the best ISI is.
        noise_sd: SD of the place.
    """

    low: float
    high: float
    noise_sd: float
    floor: EmgFloor = NO_FLOOR

    def _sweep_mv(self, facilitation: ArrayLike, z: ArrayLike) -> FloatArray:
        place = self.low + (self.high - self.low) * np.asarray(facilitation, dtype=np.float64)
        curve = forearm_mv()
        return np.interp(place + self.noise_sd * np.asarray(z), np.linspace(0.0, 1.0, len(curve)), curve)

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Expected amplitude [mV]."""
        z = norm.ppf((np.arange(200) + 0.5) / 200)
        return self._sweep_mv(np.asarray(facilitation, dtype=np.float64)[..., None], z).mean(-1)

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """The amplitude of a sweep [mV]."""
        del rng
        return float(self._sweep_mv(facilitation, noise.input_z) * np.exp(noise.log_gain))


def _occasional(rng: np.random.Generator) -> Switched:
    return Switched(hand_mv(), float(rng.uniform(0, 0.1)), float(rng.uniform(0.5, 0.9)))


def _scaled(rng: np.random.Generator) -> Scaled:
    floor = EmgFloor(float(0.008 * np.exp(0.3 * rng.standard_normal())), 0.3)
    return Scaled(float(rng.uniform(0.05, 1.0)) * hand_mv(), floor)


def _climbed(rng: np.random.Generator) -> Climbed:
    return Climbed(float(rng.uniform(0, 0.15)), float(rng.uniform(0.35, 0.8)), float(rng.uniform(0.08, 0.2)))


def _nonresponder(rng: np.random.Generator) -> Switched:
    share = float(rng.uniform(0, 0.2))
    return Switched(float(rng.uniform(0.05, 1.0)) * hand_mv(), share, share)


PEOPLE: dict[str, Callable[[np.random.Generator], ResponseCurve]] = {
    "switched-hand": lambda _rng: Switched(hand_mv()),
    "switched-forearm": lambda _rng: Switched(forearm_mv()[18:45]),
    "occasional": _occasional,
    "scaled": _scaled,
    "climbed": _climbed,
    "no-window": _nonresponder,
}


@dataclass(frozen=True)
class RecordedSession(SimulatedSession):
    """A session with a person whose MEPs were recorded; `cohort` is one of `PEOPLE`."""

    def subject(self) -> SimulatedSubject:
        """The person."""
        usual = person_of("gaussian", self.person, self.seed)
        rng = np.random.default_rng([list(PEOPLE).index(self.cohort), self.seed, self.person])
        return replace(usual, response=PEOPLE[self.cohort](rng))
