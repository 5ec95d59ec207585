"""Plain arrays that the engine works on: fields of each particle, and columns of each trial.

The fields of a particle hold what its latents mean (`Person`); the columns of a trial what was told of it, and what else
bears on its amplitude, neutral where nobody knows better.
"""

from __future__ import annotations

from isiw.lazy import torch
from isiw.models.particles.changes import Change
from isiw.models.particles.noise import Response
from isiw.models.particles.prior import Depression, Person
from isiw.models.particles.shapes import Shape
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.native.engine import FIELDS
from isiw.types import FloatArray

NOISE, SHAPE, PRESENT, START, WIDTH, FORM, LOG_FLOOR, FLOOR_SD, LOG_RATIO, SPREAD, OUTPUT_SD = range(11)
BOOST, REST, ONSET, MOST, LEAST, DRIFT, STARTLED, SLOPE, LOW_START, LOW_WIDTH, DEPTH = range(11, 22)
CHANGED, STEP, STEP_DRIVE, FADING, STEP_SCALE = range(22, FIELDS)


def person_of(records: FloatArray) -> Person:
    """What particles mean, as views of their fields (b, p, fields)."""
    column = torch.from_numpy(records).unbind(-1)
    shape = Shape(column[SHAPE], column[START], column[WIDTH], column[FORM])
    response = Response(column[NOISE], *column[LOG_FLOOR : SLOPE + 1])
    if not records[..., DEPTH].any():
        return Person(shape, response, column[PRESENT] > 0)
    nothing = torch.zeros_like(column[SHAPE])
    low = Shape(nothing, column[LOW_START], column[LOW_WIDTH], nothing)
    return Person(shape, response, column[PRESENT] > 0, Depression(low, column[DEPTH], column[DEPTH] > 0))


def people_of(person: Person) -> FloatArray:
    """Particles as fields, shape (b, p, fields)."""
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
