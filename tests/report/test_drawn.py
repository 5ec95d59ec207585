from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.change import Change
from isiw.log.record import SessionRecord
from isiw.log.schema import EstimateRecord
from isiw.report.drawn import MOST_NEAR, MOST_WHOLE, drawn
from isiw.report.words import final_statement
from isiw.summary import TOO_FEW
from isiw.sweeps import Channel
from known import known
from report.sessions import pulsed, tapped


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    return tapped(tmp_path_factory.mktemp("drawn") / "s.mcap", trials=2)


def sweep(record: SessionRecord, **channels: Channel) -> list[dict[str, Any]]:
    first = record.table[0].index
    shown = replace(record, waveforms={(first, name): channel for name, channel in channels.items()})
    waves: list[dict[str, Any]] = drawn(shown)["trials"][0]["sweep"]
    return waves


def test_no_spike_is_lost_however_few_points_are_drawn(record: SessionRecord) -> None:
    values = np.zeros(50_000)
    values[[12_345, 34_567]] = (5.0, -3.0)
    (wave,) = sweep(record, force=Channel(values, 50_000.0, "N"))
    assert len(wave["values"]) <= MOST_WHOLE
    assert (max(wave["values"]), min(wave["values"])) == (5.0, -3.0)
    assert wave["values"].index(5.0) * wave["step"] == pytest.approx(1e3 * 12_345 / 50_000, abs=wave["step"])
    assert len(wave["values"]) * wave["step"] == pytest.approx(1000.0, rel=0.02)


def test_the_emg_near_the_pulse_keeps_every_sample(record: SessionRecord) -> None:
    emg = record.waveforms[record.table[0].index, "emg"]
    near = sweep(record, emg=emg)[0]
    assert near["step"] == 1e3 / emg.rate_hz
    assert len(near["values"]) <= MOST_NEAR
    first = round((near["t0"] - emg.t0_ms) * emg.rate_hz / 1e3)
    shown = emg.values[first : first + len(near["values"])]
    assert near["values"] == pytest.approx(shown.tolist(), abs=1e-3 * np.abs(shown).max())


def test_an_offset_costs_no_digits(record: SessionRecord) -> None:
    emg = record.waveforms[record.table[0].index, "emg"]
    plain, moved = (sweep(record, emg=replace(emg, values=emg.values + offset))[0]["values"] for offset in (0.0, 100.0))
    assert np.asarray(moved) - 100.0 == pytest.approx(plain, abs=1e-3 * np.abs(plain).max())


def test_an_emg_has_the_axis_of_its_mep_which_the_artefact_of_the_pulse_leaves(record: SessionRecord) -> None:
    pulse_ms = known(record.table[0].t_tms_ms)
    since_ms = np.arange(3000) / 2.0 - pulse_ms
    mep = 0.025 * np.sin((since_ms - 20) * np.pi / 5) * ((since_ms > 20) & (since_ms < 30))
    for unit, per_mv in (("mV", 1.0), ("V", 1e-3), ("uV", 1e3)):
        emg = Channel(per_mv * (7.0 + mep + 5.0 * (np.abs(since_ms) < 1)), 2000.0, unit)
        near, whole = sweep(record, emg=emg)
        for wave in (near, whole):
            low, high = (end / per_mv for end in wave["axis"])
            assert low < 6.975
            assert high > 7.025
            assert 0.2 * (high - low) <= 0.05
        assert np.ptp([v / per_mv for v in near["values"] if v < 7.1 * per_mv]) == pytest.approx(0.05, abs=5e-4)
    quiet = sweep(record, emg=Channel(0.001 * np.sin(since_ms), 2000.0, "mV"))[0]["axis"]
    assert np.ptp(quiet) > 0.05
    assert [wave["axis"] for wave in sweep(record, force=emg)] == [None]


def test_axis_and_lines_are_named_after_the_stimulus_that_was_given(record: SessionRecord) -> None:
    shown, electrical = drawn(record), drawn(pulsed(record))
    assert shown["isiAxis"] == "ISI after the impact [ms]"
    assert shown["dotted"] == "Dotted orange lines: valve command and hit of the hammer."
    assert electrical["isiAxis"] == "ISI after the electrical pulse [ms]"
    assert electrical["dotted"] == "Dotted orange line: electrical pulse."
    assert electrical["trials"][-1]["asked"] == "electrical pulse alone"


