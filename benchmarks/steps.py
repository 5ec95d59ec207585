"""How soon steps of the amplitudes are named, beside a detector that knows the person: `python -m benchmarks.steps`.

`run` keeps two tables a cohort: the rows of `before_and_now run` on the same people, and what was named after each
trial. `report` compares that with a CUSUM that knows the person's law, the size and the direction of the step, and
whose threshold no more than 3 % of the sessions without a step reach. `bound` says how often the trials of a session
could name its step to anyone who knows its trial, but neither the person nor the size. Reported people come from seed
200,000 on. `run --knowing` runs a prior that knows what the people of a cohort have in common, `--first electrical`
one to which an electrical pulse was stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
import pandas as pd
import torch
import typer

from benchmarks.before_and_now import LATER, MARKS, honesty, study_of
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.change import LIKELY_CHANGE
from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.models.particles.changes import ChangePrior
from isiw.models.particles.laws import FOREARM, HAND, Floor, Intensity, NoiseShares
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior, Width
from isiw.models.protocol import Observation
from isiw.models.shared.scales import Scale
from isiw.models.shared.start import Span
from isiw.studies import summary
from isiw.studies.sessions import SimulatedSession, _Batch, examine
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import Response, SimulatedSubject
from isiw.text.stimuli import STIMULI
from isiw.types import FloatArray

WITHIN: Final = 15
"""A step is named in time within so many trials."""

LEAST_FACTOR: Final = 3.0
"""Smaller steps do not count."""

FALSE_ALARMS: Final = 0.03
DRAWS: Final = 2000
BANDWIDTH: Final = 0.1
"""Of the density of a log MEP, natural log."""

app = typer.Typer(help=__doc__)


class Noting(_Batch):
    """People side by side, and what is named after each trial of each of them.

    Args:
        sessions: the sessions.
    """

    def __init__(self, sessions: Sequence[SimulatedSession]) -> None:
        super().__init__(sessions)
        self.sessions, self.named, self.told = sessions, list[dict[str, object]](), 0

    def tell(self, responses: Sequence[Response]) -> None:
        """Learn from one trial of each person."""
        super().tell(responses)
        self.told += 1
        for number, (session, told) in enumerate(zip(self.sessions, responses, strict=True)):
            estimate = self.estimate(number)
            change = estimate.change
            found = {} if change is None else {"kind": change.kind, "share": change.probability}
            who = {"cohort": session.cohort, "person": session.person, "seed": session.seed, "trial": self.told}
            who |= {"isi_ms": told.isi_ms, "isi_sd_ms": told.isi_sd_ms, "mep_mv": told.mep_mv}
            who |= {"expected_f1": estimate.expected_f1}
            self.named.append(who | {"kind": "", "share": 0.0} | found)


@app.command()
def run(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = "step",
    people: Annotated[int, typer.Option(help="People a cohort.")] = 200,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 220_000,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 60,
    *,
    stated: Annotated[bool, typer.Option(help="The intensity is stated.")] = False,
    knowing: Annotated[bool, typer.Option(help="With a prior that is the cohort's own law.")] = False,
    first: Annotated[
        Literal["", "unstated", "tap", "electrical"], typer.Option(help="What comes first; ISIs then count from it.")
    ] = "",
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("steps"),
) -> None:
    """Run the default, 25 people at a time; a cohort's tables grow with each 25, and it goes on behind them."""
    torch.set_num_threads(1)
    (out / "named").mkdir(parents=True, exist_ok=True)
    marks = tuple(sorted({*(m for m in (*MARKS, *LATER) if m <= trials), trials}))
    space = IMPACT_SPACE if first else VALVE_SPACE
    conditioning = {"conditioning": first} if first in STIMULI else None
    for name in cohorts.split(","):
        files = out / f"{name}.parquet", out / "named" / f"{name}.parquet"
        tables = [[pd.read_parquet(file)] if file.exists() else [] for file in files]
        done = set() if not tables[0] else set(tables[0][0]["person"])
        study = study_of(name, people, seed, marks, "noted", settings=law_of(name) if knowing else conditioning)
        study = replace(study, intensity="stated" if stated else "unstated", space=space)
        for unit in study.units():
            if {session.person for session in unit.sessions} <= done:
                continue
            crowd = Noting(unit.sessions)
            tables[0].append(examine(unit.sessions, crowd))
            tables[1].append(pd.DataFrame(crowd.named))
            for file, rows in zip(files, tables, strict=True):
                pd.concat(rows).to_parquet(file)


