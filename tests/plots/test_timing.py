from __future__ import annotations

from pathlib import Path

import pytest

from isiw.dissertation.repeatability import study_preset
from isiw.plots.style import save_figure
from isiw.plots.timeline import timing_figure


@pytest.mark.slow
def test_the_errors_are_drawn_only_where_isis_were_commanded() -> None:
    assert len(timing_figure(study_preset("bench", taps=5, isi_ms=())).axes) == 1
    figure = timing_figure(study_preset("timing-fault", taps=10, isi_ms=(10.0, 50.0)))
    assert len(figure.axes) == 2
    assert [label.get_text() for label in figure.axes[1].get_xticklabels()] == ["10", "50"]


@pytest.mark.slow
def test_the_picture_is_saved(tmp_path: Path) -> None:
    path = save_figure(timing_figure(study_preset("subject1", taps=5, isi_ms=())), tmp_path / "new" / "timing.png")
    assert path.stat().st_size > 10_000
