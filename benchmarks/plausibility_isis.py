"""Realised ISIs of right rigs and of loops with a mistake, by the rule that asks for a confirmation."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

import isiw
from isiw.signals.plausible import AMONG, FAR_ONES, doubtful_from, far_ms, is_far

Rig = Callable[[Sequence[float], np.random.Generator], float]
"""The realised ISI [ms] of the last trial, by all that were asked for."""

STEP_MS: Final = 10.0
FIRST: Final = 10_000
"""The first seed."""

RIGHT: Final[Mapping[str, Rig]] = {
    "jitter, SD 2 ms": lambda asked, rng: asked[-1] + 2 * rng.standard_normal(),
    "jitter, SD 5 ms": lambda asked, rng: asked[-1] + 5 * rng.standard_normal(),
    "always 8 ms longer": lambda asked, _: asked[-1] + 8,
    "always 8 ms longer, jitter of SD 3 ms": lambda asked, rng: asked[-1] + 8 + 3 * rng.standard_normal(),
    "steps of 10 ms, rounded": lambda asked, _: STEP_MS * round(asked[-1] / STEP_MS),
    "steps of 10 ms, cut off, jitter of SD 2 ms": lambda asked, rng: (
        STEP_MS * (asked[-1] // STEP_MS) + 2 * rng.standard_normal()
    ),
    "jitter of SD 2 ms, 1 % of trials 50 ms late": lambda asked, rng: (
        asked[-1] + 2 * rng.standard_normal() + 50 * (rng.random() < 0.01)
    ),
}

WRONG: Final[Mapping[str, Rig]] = {
    "the first ISI in each trial": lambda asked, _: asked[0],
    "the ISI of the trial before": lambda asked, _: asked[-2] if len(asked) > 1 else asked[-1],
    "half of it": lambda asked, _: asked[-1] / 2,
    "twice as much": lambda asked, _: 2 * asked[-1],
    "counted from the valve, 45 ms more": lambda asked, _: asked[-1] + 45,
}

SPACES: Final = (isiw.DesignSpace(20, 320, reference="impact"), isiw.DesignSpace(0, 60, reference="impact"))


def doubted_after(space: isiw.DesignSpace, strategy: str, rig: Rig, seed: int, trials: int) -> int | None:
    """After how many trials of a session ISIs are in doubt; None if they never are.

    Args:
        space: what is asked from.
        strategy: "even", or "random" for ISIs drawn evenly.
        rig: what is reported.
        seed: of the session.
        trials: how many.
    """
    rng = np.random.default_rng(seed)
    grid, asked, far = space.grid_ms, list[float](), list[bool]()
    order = itertools.cycle(rng.permutation(grid[:: max(1, len(grid) // trials)]))
    for number in range(trials):
        asked.append(float(rng.choice(grid) if strategy == "random" else next(order)))
        isi_ms = rig(asked, rng)
        if not space.admits(isi_ms):  # an error of its own
            continue
        far.append(is_far(isi_ms - asked[-1], space))
        if doubtful_from(far[-AMONG:]) is not None:
            return number + 1
    return None


def isis_report(sessions: int, trials: int, command: str) -> str:
    """The tables as Markdown.

    Args:
        sessions: how many of each rig and space.
        trials: how long each is.
        command: what made them.
    """
    far = [f"{far_ms(space):g} ms in {space.low_ms:g} to {space.high_ms:g} ms" for space in SPACES]
    lines = [
        "# Realised ISIs that are asked about",
        "",
        f"`{command}`",
        "",
        f"{sessions} sessions of {trials} trials for each cell, seeds {FIRST} to {FIRST + sessions - 1};",
        f"half of them ask at random, half in a random order of evenly spaced ISIs. {FAR_ONES} far ones among {AMONG}",
        f"in a row are asked about; far is {', '.join(far)}.",
        "",
    ]
    for title, rigs in (("right rigs", RIGHT), ("loops with a mistake", WRONG)):
        names = [f"asked about, {space.low_ms:g} to {space.high_ms:g} ms | after (median, 90 %)" for space in SPACES]
        lines += [f"| {title} | {' | '.join(names)} |", f"|---{'|---|---' * len(SPACES)}|"]
        lines += [f"| {name} | {' | '.join(_cell(rig, space, sessions, trials) for space in SPACES)} |"
                  for name, rig in rigs.items()]  # fmt: skip
        lines.append("")
    return "\n".join(lines)


def _cell(rig: Rig, space: isiw.DesignSpace, sessions: int, trials: int) -> str:
    after = [
        doubted_after(space, ("even", "random")[seed % 2], rig, seed, trials) for seed in range(FIRST, FIRST + sessions)
    ]
    found = [number for number in after if number is not None]
    when = f"{np.median(found):g}, {np.quantile(found, 0.9):g}" if found else "–"
    return f"{len(found)} of {sessions} | {when}"
