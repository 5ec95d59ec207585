"""A prior of responses fitted to recorded single pulses: shares of the kinds of noise, and where hands' curves lie.

    python -m benchmarks.response_prior --out benchmarks/results/response_prior

Six numbers are free beside the default's prior: four shares (the fifth follows), and median and SD of where half of the
largest MEP of a hand muscle lies. They have the largest likelihood of all banks, with today's shares counted as much as
three of them. A bank is one recruitment curve, with `--banks coils` both of a coil. What is said of a person comes from
a fit without them; errors are by bootstrap over persons. The default's prior is not changed. The recordings lie
elsewhere: `--data`, or the variable ISIW_SHARED_DATA, names their folder.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Final, cast

import numpy as np
import pandas as pd
import typer
from scipy.special import logsumexp

from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.recorded_people import Bank, Banks, banks, recordings
from benchmarks.response_evidence import Draws, all_drawn, mixtures
from benchmarks.response_laws import NAMES
from benchmarks.tables import write_tables
from isiw.models.particles.laws import HAND, NoiseShares
from isiw.models.particles.prior import Prior
from isiw.models.shared.scales import Scale
from isiw.types import FloatArray, IntArray

MEDIANS: Final = np.arange(-33.0, -14.9, 1.0)
SDS: Final = np.arange(2.0, 10.1, 1.0)
"""Where `rest_pct` of the hand is looked for [% RMT]: every median with every SD."""
GRID: Final = np.array([(median, sd) for median in MEDIANS for sd in SDS])
TODAY: Final = (HAND.rest_pct.median, HAND.rest_pct.sd)

AS_BANKS: Final = 3.0
"""Today's shares count as so many banks, a person's coils, so that kinds without support keep a small share."""
ITERATIONS = 60


@dataclass(frozen=True)
class Fit:
    """The six numbers.

    Args:
        shares: of the kinds of noise, in the order of `NoiseShares`.
        rest_pct: median and SD of the hand's input at 90 % RMT, from where half of the largest MEP lies [% RMT].
    """

    shares: tuple[float, ...]
    rest_pct: tuple[float, float]

    def prior(self) -> Prior:
        """The default's prior with these numbers."""
        return _with_hand(replace(Prior(), noise=NoiseShares(*self.shares)), self.rest_pct)


def _with_hand(prior: Prior, rest_pct: Sequence[float]) -> Prior:
    muscles = (replace(m, rest_pct=Scale(*rest_pct)) if m.name == HAND.name else m for m in prior.muscles)
    return replace(prior, muscles=tuple(muscles))


@dataclass(frozen=True, eq=False)
class Evidence:
    """Log density of each bank under each kind of noise, at each point of `GRID`.

    Args:
        by_kind: shape (grid, banks, kinds).
        persons: whose bank it is, shape (banks,).
    """

    by_kind: FloatArray
    persons: IntArray

    @classmethod
    def of(cls, drawn: Sequence[Mapping[str, Draws]], persons: Iterable[int], prior: Prior) -> Evidence:
        """From draws; only recruitment curves depend on the grid."""
        usual = mixtures(prior)
        fixed = np.array([[draws[kind].log_evidence(usual[kind]) for kind in NAMES] for draws in drawn])
        by_kind, recruitment = np.tile(fixed, (len(GRID), 1, 1)), list(NAMES).index("recruitment")
        for point, rest_pct in enumerate(GRID.tolist()):
            law = mixtures(_with_hand(prior, rest_pct))["recruitment"]
            by_kind[point, :, recruitment] = [draws["recruitment"].log_evidence(law) for draws in drawn]
        return cls(by_kind, np.array(list(persons), dtype=np.int64))

    def without(self, person: int) -> FloatArray:
        """That of all other persons."""
        return self.by_kind[:, self.persons != person]

    def resampled(self, rng: np.random.Generator) -> FloatArray:
        """That of as many persons, drawn with replacement."""
        known = np.unique(self.persons)
        drawn = rng.choice(known, len(known))
        return np.concatenate([self.by_kind[:, self.persons == person] for person in drawn], axis=1)

    def log_density(self, fit: Fit) -> FloatArray:
        """Log density of each bank under a prior, shape (banks,)."""
        at = int(np.abs(GRID - fit.rest_pct).sum(1).argmin())
        return np.asarray(logsumexp(self.by_kind[at] + np.log(fit.shares), axis=-1))


def fitted(by_kind: FloatArray) -> Fit:
    """The six numbers of the largest likelihood, today's shares counted as `AS_BANKS`.

    Args:
        by_kind: log density of each bank, shape (grid, banks, kinds).
    """
    today = np.array(astuple(NoiseShares()))
    shares = np.tile(today, (len(by_kind), 1))
    for _ in range(ITERATIONS):
        joint = by_kind + np.log(shares)[:, None]
        of_kind = np.exp(joint - logsumexp(joint, axis=-1, keepdims=True))
        shares = (of_kind.sum(1) + AS_BANKS * today) / (by_kind.shape[1] + AS_BANKS)
    score = logsumexp(by_kind + np.log(shares)[:, None], axis=-1).sum(1) + AS_BANKS * np.log(shares) @ today
    best = int(score.argmax())
    return Fit(tuple(shares[best].tolist()), tuple(GRID[best].tolist()))