def test_what_is_not_finite_is_left_open_and_the_rest_is_json(record: SessionRecord) -> None:
    (wave,) = sweep(record, force=Channel(np.array([1.0, math.nan, math.inf, 2.0]), 1000.0, "N"))
    assert wave["values"] == [1.0, None, None, 2.0]
    odd = {"next_isi_ms": math.inf, "profile_mv": (math.nan,) * 3, "grid_ms": (math.nan, 0, 5)}
    history = tuple(e.model_copy(update=odd) if isinstance(e, EstimateRecord) else e for e in record.history)
    tiny = {key: Channel(np.full(9, 1e-300), 1e-306, "mV") for key in record.waveforms}
    text = json.dumps(drawn(replace(record, history=history, waveforms=tiny)), allow_nan=False)
    assert json.loads(text)["beliefs"]["0"]["end"][1] == "high"


def test_a_name_that_a_page_could_obey_is_plain(record: SessionRecord) -> None:
    (wave,) = sweep(record, **{"for\u202ece": Channel(np.ones(3), 1000.0, "N")})
    assert wave["name"] == "force"


def test_a_belief_that_hardly_a_trial_bears_names_no_window(tmp_path: Path) -> None:
    shown = drawn(tapped(tmp_path / "s.mcap", trials=6))["beliefs"]
    assert (shown[0]["found"], shown[0]["window"]) == (f"{TOO_FEW}", [])
    assert "Fewer than three" not in shown[0]["reason"]  # it is said once
    last = shown[max(shown)]
    assert last["found"].startswith("The tap probably enhances the MEP at ISIs of")
    assert last["found"].split("ISIs of ")[1].startswith(f"{last['window'][0][0]:g}–")


def test_what_changed_during_the_session_is_said_with_what_was_found(tmp_path: Path) -> None:
    record = tapped(tmp_path / "s.mcap", trials=6)
    change = Change("amplitudes", 0.97, 4.6, 3.1, 6.7, 2)
    last = record.estimates[-1].model_copy(update={"change": change})
    against = drawn(replace(record, history=(*record.history[:-1], last)))["beliefs"][last.trial]["against"]
    assert [text for text in against if "Amplitudes rose ×4.6" in text]
    assert not [text for text in drawn(record)["beliefs"][last.trial]["against"] if "Amplitudes" in text]


def test_what_nobody_knows_of_the_tap_is_said_beside_the_window_as_in_the_final_statement(tmp_path: Path) -> None:
    record = tapped(tmp_path / "s.mcap", trials=6)
    last = record.estimates[-1]
    for facts, words in (({}, "Deliver the tap alone"), ({"tap_is_likely": True}, "The tap alone evokes as much")):
        told = last.model_copy(update={"tap_may_explain": True, **facts})
        unknown = replace(record, history=(*record.history[:-1], told))
        (said,) = drawn(unknown)["beliefs"][last.trial]["against"]
        assert said.startswith(words)
        assert said[1:] in final_statement(unknown)


def test_scores_and_prediction_are_the_logs_and_old_logs_have_none(record: SessionRecord) -> None:
    before = drawn(record)["beliefs"][record.estimates[0].trial]
    assert (before["predictedLow"], before["predictedHigh"]) == ([], [])
    last = record.estimates[0].model_copy(
        update={
            "predicted_low_mv": (0.01,) * len(record.estimates[0].grid_ms),
            "predicted_high_mv": (0.2,) * len(record.estimates[0].grid_ms),
            "chosen_by": "acquisition", "scored_ms": (0.0, 100.0), "scores": (math.nan, 0.123456),
        }
    )  # fmt: skip
    shown = drawn(replace(record, history=(last,)))
    belief = shown["beliefs"][last.trial]
    assert (set(belief["predictedLow"]), set(belief["predictedHigh"])) == ({10.0}, {200.0})
    assert (belief["scoredMs"], belief["scores"], belief["chosenBy"]) == ([0, 100], [None, 0.1235], "acquisition")
    assert shown["scored"]
    assert not drawn(replace(record, history=(last.model_copy(update={"scores": ()}),)))["scored"]


def test_a_trial_without_waveforms_has_none(record: SessionRecord) -> None:
    assert sweep(record) == []