def law_of(cohort: str) -> dict[str, Any]:
    """Settings of a prior that knows the muscle, how many have a window, and what changes, as the cohort has it.

    Sizes of changes are normal there, about as large as the cohort's; so are the logs of the widths of narrow windows.
    """
    never = 1e-6
    still = ChangePrior(level=never, intensity=never, enhancement=never, scale=never)
    at_90, above = (Intensity(1.0, Scale(90.0, 0.5)),), (Intensity(1.0, Scale(105.0, 3.0)),)
    muscle, changes, intensities = {
        "above-threshold": (FOREARM, still, above),
        "narrow-unstated": (FOREARM, still, at_90),
        "hand-flat": (HAND, still, tuple(Intensity(1 / 3, Scale(pct, 0.5)) for pct in (90.0, 100.0, 110.0))),
        "retuned": (FOREARM, replace(still, intensity=0.999, trial=Scale(16.0, 0.5), size_sd=1.15), at_90),
        "step": (FOREARM, replace(still, level=0.999, trial=Scale(15.0, 0.6), size_sd=1.45), at_90),
    }[cohort]
    usual = Prior().as_usual(never)
    profile = replace(usual.profile, p_window=0.5, start=replace(usual.profile.start, p_anywhere=0.0))
    if cohort == "narrow-unstated":
        start = replace(profile.start, spans=(Span(1.0, 5.0, 90.0),))
        profile = replace(profile, p_window=1.0 - never, start=start, widths=(Width(1.0, Scale(26.0, 0.27)),))
    prior = replace(
        usual,
        profile=profile,
        noise=NoiseShares(0.0, 0.0, 1.0, 0.0, 0.0),
        muscles=(replace(muscle, share=1.0),),
        intensities=intensities,
        floors=(Floor(1.0, Scale(0.010, 0.25), Scale(0.18, 0.2)),),
        changes=changes,
    )
    return {"prior": prior, "unusual_kept": 1.0}