def numbers(fit: Fit, draws: Sequence[Fit]) -> pd.DataFrame:
    """The numbers beside today's, with SD and 90 % interval over resampled persons."""
    names = [f"share: {field.name}" for field in fields(NoiseShares)] + ["hand: rest, median", "hand: rest, SD"]
    spread = np.array([[*each.shares, *each.rest_pct] for each in draws])
    low, high = np.quantile(spread, [0.05, 0.95], axis=0)
    columns = {
        "number": names,
        "today": [*astuple(NoiseShares()), *TODAY],
        "fitted": [*fit.shares, *fit.rest_pct],
        "SD": spread.std(0),
        "5 %": low,
        "95 %": high,
    }
    return pd.DataFrame(columns)


def by_person(evidence: Evidence, folds: Mapping[int, Fit]) -> pd.DataFrame:
    """Log density of each person's pulses under today's prior, and under the fit to all others; with the sum."""
    today = Fit(astuple(NoiseShares()), TODAY)
    rows = []
    for person, fit in folds.items():
        own = evidence.persons == person
        shares_alone = replace(fit, rest_pct=TODAY)
        priors = {"today": today, "fitted without them": fit, "the shares alone": shares_alone}
        found = {name: evidence.log_density(each)[own].sum() for name, each in priors.items()}
        rows.append({"person": f"{person}", "banks": own.sum(), **found})
    table = pd.DataFrame(rows)
    table["fitted less today"] = table["fitted without them"] - table["today"]
    sums = {name: table[name].sum() for name in table.columns[1:]}
    return pd.concat([table, pd.DataFrame([{"person": "all", **sums}])], ignore_index=True)


def by_noise(evidence: Evidence) -> pd.DataFrame:
    """How well each kind does on all banks alone, and of how many it is the best, with today's laws."""
    today = evidence.by_kind[int(np.abs(GRID - TODAY).sum(1).argmin())]
    best = np.bincount(today.argmax(1), minlength=len(NAMES))
    return pd.DataFrame({"kind of noise": list(NAMES), "log density": today.sum(0), "best of so many banks": best})


def folds_of(evidence: Evidence) -> dict[int, Fit]:
    """The fit without each person."""
    return {int(person): fitted(evidence.without(person)) for person in np.unique(evidence.persons)}


def read_folds(result: Mapping[str, Any]) -> dict[int, Fit]:
    """The fits without each person, from the JSON of a result."""
    return {int(p): Fit(tuple(fit["shares"]), tuple(fit["rest_pct"])) for p, fit in result["folds"].items()}


def evidence_of(all_banks: Sequence[Bank], seed: int) -> Evidence:
    """The evidence of recorded banks, of a hand muscle each.

    Args:
        all_banks: what was recorded.
        seed: of the draws.
    """
    hand = Prior(muscle=HAND.name)
    return Evidence.of(all_drawn(all_banks, hand, seed), [bank.person for bank in all_banks], hand)


def main(
    seed: Annotated[int, typer.Option(help="Seed of draws and bootstrap.")] = 1,
    bootstraps: Annotated[int, typer.Option(help="How often persons are resampled.")] = 200,
    most: Annotated[int | None, typer.Option(help="Use so many banks only, for a quick look.")] = None,
    kind: Annotated[str, typer.Option("--banks", help="What a bank is: curves or coils.")] = "curves",
    data: Annotated[Path | None, typer.Option(help="Folder of the recordings.")] = None,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("response_prior"),
) -> None:
    """Fit the prior, and compare it with today's on people it was not fitted to."""
    data = data or recordings()
    if not data.is_dir():
        print(f"Skipped: the recordings are not at hand, {data} is no folder. Name it with --data.")
        return
    evidence = evidence_of(banks(data, cast("Banks", kind))[:most], seed)
    fit, folds = fitted(evidence.by_kind), folds_of(evidence)
    rng = np.random.default_rng(seed)
    draws = [fitted(evidence.resampled(rng)) for _ in range(bootstraps)]
    tables = {
        "What is fitted": numbers(fit, draws),
        "Log density of people left out": by_person(evidence, folds),
        "Each kind alone": by_noise(evidence),
    }
    source = "ShayOfir/MEP_IOcurve (commit 1e1d491, BSD-3-Clause), pulses from 90 to 120 % RMT"
    facts = facts_of("response_prior", "numpy", "scipy", seed=seed, bootstraps=bootstraps, source=source)
    as_read = {person: {"shares": each.shares, "rest_pct": each.rest_pct} for person, each in folds.items()}
    write_tables(tables, facts, out, folds=as_read)
    print(out.with_suffix(".md").read_text())


if __name__ == "__main__":
    understood("response_prior")
    typer.run(main)
