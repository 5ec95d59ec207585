"""The resting motor threshold and the hot spot: how near, after how many pulses, by which method.

    python -m benchmarks.threshold > benchmarks/results/threshold.md

Every person has a resting motor threshold of 30-80 % MSO and the recruitment curve and the noise of a cohort: forearm
(`recruitment`), hand, and two whose noise is outside of what was measured, and of what the Bayesian method believes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.strategy.threshold import IntensityRange, Pulse, ThresholdEstimate, ThresholdSearch, make_threshold_search
from isiw.strategy.threshold.hotspot import BayesHotSpot
from isiw.subjects.thresholds import THRESHOLD_COHORTS, StimulatedPerson, threshold_cohort
from isiw.trials import RESPONSE_MV

SPACE = IntensityRange(20, 100)
MOST_PULSES = 200
ABOVE_THRESHOLD = (1.1, 1.3)
"""Between these the intensity for the hot spot is uniform, as a multiple of the threshold, which nobody knows yet."""


@dataclass(frozen=True)
class Way:
    """A way to the threshold.

    Args:
        name: of its row.
        make: makes the search.
        seen_only: whether it is told only whether there was a response.
    """

    name: str
    make: Callable[[], ThresholdSearch]
    seen_only: bool = False


def made(method: str, **settings: float) -> Callable[[], ThresholdSearch]:
    """What makes a search by a named method."""
    return partial(make_threshold_search, method, SPACE, **settings)


WAYS = (
    Way("bayes, until ± 2 % MSO", made("bayes")),
    Way("bayes, 12 pulses", made("bayes", stop_sd_pct_mso=0.01, max_pulses=12)),
    Way("bayes, until ± 2 % MSO, yes or no only", made("bayes"), seen_only=True),
    Way("maximum likelihood, 12 pulses", made("maximum-likelihood", pulses=12)),
    Way("maximum likelihood, 17 pulses", made("maximum-likelihood")),
    Way("five of ten", made("five-of-ten")),
    Way("more than five of ten [Kim2020]", made("five-of-ten", enough=6)),
)


def sought(way: Way, person: StimulatedPerson, seed: int) -> dict[str, float | None]:
    """One search: pulses, error, and whether the interval has the truth.

    Args:
        way: how.
        person: whose threshold.
        seed: of the noise.
    """
    search, responder = way.make(), person.begin(seed)
    while not search.decision().stop and len(search.pulses) < MOST_PULSES:
        intensity = search.ask()
        mep_mv = responder.respond(intensity)
        if way.seen_only:
            search.tell(intensity, response=mep_mv > RESPONSE_MV)
        else:
            search.tell(intensity, mep_mv)
    found = search.estimate()
    error = None if found.threshold_pct_mso is None else found.threshold_pct_mso - person.rmt_pct_mso
    low, high = found.low_pct_mso, found.high_pct_mso
    covered = None if low is None or high is None else float(low <= person.rmt_pct_mso <= high)
    return {"pulses": len(search.pulses), "error": error, "covered": covered}


def threshold_row(cohort: str, way: Way, n: int, seed: int) -> dict[str, object]:
    """A row of the table: one way on the people of a cohort.

    Args:
        cohort: one of `isiw.subjects.thresholds.THRESHOLD_COHORTS`.
        way: how.
        n: how many people.
        seed: of the people and their noise.
    """
    rows = pd.DataFrame(
        sought(way, person, seed + i) for i, person in enumerate(threshold_cohort(cohort, n, seed))
    ).astype(float)
    error = rows["error"].abs()
    return {
        "people": cohort,
        "method": way.name,
        "pulses": f"{rows['pulses'].mean():.1f}",
        "most": f"{rows['pulses'].max():.0f}",
        "mean error": f"{error.mean():.2f} ± {error.sem():.2f}",
        "95th percentile": f"{error.quantile(0.95):.2f}",
        "bias": f"{rows['error'].mean():+.2f}",
        "90 % interval contains it": "–" if rows["covered"].isna().all() else f"{rows['covered'].mean():.2f}",
        "no number": int(error.isna().sum()),
    }


@dataclass(frozen=True)
class WalkedHotSpot:
    """The classical way: `repeats` pulses at every place of a grid; the largest mean MEP is the hot spot."""

    repeats: int
    step_mm: float = 10.0

    @property
    def pulses(self) -> int:
        """Number of pulses that it takes."""
        return self.repeats * len(BayesHotSpot(step_mm=self.step_mm).places_mm)

    def place_mm(self, pulses: Sequence[Pulse]) -> tuple[float, float]:
        """The next place of the coil [mm]."""
        places = BayesHotSpot(step_mm=self.step_mm).places_mm
        x_mm, y_mm = places[len(pulses) // self.repeats % len(places)].tolist()
        return x_mm, y_mm

    def estimate(self, pulses: Sequence[Pulse], _: IntensityRange) -> ThresholdEstimate:
        """The place with the largest mean MEP, if any pulse evoked one."""
        if not any(pulse.responded for pulse in pulses):
            return ThresholdEstimate(None, reason="No pulse evoked an MEP.")
        by_place: dict[tuple[float, float], list[float]] = {}
        for pulse in pulses:
            by_place.setdefault(pulse.place_mm or (0.0, 0.0), []).append(pulse.mep_mv or 0.0)
        best = max(by_place, key=lambda place: float(np.mean(by_place[place])))
        return ThresholdEstimate(None, hot_spot_mm=best)


def spot_errors(method: BayesHotSpot | WalkedHotSpot, person: StimulatedPerson, pulses: int, seed: int) -> float:
    """The distance of the hot spot that was found from the true one [mm]; NaN where no pulse was answered.

    Args:
        method: how it is sought.
        person: whose.
        pulses: how many.
        seed: of the intensity and the noise.
    """
    intensity = float(min(100.0, person.rmt_pct_mso * np.random.default_rng(seed).uniform(*ABOVE_THRESHOLD)))
    responder, told = person.begin(seed), list[Pulse]()
    for _ in range(pulses):
        place_mm = method.place_mm(told)
        told.append(Pulse(intensity, responder.respond(intensity, *place_mm), place_mm=place_mm))
    found_mm = method.estimate(told, SPACE).hot_spot_mm or (float("nan"), float("nan"))
    return float(np.hypot(found_mm[0] - person.hot_spot.x_mm, found_mm[1] - person.hot_spot.y_mm))


def spot_rows(cohort: str, n: int, seed: int) -> Iterable[dict[str, object]]:
    """Rows of the table about the hot spot.

    Args:
        cohort: one of `isiw.subjects.thresholds.THRESHOLD_COHORTS`.
        n: how many people.
        seed: of the people and their noise.
    """
    walks = [WalkedHotSpot(repeats=repeats) for repeats in (1, 3, 10)]
    ways = [("bayes", BayesHotSpot(), pulses) for pulses in (10, 20)]
    for name, method, pulses in [*ways, *(("walk of the grid", walk, walk.pulses) for walk in walks)]:
        errors = pd.Series(
            [
                spot_errors(method, person, pulses, seed + i)
                for i, person in enumerate(threshold_cohort(cohort, n, seed))
            ]
        )
        yield {
            "people": cohort,
            "method": name,
            "pulses": pulses,
            "mean distance [mm]": f"{errors.mean():.1f} ± {errors.sem():.1f}",
            "95th percentile": f"{errors.quantile(0.95):.1f}",
            "no answer at all": int(errors.isna().sum()),
        }


def main(
    n: Annotated[int, typer.Option(help="People of each cohort.")] = 200,
    spots: Annotated[int, typer.Option(help="People of each cohort whose hot spot is sought.")] = 40,
    seed: Annotated[int, typer.Option(help="Of the people and their noise.")] = 10_000,
) -> None:
    """Print both tables."""
    rows = [threshold_row(cohort, way, n, seed) for cohort in THRESHOLD_COHORTS for way in WAYS]
    found = [row for cohort in ("recruitment", "hand") for row in spot_rows(cohort, spots, seed)]
    print(f"""# The resting motor threshold and the hot spot

Command: `{command_of("threshold")}`, seed {seed}, {made_with("numpy", "scipy")}.

{n} people of each cohort, range {SPACE}. Errors in % MSO, mean ± standard error. "± 2 % MSO" is the posterior's SD.

{pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True)}

## The hot spot

{spots} people of each cohort, one intensity of 110-130 % of the threshold, a square of ± 25 mm; the hot spot lies
within ± 20 mm. The walk has 25 places, 10 mm apart. The coil's effect falls off as a Gaussian, as the Bayesian method
believes.

{pd.DataFrame(found).to_markdown(index=False, disable_numparse=True)}""")


if __name__ == "__main__":
    understood("threshold", prints=True)
    typer.run(main)
