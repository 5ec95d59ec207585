"""Plain arrays that the kernels work on: one record a particle, and one a trial.

A particle's record holds what its latents mean (`Person`); a trial's holds what was told of it, and what else bears on
its amplitude, neutral where nobody knows better.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from isiw.compiled import LANES, exp, exp2, kernel, log, loop
from isiw.lazy import torch
from isiw.models.particles.changes import GROWN_AFTER, Change
from isiw.models.particles.noise import PERSISTENCE, STARTUP, NoiseKind, Response
from isiw.models.particles.prior import Depression, Person
from isiw.models.particles.shapes import Shape
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.types import FloatArray

# Of a particle.
NOISE, SHAPE, PRESENT, START, WIDTH, FORM, LOG_FLOOR, FLOOR_SD, LOG_RATIO, SPREAD, OUTPUT_SD = range(11)
BOOST, REST, ONSET, MOST, LEAST, DRIFT, STARTLED, SLOPE, LOW_START, LOW_WIDTH, DEPTH = range(11, 22)
CHANGED, STEP, STEP_DRIVE, FADING, STEP_SCALE = range(22, 27)
PARTICLE: Final = 27

# Of a trial, as a history has it.
ISI, ISI_SD, LOW, HIGH, ORDER, KNOWN, KNOWN_SD, KNOWN_LOG_SD, OFFSET, SHIFT, FACTOR = range(11)
# In place of the order: the two parts of the gain; then the order, and whether it is a trial at all.
STARTLE, RELAXED, REAL, NUMBER = 4, 11, 12, 13
TRIAL: Final = 14
SHARES: Final = 2
"""In place of a sort of trials: whether trials share an unknown factor of their known parts."""
PIECE: Final = 8 * LANES
"""So many trials of a sort are worked on at once."""
FEW: Final = 2
"""So few trials take longer side by side with lanes that are empty than one after the other."""

_f = np.float32
_FIRST, _SECOND = _f(STARTUP[0]), _f(STARTUP[1])
_LOG_PERSISTENCE: Final = np.float32(np.log(PERSISTENCE))
_ONE, _NIL, _GROWN_AFTER = np.float32(1.0), np.float32(0.0), np.float32(GROWN_AFTER)
_CONSTANT_CV, _MISSING, _ALL_OR_NONE = (
    np.float32(kind) for kind in (NoiseKind.CONSTANT_CV, NoiseKind.MISSING, NoiseKind.ALL_OR_NONE)
)


def person_of(records: FloatArray) -> Person:
    """What particles mean, as views of their records (b, p, PARTICLE)."""
    column = torch.from_numpy(records).unbind(-1)
    shape = Shape(column[SHAPE], column[START], column[WIDTH], column[FORM])
    response = Response(column[NOISE], *column[LOG_FLOOR : SLOPE + 1])
    if not records[..., DEPTH].any():
        return Person(shape, response, column[PRESENT] > 0)
    nothing = torch.zeros_like(column[SHAPE])
    low = Shape(nothing, column[LOW_START], column[LOW_WIDTH], nothing)
    return Person(shape, response, column[PRESENT] > 0, Depression(low, column[DEPTH], column[DEPTH] > 0))


def people_of(person: Person) -> FloatArray:
    """Particles as records, shape (b, p, PARTICLE)."""
    shape, response = person.shape, person.response
    low = person.depression
    nothing = torch.zeros_like(response.log_floor)
    below = (
        (nothing, nothing + 1.0, nothing)
        if low is None
        else (low.shape.start_ms, low.shape.width_ms, low.depth * low.present)
    )
    change = (nothing,) * 5 if person.change is None else _change_of(person.change, response)
    profile = (shape.kind, person.present, shape.start_ms, shape.width_ms, shape.form)
    fields = (response.kind, *profile, *response[1:], *below, *change)
    return _plain(torch.stack([field.to(nothing) for field in fields], dim=-1))


def _change_of(change: Change, response: Response) -> tuple[Tensor, ...]:
    return change.after, change.log_gain, response.slope * change.shift_pct_rmt, change.fading, change.log_scale


def columns_of(history: History) -> FloatArray:
    """A history as an array, shape (b, n, columns)."""
    return _plain(torch.cat((torch.stack(history.columns, dim=-1), history.around), dim=-1))


def _plain(values: Tensor) -> FloatArray:
    array: FloatArray = values.detach().contiguous().numpy()
    return array


@loop
def gain_of(order: Any) -> Any:
    """How a trial after so many others startles, and how far amplitudes have wandered by then; see `noise.log_gain`."""
    startle = _FIRST if order == 0 else (_SECOND if order == 1 else _NIL)
    return startle, _ONE - exp(_LOG_PERSISTENCE * _f(order))


@loop
def enhancement_after(fading: Any, order: Any) -> Any:
    """The share of the enhancement that there is after so many trials; see `Change.at`."""
    age = order if fading > _NIL else max(_GROWN_AFTER - order, _NIL)
    return exp2(-abs(fading) * age)


@loop
def settle(particle: Any, order: Any) -> None:
    """Let a particle be as it is after so many trials, without any further change; see `Person.after`."""
    if order >= particle[CHANGED]:
        particle[LOG_RATIO] += particle[STEP]
        particle[REST] += particle[STEP_DRIVE]
        particle[LOG_FLOOR] += particle[STEP_SCALE]
    if particle[FADING] != _NIL:
        share, kind = enhancement_after(particle[FADING], order), particle[NOISE]
        particle[BOOST] *= share
        if kind in (_CONSTANT_CV, _MISSING):
            particle[LOG_RATIO] += log(share)
        if kind == _MISSING:
            particle[MOST] *= math.sqrt(share)
        elif kind == _ALL_OR_NONE:
            particle[MOST] = particle[LEAST] + (particle[MOST] - particle[LEAST]) * share
    particle[STEP] = particle[STEP_DRIVE] = particle[STEP_SCALE] = particle[FADING] = _NIL


def trial_records(columns: Any) -> Any:
    """Trials, known and censored, as (b, 2, pieces, TRIAL, PIECE), and how many a piece has, in lanes but for a few.

    What is beside the sizes of both sorts is `SHARES`.
    """
    people, trials = columns.shape[:2]
    pieces = max(1, (trials + PIECE - 1) // PIECE)
    records = np.zeros((people, 2, pieces, TRIAL, PIECE), np.float32)
    sizes = np.zeros((people, 3, pieces), np.int64)
    _trial_records(columns, records, sizes)
    return records, sizes


@kernel
def _trial_records(columns: Any, records: Any, sizes: Any) -> None:
    people, trials, pieces, most = len(columns), columns.shape[1], sizes.shape[2], records.shape[4]
    for person in range(people):
        for n in range(trials):
            column = columns[person, n]
            sort = 1 if column[LOW] != column[HIGH] else 0
            piece = 0
            while sizes[person, sort, piece] == most:
                piece += 1
            i = sizes[person, sort, piece]
            record = records[person, sort, piece]
            for field in range(FACTOR + 1):
                record[field, i] = column[field]
            if np.isnan(column[ISI]):
                record[ISI, i] = record[FACTOR, i] = _NIL
            record[NUMBER, i] = column[ORDER]
            record[STARTLE, i], record[RELAXED, i] = gain_of(column[ORDER])
            record[REAL, i] = _ONE
            sizes[person, SHARES, 0] |= column[KNOWN_LOG_SD] > _NIL
            sizes[person, sort, piece] += 1
        for sort in range(2):
            for piece in range(pieces):
                over = sizes[person, sort, piece] % LANES
                sizes[person, sort, piece] += LANES - over if over > FEW else 0
