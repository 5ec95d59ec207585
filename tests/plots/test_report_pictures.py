"""The pictures that only a report has: window on the time line, sweeps by ISI, timing and rest by trial."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from isiw.log.record import SessionRecord
from isiw.plots.session import session_figure
from isiw.plots.style import inline_svg
from isiw.plots.timeline import all_sweeps_figure, course_figure, timeline_figure
from known import instance, known
from report.sessions import pulsed, tapped


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    return tapped(tmp_path_factory.mktemp("pictures") / "s.mcap")


def legend(figure: Figure) -> set[str]:
    return {text.get_text() for found in figure.legends for text in found.get_texts()}


def line_of(axes: Axes, label: str) -> tuple[list[float], list[float]]:
    (line,) = [line for line in axes.lines if line.get_label() == label]
    return np.asarray(line.get_xdata()).tolist(), np.asarray(line.get_ydata()).tolist()


def test_sweeps_are_stacked_by_isi_with_the_hits_before_the_pulse(record: SessionRecord) -> None:
    figure = known(all_sweeps_figure(record))
    (axes,) = figure.axes
    told = sorted(record.table.told, key=lambda trial: -1 if trial.isi_ms is None else trial.isi_ms)
    labels = [tick.get_text() for tick in axes.get_yticklabels()]
    assert labels == ["TMS alone" if trial.isi_ms is None else f"{trial.isi_ms:.0f}" for trial in told]
    collections = [instance(LineCollection, item) for item in axes.collections]
    assert sum(len(collection.get_segments()) for collection in collections) == len(told)
    hits = {round(hit_ms, 6) for hit_ms in line_of(axes, "hit of the hammer")[0]}
    assert hits == {round(-isi, 6) for t in told if (isi := t.isi_ms) is not None and isi <= 50}
    assert {"MEP window", "TMS pulse", "EMG, ISI inside the window", "EMG, other trials"} <= legend(figure)


def test_after_an_electrical_pulse_no_hammer_hits(record: SessionRecord) -> None:
    sweeps, timeline = known(all_sweeps_figure(pulsed(record))), timeline_figure(pulsed(record))
    assert "electrical pulse" in legend(sweeps)
    assert "hit of the hammer" not in legend(sweeps)
    assert [text.get_text() for text in timeline.axes[0].texts] == ["electrical pulse"]
    assert timeline.axes[0].get_xlabel() == "time after the electrical pulse [ms]"


def test_the_offset_of_an_amplifier_moves_no_trace(record: SessionRecord) -> None:
    def traces(offset_mv: float) -> list[Any]:
        waves = {key: replace(channel, values=channel.values + offset_mv) for key, channel in record.waveforms.items()}
        (axes,) = known(all_sweeps_figure(replace(record, waveforms=waves))).axes
        return [segment for item in axes.collections for segment in instance(LineCollection, item).get_segments()]

    for moved, there in zip(traces(5.0), traces(0.0), strict=True):
        np.testing.assert_allclose(moved, there, atol=1e-6)


def test_an_artefact_is_left_out_of_the_stacked_sweeps_and_an_mep_is_not(record: SessionRecord) -> None:
    def segments(artefact_mv: float) -> list[Any]:
        waves = {}
        for (trial, name), channel in record.waveforms.items():
            after_ms = channel.t0_ms + 1e3 * np.arange(len(channel.values)) / channel.rate_hz
            is_artefact = np.abs(after_ms - known(record.table[trial].t_tms_ms)) < 1
            added = artefact_mv * is_artefact if name == "emg" else 0.0
            waves[trial, name] = replace(channel, values=channel.values + added)
        (axes,) = known(all_sweeps_figure(replace(record, waveforms=waves))).axes
        return [segment for item in axes.collections for segment in instance(LineCollection, item).get_segments()]

    def points(segment: Any, low_ms: float, high_ms: float) -> Any:
        return segment[(segment[:, 0] > low_ms) & (segment[:, 0] < high_ms)]

    for with_one, without in zip(segments(50.0), segments(0.0), strict=True):
        assert len(points(with_one, -0.9, 0.9)) == 0
        np.testing.assert_allclose(points(with_one, 15, 35), points(without, 15, 35), atol=2e-3)
        assert len(points(without, 15, 35)) > 30


def test_without_emg_there_are_no_sweeps_to_draw(record: SessionRecord) -> None:
    assert all_sweeps_figure(replace(record, waveforms={})) is None
    unknown = {key: replace(channel, unit="counts") for key, channel in record.waveforms.items()}
    assert all_sweeps_figure(replace(record, waveforms=unknown)) is None
    blank = {key: replace(channel, values=channel.values * np.nan) for key, channel in record.waveforms.items()}
    assert all_sweeps_figure(replace(record, waveforms=blank)) is None


def test_timing_and_rest_are_those_of_the_log_beside_their_limits(record: SessionRecord) -> None:
    timing, background = course_figure(record).axes
    pairs = [trial for trial in record.table if trial.isi_ms is not None]
    assert line_of(timing, "trial") == ([t.index for t in pairs], [t.isi_error_ms for t in pairs])
    assert set(line_of(timing, "tolerance")[1]) == {10.0}
    assert line_of(background, "trial")[1] == [trial.background_rms_uv for trial in record.table]
    assert set(line_of(background, "limit, 10 µV")[1]) == {10.0}


def test_of_a_muscle_that_is_to_be_contracted_no_limit_is_drawn(record: SessionRecord) -> None:
    contracted = replace(record.header.signals, contracted=True)
    header = record.header.model_copy(update={"signals": contracted})
    for each in (replace(record, header=header), replace(record, header=header, history=())):
        assert not any("limit" in str(line.get_label()) for line in course_figure(each).axes[1].lines)


def test_what_was_not_recorded_is_said(record: SessionRecord) -> None:
    empty = replace(record, history=())
    assert [axes.texts[0].get_text() for axes in course_figure(empty).axes] == ["not recorded"] * 2


def test_the_time_line_has_valve_hit_and_window(record: SessionRecord) -> None:
    figure = timeline_figure(record)
    (axes,) = figure.axes
    median_ms = np.median([t.t_hit_ms - t.t_valve_ms for t in record.table if t.t_hit_ms and t.t_valve_ms])
    assert [text.get_text() for text in axes.texts] == [
        "hit of the hammer", f"valve command\n−{median_ms:.0f} ms (median)",
    ]  # fmt: skip
    assert {"window", "90 % interval of its start", "ISIs that may be delivered"} <= legend(figure)


def test_the_best_isi_is_on_the_time_line(record: SessionRecord) -> None:
    history: list[Any] = list(record.history)
    history[-1] = history[-1].model_copy(update={"best_isi_ms": (60.0, 50.0, 70.0)})
    figure = timeline_figure(replace(record, history=tuple(history)))
    assert line_of(figure.axes[0], "best ISI, 90 % interval") == ([60.0], [0.2])


@pytest.mark.slow
def test_a_picture_in_a_page_has_the_pages_colours_and_names_of_its_own(record: SessionRecord) -> None:
    one, other = (inline_svg(course_figure(record), name) for name in ("one", "other"))
    assert one.startswith("<svg")
    assert "#0072b2" not in one
    assert "var(--blue)" in one
    assert "<metadata" not in one
    ids = [set(re.findall(r' id="([^"]+)"', svg)) for svg in (one, other)]
    assert ids[0].isdisjoint(ids[1])
    assert one == inline_svg(course_figure(record), "one")


@pytest.mark.slow
def test_a_code_that_reads_like_markup_is_text_in_the_picture(record: SessionRecord) -> None:
    for code in ("font: 1px a", "<b>P07</b>"):
        named = replace(record, header=record.header.model_copy(update={"subject": code}))
        assert f">{escape(code)}, " in inline_svg(session_figure(named), "s")
