from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.log.record import SessionRecord, read_session
from isiw.plots.comparison import comparison_figure
from isiw.plots.style import save_figure
from isiw.session.loop import Session
from known import known
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def record(tmp_path: Path) -> SessionRecord:
    Session(ScriptedDevice(), scripted_strategy(4), log=tmp_path / "s.mcap", subject="P07").run()
    return read_session(tmp_path / "s.mcap")


def test_windows_and_intervals_are_where_the_logs_have_them(record: SessionRecord) -> None:
    axes = comparison_figure([record, record]).axes[0]
    bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in axes.patches]  # type: ignore[attr-defined]
    assert bars == [(34.0, 94.0)] * 2
    intervals = [np.asarray(line.get_xdata()).tolist() for line in axes.lines]
    assert intervals == [[29.0, 39.0], [150.0, 200.0]] * 2


def test_every_session_is_named_and_every_mark_explained_once(record: SessionRecord) -> None:
    figure = comparison_figure([record, record])
    assert [label.get_text()[:4] for label in figure.axes[0].get_yticklabels()] == ["P07,", "P07,"]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert sorted(labels) == ["90 % interval of its end", "90 % interval of its start", "window"]


def test_a_session_without_trials_and_a_code_that_is_markup_are_drawn(record: SessionRecord, tmp_path: Path) -> None:
    header = record.header.model_copy(update={"subject": "$\\frac{ \x1b[2J<script>" + 50 * "x"})
    empty = type(record)(record.path, header, (), (), False)
    picture = save_figure(comparison_figure([empty, replace(record, header=header)]), tmp_path / "c.png")
    assert picture.stat().st_size > 3000


def test_the_axis_names_what_isis_count_from_in_all_sessions(record: SessionRecord) -> None:
    device = replace(record.header.device, reference="impact")
    tapped = record.header.model_copy(update={"space": DesignSpace(0, 200, reference="impact"), "device": device})
    pulsed = tapped.model_copy(update={"device": replace(device, conditioning="electrical")})
    for headers, name in (
        ([tapped], "impact"),
        ([pulsed], "electrical pulse"),
        ([tapped, pulsed], "impact or electrical pulse"),
    ):
        axes = comparison_figure([replace(record, header=header) for header in headers]).axes[0]
        assert axes.get_xlabel() == f"ISI after the {name} [ms]"


def test_sessions_on_different_clocks_are_refused(record: SessionRecord) -> None:
    header = record.header.model_copy(update={"space": DesignSpace(0, 200, reference="impact")})
    with pytest.raises(InvalidValueError, match="one event"):
        comparison_figure([record, replace(record, header=header)])
    assert known(record.estimates[-1].window)
