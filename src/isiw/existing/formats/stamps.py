"""Times of samples, one by one: where they leave a gap, and at which rate samples were really taken."""

from __future__ import annotations

from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.formats.contents import Stretch
from isiw.types import FloatArray, IntArray

_GAP_S: Final = 2.5e-3  # samples that are later than expected by so much, for good, come after a gap; others jitter
_AROUND_S: Final = 1.0
_ENOUGH_S: Final = 10.0  # a stretch that is longer says at which rate its samples were really taken
_SCATTER_S: Final = 2e-3  # times that scatter more are said


class Clocked(NamedTuple):
    """The rate at which samples were really taken, their stretches, and a note if the times scatter about these."""

    rate_hz: float
    stretches: tuple[Stretch, ...]
    notes: tuple[str, ...]


def clocked(
    times_s: FloatArray, nominal_hz: float | None, what: str, index: IntArray | None = None, samples: int = 0
) -> Clocked:
    """Times of samples [s], of those at `index` if not of all, as stretches without a gap; what is left is jitter."""
    index = np.arange(len(times_s)) if index is None else index
    ahead = np.diff(index)
    steps_s = np.diff(times_s) / ahead
    if len(times_s) < 3 or not np.isfinite(times_s).all() or not np.median(steps_s) > 0:
        raise InvalidValueError(f"the times of the samples of {what} do not ascend", got=f"{len(times_s)} samples")
    nominal_s = 1.0 / nominal_hz if nominal_hz else float(np.median(steps_s))
    late_s = times_s - index * nominal_s
    around = max(3, round(_AROUND_S / (nominal_s * float(ahead.mean()))))
    near_s = late_s[: len(late_s) // around * around].reshape(-1, around)  # about which times scatter, whatever gaps
    jitter_s = 1.48 * np.median(np.abs(near_s - np.median(near_s, axis=1, keepdims=True))) if len(near_s) else 0.0
    least_s = max(_GAP_S, 1.5 * nominal_s, 2.0 * float(jitter_s))
    late = (np.flatnonzero(np.diff(late_s) > 0.8 * least_s) + 1).tolist()
    begins = [0, *_gaps(late_s, late, (0, len(times_s)), around, least_s)]
    spans = [slice(*span) for span in pairwise([*begins, len(times_s)])]
    longest = max(spans, key=lambda span: index[span.stop - 1] - index[span.start])
    period_s = nominal_s
    if times_s[longest][-1] - times_s[longest][0] >= _ENOUGH_S:  # by a line through all of them
        centred = index[longest] - index[longest].mean()
        period_s = float(centred @ (times_s[longest] - times_s[longest].mean()) / (centred @ centred))
    stretches, scatter = [], list[FloatArray]()
    for span, last in zip(spans, [*index[begins[1:]].tolist(), samples or len(times_s)], strict=True):
        first = int(index[span.start])
        late_s = times_s[span] - period_s * (index[span] - first)
        stretches.append(Stretch(first, last - first, float(np.median(late_s))))
        scatter.append(np.abs(late_s - stretches[-1].start_s))
    scatter_s = float(np.quantile(np.concatenate(scatter), 0.95))
    note = f"The times of {what} scatter by {1e3 * scatter_s:.1f} ms: MEPs may lie elsewhere."
    return Clocked(1.0 / period_s, tuple(stretches), (note,) if scatter_s > _SCATTER_S else ())


def _gaps(late_s: FloatArray, places: list[int], span: tuple[int, int], around: int, least_s: float) -> list[int]:
    """Where samples are later than those before, for good: the surest place, and those on both sides of it."""
    sure = dict[int, float]()
    for at in (place for place in places if span[0] < place < span[1]):
        before, after = late_s[max(span[0], at - around) : at], late_s[at : min(span[1], at + around)]
        if np.median(after) - np.median(before) > least_s:
            sure[at] = float(after.mean() - before.mean())
    if not sure:
        return []
    surest = max(sure, key=lambda place: sure[place])
    sides = [_gaps(late_s, places, side, around, least_s) for side in ((span[0], surest), (surest, span[1]))]
    return [*sides[0], surest, *sides[1]]
