"""What is in the log of an interval production task: its header, and one record a produced interval.

    /production_header     who, when, and which blocks; once
    /production            one interval that a person has produced
    /event                 a resumption, or presses that do not count

The file is written as a session's is. These two topics have no frozen channel number: the file announces them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from isiw.checks import check_choice, check_numbers, check_wholes

PRODUCTION_VERSION: Final = 1
"""Grows only where an older isiw would misread the log."""

MODES: Final = {
    1: "score bar",
    2: "light on or off",
    3: "target and produced time",
    4: "target and absolute error",
}
"""What a person sees after each trial, by mode [Kim2020, Table 6.1]."""

LONGEST_MS: Final = 5000.0
"""Longer than a person who attends takes between the two presses [ms]."""

MOST_BLOCK_TRIALS: Final = 10_000


@dataclass(frozen=True)
class Block:
    """Trials in a row with one target and one kind of feedback.

    Args:
        mode: the kind of feedback, a key of `MODES`.
        target_ms: the interval to produce [ms].
        scale_pct: score at the target [%], A of equation 6.1.
        trials: how many.

    Raises:
        InvalidValueError: a mode that does not exist, or a number out of range.
    """

    mode: int
    target_ms: float
    scale_pct: float = 100.0
    trials: int = 200

    def __post_init__(self) -> None:
        check_choice(self, "mode", MODES)
        check_numbers(self, "target_ms", above=0.0, below=LONGEST_MS)
        check_numbers(self, "scale_pct", least=1.0, most=100.0)
        check_wholes(self, "trials", least=1, most=MOST_BLOCK_TRIALS)


class _Record(BaseModel):
    """A frozen record; keys that a newer version added are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class ProductionHeader(_Record):
    """What a task is; the seed draws the lights of mode 2."""

    kind: Literal["production"] = "production"
    schema_version: int = PRODUCTION_VERSION
    isiw_version: str
    created: str
    subject: str = ""
    seed: int
    blocks: tuple[Block, ...] = Field(min_length=1)


class Production(_Record):
    """One interval that was produced, and what the person saw of it.

    `trial` counts through all blocks, from 0; `light` is None except in mode 2.
    """

    trial: int = Field(ge=0)
    block: int = Field(ge=0)
    produced_ms: float = Field(gt=0.0, le=LONGEST_MS)
    score_pct: float
    light: bool | None = None
