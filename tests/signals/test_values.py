from __future__ import annotations

import pytest

from isiw.design import IMPACT_SPACE
from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.signals.plausible import implausible_amplitude, implausible_scale, require_plausible


@pytest.mark.parametrize("mep_mv", [0.0, 0.0005, 0.008, 0.3, 12.0, 25.0])
def test_what_muscles_give_is_plausible(mep_mv: float) -> None:
    assert implausible_amplitude(mep_mv) is None
    require_plausible(100.0, mep_mv, 104.0, IMPACT_SPACE)


@pytest.mark.parametrize(
    ("isi_ms", "mep_mv", "kind", "unit"),
    [
        (100.0, 8e-6, Kind.IMPLAUSIBLE, "V?"),
        (100.0, 60.0, Kind.IMPLAUSIBLE, "µV?"),
        (100.0, 1e12, Kind.IMPLAUSIBLE, "µV?"),
        (0.1, 0.02, Kind.IN_SECONDS, "ms"),
        (0.02, 100.0, Kind.ORDER, ""),
        (None, 1e-5, Kind.IMPLAUSIBLE, "V?"),
        (-3.0, 0.1, Kind.TMS_BEFORE_IMPACT, ""),
    ],
)
def test_a_slip_is_refused_and_named(isi_ms: float | None, mep_mv: float, kind: Kind, unit: str) -> None:
    with pytest.raises(InvalidValueError, match=r"ISI|amplitude|impact") as refused:
        require_plausible(isi_ms, mep_mv, 100.0, IMPACT_SPACE)
    assert refused.value.found is kind
    assert f" {unit}" in f"{refused.value.remedy} "


@pytest.mark.parametrize("meps_mv", [[0.0011], [0.0, 0.0015, 0.0012]])
def test_pulses_whose_amplitudes_are_all_below_the_emg_at_rest_may_be_in_volts(meps_mv: list[float]) -> None:
    slip = implausible_scale(meps_mv)
    assert slip is not None
    assert slip.kind is Kind.IMPLAUSIBLE


@pytest.mark.parametrize("meps_mv", [[], [0.0], [0.002], [0.008, 0.0005], [0.0005, 0.008]])
def test_amplitudes_with_one_as_large_as_the_emg_at_rest_are_believed(meps_mv: list[float]) -> None:
    assert implausible_scale(meps_mv) is None