def log_ratios(
    subject: SimulatedSubject, isi_ms: FloatArray, mep_mv: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Log of the density of each MEP after the person's step over that without it, shape (r, n) for MEPs (r, n)."""
    response, change = subject.response, subject.change
    if not isinstance(response, RecruitmentResponse) or change is None:
        raise TypeError(response, change)
    found = np.empty(mep_mv.shape)
    for trial, isi in enumerate(isi_ms):
        z, output, floor = rng.standard_normal((3, DRAWS))
        level = float(subject.facilitation(np.asarray(isi), "valve"))
        evoked = response.evoked_mv(level, z) * np.exp(response.sigma_y * output)
        floor_mv = response.floor.median_mv * np.exp(response.floor.log_sd * floor)
        x = np.log(mep_mv[:, trial, None] / subject.scale)
        density = [
            np.exp(-0.5 * ((x - np.log(floor_mv + factor * evoked)) / BANDWIDTH) ** 2).mean(-1) + 1e-4
            for factor in (1.0, np.exp(change.log_gain))
        ]
        found[:, trial] = np.log(density[1] / density[0])
    return found


def cusum(ratios: FloatArray) -> FloatArray:
    """The largest sum of the last log ratios, or 0, after each trial, same shape."""
    sums = np.cumsum(ratios, axis=-1)
    lowest = np.minimum.accumulate(np.concatenate([np.zeros_like(sums[..., :1]), sums], axis=-1), axis=-1)[..., :-1]
    return np.maximum(sums - lowest, 0.0)


def without_step(subject: SimulatedSubject, isi_ms: FloatArray, sessions: int, seed: int) -> FloatArray:
    """MEPs of sessions at the same ISIs in which nothing changes [mV], shape (r, n)."""
    still = replace(subject, change=None)
    responders = [still.begin(1_000_000 * (1 + number) + seed) for number in range(sessions)]
    return np.array([[responder.respond(float(isi), "valve").mep_mv for isi in isi_ms] for responder in responders])


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="Folder of the tables.")],
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = Path("steps"),
    sessions: Annotated[int, typer.Option(help="Sessions without a step, of each person, for the threshold.")] = 10,
) -> None:
    """Say how many steps are named in time, and how many that are none."""
    named = pd.concat(
        [pd.read_parquet(file) for file in sorted((folder / "named").glob("*.parquet"))], ignore_index=True
    )
    named.loc[named["share"] < LIKELY_CHANGE, "kind"] = ""  # tables of versions that named changes earlier
    lines = [f"- command: `{command_of('steps')}`, after `run`", f"- {made_with('torch', 'scipy')}"]
    lines += ["", _honest(folder).to_markdown(index=False, floatfmt=".3f")]
    lines += ["", _at_stopping(folder, named).to_markdown(index=False, floatfmt=".3f")]
    stepped = named[named["cohort"] == "step"]
    if len(stepped):
        lines += ["", _in_time(stepped, sessions).to_markdown(index=False, floatfmt=".3f")]
    others = named[~named["cohort"].isin(("step", "retuned", "ramp", "fading", "moving"))]
    if len(others):
        lines += ["", _without(others).to_markdown(index=False, floatfmt=".3f")]
    out.with_suffix(".md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    print("\n".join(lines))


def _honest(folder: Path) -> pd.DataFrame:
    """What `before_and_now honest` says of one version, with standard errors."""
    tables = []
    for file in sorted(folder.glob("*.parquet")):
        table = honesty(file, file).set_index(["cohort", "trial"])
        table = table[["people", *(column for column in table if column.endswith("_now"))]]
        errors = pd.read_parquet(file).groupby(["cohort", "trial"])["f1"].sem()
        table = table.rename(columns=lambda column: column.removesuffix("_now"))
        table.insert(2, "f1_se", errors)
        told_share = knowing_the_share(pd.read_parquet(file)).groupby(["cohort", "trial"]).mean()
        table.insert(4, "f1_with_share", told_share["f1"])
        table.insert(5, "expected_with_share", told_share["expected"])
        for name in ("false_window", "false_sure"):
            table.insert(table.columns.get_loc(name) + 1, f"{name}_with_share", told_share[name])
        wrong = table["sure_and_wrong"]
        table.insert(
            table.columns.get_loc("sure_and_wrong") + 1,
            "sure_and_wrong_se",
            np.sqrt(wrong * (1.0 - wrong) / table["people"]),
        )
        tables.append(table.reset_index())
    return pd.concat(tables)


def knowing_the_share(rows: pd.DataFrame) -> pd.DataFrame:
    """What there would be if the prior of a window were the share of people with one; NaN if all or none have one.

    F1 and expected F1, and of people without a window those with a best guess at one, and with a probability of .9.

    Args:
        rows: of one cohort.
    """
    share, there = rows["true_window"].mean(), rows["true_window"].astype(bool)
    found, names = rows[["cohort", "trial"]], ("f1", "expected", "false_window", "false_sure")
    if share in {0.0, 1.0}:
        return found.assign(**dict.fromkeys(names, np.nan))
    before = ProfilePrior().p_window
    odds = rows["probability"] / (1.0 - rows["probability"]) * (share / (1.0 - share)) * ((1.0 - before) / before)
    probability = 1.0 - 1.0 / (1.0 + odds)
    of_window = rows["expected_f1"] / rows["probability"] * probability  # the window stays as it is
    keeps = rows["reported_window"].astype(bool) & (probability >= 0.5) & (of_window >= 1.0 - probability)
    none = rows["f1"].where(~rows["reported_window"].astype(bool), (~there).astype(float))
    return found.assign(
        f1=rows["f1"].where(keeps, none),
        expected=of_window.where(keeps, 1.0 - probability),
        false_window=keeps.astype(float).mask(there),
        false_sure=(probability >= 0.9).astype(float).mask(there),
    )


def _at_stopping(folder: Path, named: pd.DataFrame) -> pd.DataFrame:
    """Expected and actual F1 where the stopping rule ends the sessions, and how many are sure and wrong there."""
    rows, who = pd.concat([pd.read_parquet(file) for file in sorted(folder.glob("*.parquet"))]), ["cohort", "person"]
    ends = rows.sort_values("trial").groupby(who).tail(1).set_index(who)
    trials = ends["stop_trial"].fillna(ends["trial"]).rename("trial")
    expected = named.set_index([*who, "trial"])["expected_f1"]
    f1, expected_f1 = (
        ends["stop_f1"].fillna(ends["f1"]),
        expected.reindex(pd.MultiIndex.from_frame(trials.reset_index())),
    )
    table = pd.DataFrame({"trials": trials, "f1": f1, "expected": expected_f1.to_numpy()})
    table["sure and wrong"] = summary.sure_and_wrong(table["expected"], table["f1"])
    groups = table.groupby("cohort")
    return groups.mean().assign(se=groups["sure and wrong"].sem(), people=groups.size()).reset_index()


def _in_time(stepped: pd.DataFrame, sessions: int) -> pd.DataFrame:
    """Of steps of at least `LEAST_FACTOR`: shares named within `WITHIN` trials, and by the detector."""
    rows, still = [], []
    for (seed, person), session in stepped.groupby(["seed", "person"]):
        subject = SimulatedSession("default", "step", int(person), int(seed), 60, (60,)).subject()
        change = subject.change
        if change is None or abs(change.log_gain) < np.log(LEAST_FACTOR):
            continue
        isi_ms, rng = session["isi_ms"].to_numpy(float), np.random.default_rng([int(seed), int(person)])
        usual = without_step(subject, isi_ms, sessions, int(seed + person))
        score = cusum(log_ratios(subject, isi_ms, np.vstack([session["mep_mv"].to_numpy(float), usual]), rng))
        still.append(score[1:].max(-1))
        after = (session["trial"] >= change.first) & (session["trial"] < change.first + WITHIN)
        if not after.any():
            continue
        first = session["trial"] < change.first
        rows.append(
            {
                "up": change.log_gain > 0,
                "window": person % 2 == 0,
                "score": score[0, after].max(),
                "named": bool((session["kind"][after] != "").any()),
                "sure": bool((session["share"][after] >= 0.9).any()),
                "too soon": bool((session["kind"][first] != "").any()),
            }
        )
    if not rows:
        return pd.DataFrame({"steps": [], "n": []})
    table = pd.DataFrame(rows)
    threshold = float(np.quantile(np.concatenate(still), 1.0 - FALSE_ALARMS))
    table["detector"] = table.pop("score") >= threshold
    table["named of detected"] = table["named"].where(table["detector"])
    groups = [("all", table)]
    for column, names in (("up", ("down", "up")), ("window", ("without a window", "with a window"))):
        groups += [(names[int(value)], part) for value, part in table.groupby(column)]
    columns = ["detector", "named", "sure", "named of detected", "too soon"]
    return pd.DataFrame(
        [{"steps": name, "n": len(part)} | dict(part[columns].astype(float).mean()) for name, part in groups]
    )


@app.command()
def bound(
    folder: Annotated[Path, typer.Argument(help="Folder of the tables.")],
    people: Annotated[int, typer.Option(help="So many of the people with a step.")] = 40,
    particles: Annotated[int, typer.Option(help="Particles of each of the two posteriors.")] = 3000,
    sweeps: Annotated[int, typer.Option(help="Sweeps of moves after each trial.")] = 6,
) -> None:
    """Compare the evidence of a step of unknown size at the right trial with that of none, after `WITHIN` trials."""
    torch.set_num_threads(1)
    named, factors = pd.read_parquet(folder / "named" / "step.parquet"), list[float]()
    for (seed, person), session in named.groupby(["seed", "person"]):
        simulated = SimulatedSession("default", "step", int(person), int(seed), 60, (60,)).as_the_rig_states()
        change = simulated.subject().change
        if change is None or abs(change.log_gain) < np.log(LEAST_FACTOR) or len(factors) == people:
            continue
        trials = session[session["trial"] < change.first + WITHIN]
        factors.append(log_factor(simulated, trials, change.first - 1, particles, sweeps))
        print(f"person {person}: × {np.exp(change.log_gain):.2f} at trial {change.first}: ln BF {factors[-1]:+.2f}")
    print(
        f"{command_of('steps')}; {made_with('torch', 'scipy')}; seed {named['seed'].iloc[0]:,}, {len(factors)} people"
    )
    for prior in (0.1, 0.2, 0.5):
        share = np.mean(np.array(factors) + np.log(prior / (1.0 - prior)) >= 0)
        print(f"expected at that trial with probability {prior:g}, a step is likelier than none for {share:.2f}")


def log_factor(session: SimulatedSession, trials: pd.DataFrame, after: int, particles: int, sweeps: int) -> float:
    """Log Bayes factor of a step of unknown size after so many trials, against no change at all."""
    model = session.player().model
    still = replace(model.prior.changes, level=1e-6, intensity=1e-6, enhancement=1e-6, scale=1e-6)
    evidence = []
    for changes in (still, replace(still, level=0.999, noted=(after,), noted_share=0.999)):
        moves = replace(model.moves, sweeps=sweeps, max_trial_sweeps=120 * sweeps)
        one = replace(model, particles=particles, moves=moves, prior=replace(model.prior, changes=changes))
        posterior = one.begin(session.space, session.seed + session.person)
        for isi_ms, mep_mv in zip(trials["isi_ms"], trials["mep_mv"], strict=True):
            posterior = one.update(posterior, Observation.of([isi_ms], [mep_mv]))
        evidence.append(float(posterior.swarm.evidence[0]))
    return evidence[1] - evidence[0]


def _without(named: pd.DataFrame) -> pd.DataFrame:
    """In how many sessions without a step of the amplitudes one is named after any trial."""
    steps = named.assign(
        named=named["kind"].isin(("amplitudes", "intensity")),
        sure=named["kind"].isin(("amplitudes", "intensity")) & (named["share"] >= 0.9),
        enhancement=named["kind"] == "enhancement",
    )
    columns = ["named", "sure", "enhancement"]
    any_trial = steps.groupby(["cohort", "seed", "person"])[columns].any().groupby("cohort")
    last = steps[steps["trial"] == steps["trial"].max()].groupby("cohort")[columns].mean().add_suffix(" at the end")
    return any_trial.mean().join(last).assign(n=any_trial.size()).reset_index()


if __name__ == "__main__":
    understood("steps")
    app()
