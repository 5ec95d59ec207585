from __future__ import annotations

import numpy as np
import pytest

from found import doubt_of
from isiw.design import IMPACT_SPACE, DesignSpace
from isiw.findings import Finding, Kind, Severity
from isiw.signals.plausible import Doubts, isi_far, require_plausible


@pytest.mark.parametrize(("isi_ms", "mep_mv"), [(30.0, 0.02), (300.0, 0.02), (11.0, 1.5)])
def test_after_an_isi_near_0_was_asked_no_amplitude_is_taken_for_it(isi_ms: float, mep_mv: float) -> None:
    require_plausible(isi_ms, mep_mv, 0.0, IMPACT_SPACE)
    doubt = isi_far(isi_ms, 0.0, IMPACT_SPACE)
    assert doubt is not None
    assert doubt.kind is Kind.ISI_FAR


def test_an_isi_far_from_the_one_asked_is_a_doubt(space: DesignSpace) -> None:
    doubt = isi_far(180.0, 100.0, space)
    assert doubt is not None
    assert doubt.kind is Kind.ISI_FAR
    assert doubt.severity is Severity.DOUBT


@pytest.mark.parametrize(
    ("meps_mv", "kind"),
    [
        ([0.02, 0.05, 0.05, 0.05, 0.05], Kind.EQUAL),
        ([0.02, 0.3, 0.302, 0.299, 0.301, 0.304, 0.3], Kind.EQUAL),
        ([0.0005, 0.0004, 0.0003], Kind.SMALL),
        ([8.0, 6.0, 12.0], Kind.LARGE),
        ([0.008, 0.01, 0.1, 8.0, 11.0, 9.0], Kind.JUMP),
        ([0.0] * 10, Kind.SILENT),
    ],
)
def test_amplitudes_that_look_like_a_slip_are_doubted(meps_mv: list[float], kind: Kind) -> None:
    doubt = doubt_of(meps_mv)
    assert doubt is not None
    assert doubt.kind is kind
    assert doubt_of(meps_mv[:-1]) is None


FALLEN_SILENT_MV = [0.1, 0.2] * 4 + [0.0] * 10


@pytest.mark.parametrize("isis_ms", [[100.0] * 18, [40.0, 160.0] * 4 + [100.0] * 10, [None] * 18])
def test_pulses_that_give_no_mep_any_more_are_doubted(isis_ms: list[float | None]) -> None:
    doubt = doubt_of(FALLEN_SILENT_MV, None, isis_ms)
    assert doubt is not None
    assert doubt.kind is Kind.STOPPED
    assert doubt_of(FALLEN_SILENT_MV[:-1], None, isis_ms[:-1]) is None
    assert doubt_of(FALLEN_SILENT_MV, 0.05, isis_ms) is None  # most pulses evoke less than this limit


@pytest.mark.parametrize("isis_ms", [[100.0] * 8 + [200.0] * 10, [100.0] * 8 + [None] * 10])
def test_pulses_where_nothing_was_ever_answered_are_not_doubted(isis_ms: list[float | None]) -> None:
    assert doubt_of(FALLEN_SILENT_MV, None, isis_ms) is None


@pytest.mark.parametrize(
    "meps_mv",
    [
        [],
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [0.006] + [0.0] * 20,
        [0.05, 0.05, 0.05],
        [0.0400, 0.0401, 0.0402, 0.0399, 0.0400, 0.0401, 0.0402],  # EMG at rest, in hum
        [0.30, 0.33, 0.28, 0.31, 0.27, 0.30, 0.32],  # alike, for a muscle
        [0.008, 0.01, 0.009, 1.5, 0.9, 1.2],
        [0.0027, 0.0008, 0.002],
        [0.08, 5.0, 2.0, 0.1],
        [2.4, 3.6, 2.9],
    ],
)
def test_usual_amplitudes_are_not_doubted(meps_mv: list[float]) -> None:
    assert doubt_of(meps_mv) is None


def test_a_muscle_is_not_doubted_for_being_steady() -> None:
    meps_mv = [float(mep_mv) for mep_mv in 0.3 * np.random.default_rng(0).lognormal(0.0, 0.3, 5000)]
    assert not any(doubt_of(meps_mv[n : n + 6]) for n in range(5000))


@pytest.mark.parametrize(("isi_ms", "asked_ms"), [(104.0, 100.0), (None, 100.0), (180.0, None)])
def test_an_isi_as_asked_or_that_nobody_asked_is_not_doubted(
    isi_ms: float | None, asked_ms: float | None, space: DesignSpace
) -> None:
    assert isi_far(isi_ms, asked_ms, space) is None


def test_each_kind_of_doubt_is_new_once() -> None:
    equal, large = (Finding(kind, Severity.DOUBT, kind) for kind in (Kind.EQUAL, Kind.LARGE))
    doubts, new = Doubts(), []
    for odd in ([None, None], [equal, None], [equal], [equal, large], [], [large, equal]):
        doubts = doubts.after(odd)
        new.append(doubts.new)
    assert new == [None, equal, None, large, None, None]
