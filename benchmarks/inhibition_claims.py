"""Section 8.1.3 and appendix B of the dissertation beside simulated people: what is printed, and what comes out."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Final

import numpy as np
import pandas as pd
from scipy.stats import fisher_exact, norm

from benchmarks.dissertation.claims import Claim, claims_as_json
from isiw import IMPACT_SPACE, DesignSpace
from isiw.dissertation.profiles import best_fit, normality, profile_fits
from isiw.metrics import f1
from isiw.subjects import RecruitmentResponse, SimulatedSubject, cohort
from isiw.types import FloatArray

SUB_ISIS_MS: Final = np.arange(30.0, 131.0, 5.0)
SUPRA_ISIS_MS: Final = np.concatenate([np.arange(30.0, 61.0), np.arange(65.0, 106.0, 5.0)])
"""Every 5 ms; and every 1 ms from 30 to 60 ms, as the text has it, and every 5 ms behind."""

_PLANS: Final = {
    "Subthreshold": "from 30 to 130 ms every 5 ms",
    "Suprathreshold": "from 30 to 60 ms every 1 ms, and on to 105 ms every 5 ms",
}

TRIALS: Final = 10
"""At each ISI (4.2)."""

KEPT: Final = 0.8
"""Above this F1 the windows of two days are the same."""

PRINTED: Final = {"Subthreshold": (0.9229, 0.0992), "Suprathreshold": (0.9418, 0.0398)}
"""Table 8.1: W and p."""


def royston_p(w: float, n: int) -> float:
    """The p-value of a statistic W of Shapiro and Wilk among n values, from 12 on [Royston1995]."""
    x = math.log(n)
    mean = -1.5861 - 0.31082 * x - 0.083751 * x**2 + 0.0038915 * x**3
    sd = math.exp(-0.4803 - 0.082676 * x + 0.0030302 * x**2)
    return float(norm.sf((math.log(1.0 - w) - mean) / sd))


def number_of_values(w: float, p: float) -> list[int]:
    """How many values were tested, from what is printed of the test."""
    return [n for n in range(12, 200) if abs(royston_p(w, n) - p) < 0.5e-4]


def measured(subject: SimulatedSubject, isis_ms: FloatArray, seed: int) -> tuple[FloatArray, FloatArray]:
    """ISIs and MEPs of a sweep, ten trials an ISI."""
    person, isi_ms = subject.begin(seed), np.repeat(isis_ms, TRIALS)
    return isi_ms, np.array([person.respond(isi, "impact").mep_mv for isi in isi_ms.tolist()])


def at_intensity(subject: SimulatedSubject, pct_rmt: float) -> SimulatedSubject:
    """The same person at another intensity."""
    if not isinstance(subject.response, RecruitmentResponse):
        raise TypeError(subject.response)
    return replace(subject, response=replace(subject.response, intensity_pct_rmt=pct_rmt))


@cache
def sweeps(people: int, seed: int) -> dict[str, list[tuple[FloatArray, FloatArray]]]:
    """A sweep of each person: of `recruitment` below the threshold, of `supra-threshold` above it."""
    plans = {"Subthreshold": ("recruitment", SUB_ISIS_MS), "Suprathreshold": ("supra-threshold", SUPRA_ISIS_MS)}
    return {
        name: [measured(subject, isis_ms, seed + i) for i, subject in enumerate(cohort(group, people, seed))]
        for name, (group, isis_ms) in plans.items()
    }


def choices_of_curves(people: int, seed: int) -> pd.DataFrame:
    """Which curve has the smallest AICc, as a share of the people, and how many profiles pass the test of normality."""
    table = {}
    for name, measurements in sweeps(people, seed).items():
        chosen = pd.Series([best_fit(profile_fits(*measurement)).name for measurement in measurements])
        table[name] = chosen.value_counts(normalize=True)
    names = [*(f"{k} Gaussian{'s' if k > 1 else ''}" for k in range(1, 6)), "smoothing spline"]
    return pd.DataFrame(table).reindex(names).fillna(0.0).rename_axis("curve").reset_index()


def passing(people: int, seed: int) -> dict[str, float]:
    """The share of the profiles whose mean MEPs pass the test of normality."""
    return {
        name: float(np.mean([normality(mep_mv.reshape(-1, TRIALS).mean(1)).normal for _, mep_mv in measurements]))
        for name, measurements in sweeps(people, seed).items()
    }


def all_claims(people: int, seed: int, curves: pd.DataFrame) -> list[dict[str, str]]:
    """What 8.1.3 and appendix B say, beside ours."""
    return claims_as_json(
        [*_sizes(people, seed), *_normality(people, seed), _curves(curves, people), _days(people, seed)]
    )


def _sizes(people: int, seed: int) -> list[Claim]:
    space = DesignSpace(0, 120, reference="impact")
    drawn = cohort("supra-threshold", people, seed)
    peaks_mv = {
        pct: np.array([at_intensity(s, pct).expected_mep_mv(space).max() for s in drawn]) for pct in (90.0, 120.0)
    }
    low, median, high = np.quantile(peaks_mv[120.0] / peaks_mv[90.0], [0.05, 0.5, 0.95])
    deficits_uv = {pct: 1e3 * np.median([_deficit_mv(at_intensity(s, pct), space) for s in drawn]) for pct in peaks_mv}
    tops = {pct: f"{np.median(peak_mv):.2f} mV" for pct, peak_mv in peaks_mv.items()}
    return [
        Claim(
            "Fig. 8.1",
            "MEPs at 120 % RMT are about ten times those at 90 % RMT in the same person.",
            "0–0.3 mV and 0–2.0 mV, about ten times (n = 1)",
            f"largest expected MEP {tops[90.0]} and {tops[120.0]} in the median; ratio {median:.0f}, 90 % of "
            f"{people} simulated people {low:.0f}–{high:.0f}",
            f"factor {median / 10:.1f} in the median",
            "under reading the sizes of the cohort supra-threshold, which were chosen"
            if low <= 10 <= high
            else "not, because the law of the simulated people has other sizes",
        ),
        Claim(
            "Fig. 8.1",
            "Inhibition can be seen above the motor threshold only.",
            "only enhancement at 90 % RMT; inhibition possible at 120 % RMT",
            f"the expected MEP falls by at most {deficits_uv[90.0]:.0f} µV at 90 % RMT in the median person, where the "
            f"EMG floor is about 10 µV, and by {deficits_uv[120.0]:.0f} µV at 120 % RMT",
            "the figure marks no depressed ISIs",
            "under reading: the law of the simulated people has a depressed segment, which the figure only suggests",
        ),
    ]


def _deficit_mv(subject: SimulatedSubject, space: DesignSpace) -> float:
    return float(subject.baseline_mv - subject.expected_mep_mv(space).min())


def _normality(people: int, seed: int) -> list[Claim]:
    share, expected = passing(people, seed), {"Subthreshold": len(SUB_ISIS_MS), "Suprathreshold": len(SUPRA_ISIS_MS)}
    claims = []
    for name, (w, p) in PRINTED.items():
        values = number_of_values(w, p)
        fits = expected[name] in values
        claims.append(
            Claim(
                "Table 8.1",
                f"{name}: W and p of the test of Shapiro and Wilk belong together.",
                f"W {w}, p {p}, number of values not given",
                f"W gives this p with {' or '.join(map(str, values)) or 'no number of'} values; there are "
                f"{expected[name]} ISIs {_PLANS[name]}",
                "none" if fits else "the number of values",
                "under reading: the values tested are the mean MEPs, one for each of these ISIs"
                if fits
                else "not, because no number of ISIs gives it",
            )
        )
    wanted = share["Subthreshold"] > share["Suprathreshold"]
    claims.append(
        Claim(
            "Table 8.1",
            "Profiles are normal below the threshold and not above it.",
            "passes at 90 % RMT, fails at 120 % RMT (n = 1)",
            f"{share['Subthreshold']:.0%} of the simulated profiles pass at 90 % RMT, {share['Suprathreshold']:.0%} at "
            "120 % RMT",
            "the test asks whether amplitudes could be normal, not whether their course by ISI is a Gaussian",
            "reproduced" if wanted else "not, because simulated profiles pass no less often above the threshold",
        )
    )
    return claims


def _curves(curves: pd.DataFrame, people: int) -> Claim:
    share = curves.set_index("curve")
    most = share["Suprathreshold"].idxmax()
    one = share.loc["1 Gaussian"]
    return Claim(
        "Fig. 8.2",
        "One Gaussian is not enough above the threshold.",
        "one to five Gaussians and a smoothing spline are drawn; none is chosen",
        f"by AICc one Gaussian is best in {one['Subthreshold']:.0%} of the simulated profiles at 90 % RMT and in "
        f"{one['Suprathreshold']:.0%} at 120 % RMT, where {most} is best most often "
        f"({share['Suprathreshold'].max():.0%})",
        "ours are sums on a baseline; the figure's fall to 0",
        "under reading: by AICc one Gaussian is best less often above the threshold than below it "
        f"{by_chance(one, people)}"
        if one["Suprathreshold"] < one["Subthreshold"]
        else "not, because one Gaussian is best as often above the threshold as below it",
    )


def by_chance(one: pd.Series, people: int) -> str:
    """Two shares as numbers of people, and whether chance gives such a difference."""
    below, above = (round(people * one[name]) for name in ("Subthreshold", "Suprathreshold"))
    p = float(fisher_exact([[below, people - below], [above, people - above]]).pvalue)
    return f"({below} and {above} of {people} people; {'chance gives as much' if p > 0.05 else f'p = {p:.2g}'})"


def _days(people: int, seed: int) -> Claim:
    days = cohort("another-day", 2 * people, seed)
    windows = [subject.window(IMPACT_SPACE) for subject in days]
    return of_two_days([f1(a, b, IMPACT_SPACE) for a, b in zip(windows[::2], windows[1::2], strict=True)])


def of_two_days(same: list[float]) -> Claim:
    """The claim on the F1 of each person's windows of two days."""
    low, median, high = np.quantile(same, [0.1, 0.5, 0.9])
    return Claim(
        "Fig. B.1",
        "The same person has another window 16 days later.",
        "two profiles of one person with clearly different windows; no numbers",
        f"F1 of the windows of two days {median:.2f} in the median, 80 % of {len(same)} simulated people "
        f"{low:.2f}–{high:.2f}",
        "none can be given",
        "not, because half of the simulated people keep their window"
        if median > KEPT
        else "under reading: the cohort another-day moves windows by a law of ours, since the figure has no numbers",
    )
