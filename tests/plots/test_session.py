from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import EstimateRecord
from isiw.plots.session import BELOW_THE_MEAN, save_session_plot, session_figure
from isiw.report.drawn import drawn
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.strategy.catalogue import make_strategy
from isiw.sweeps import Measurement
from isiw.trials import Trial
from isiw.window import Window
from known import known
from scripted import SPACE, ScriptedDevice, scripted_strategy


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    log = tmp_path_factory.mktemp("session") / "s.mcap"
    device = ScriptedDevice(
        lambda s: Measurement(0.02 * s.trial, s.isi_ms, background_rms_uv=50.0 if s.trial == 1 else 2.0)
    )
    Session(device, scripted_strategy(6), log=log).run()
    exclude(log, 4, "sneezed")
    return read_session(log)


def labels(figure: Figure) -> set[str]:
    return {text.get_text() for legend in figure.legends for text in legend.get_texts()}


def line(axes: Axes, label: str) -> tuple[list[float], list[float]]:
    (found,) = [line for line in axes.lines if line.get_label() == label]
    return np.asarray(found.get_xdata()).tolist(), np.asarray(found.get_ydata()).tolist()


@pytest.mark.parametrize("suffix", [".png", *(pytest.param(one, marks=pytest.mark.slow) for one in (".pdf", ".svg"))])
def test_a_session_is_drawn_into_a_file(record: SessionRecord, tmp_path: Path, suffix: str) -> None:
    path = save_session_plot(record, tmp_path / "new" / f"s{suffix}")
    assert path.stat().st_size > 5000


def test_the_picture_shows_profile_trials_window_and_truth(record: SessionRecord) -> None:
    figure = session_figure(record, truth=Window(30, 80))
    profile, *_ = figure.axes
    assert labels(figure) == {
        "window", "true window (simulated)", "90 % band of the expected MEP", "expected MEP", "trial", "excluded",
        "mistrial", "start of the window, with 90 % interval", "end of the window, with 90 % interval",
    }  # fmt: skip
    assert profile.get_xlim() == (-4, 204)  # points at the ends of the range are whole
    assert profile.get_xlabel() == "ISI after the valve command [ms]"
    assert "(6 trials" in profile.get_title(loc="left")


def test_isis_after_an_electrical_pulse_count_from_it(record: SessionRecord) -> None:
    device = replace(record.header.device, reference="impact", conditioning="electrical")
    header = record.header.model_copy(update={"device": device, "space": replace(SPACE, reference="impact")})
    (profile, *_) = session_figure(replace(record, header=header)).axes
    assert profile.get_xlabel() == "ISI after the electrical pulse [ms]"


def test_tms_alone_stands_beside_the_range_with_its_mean(record: SessionRecord) -> None:
    alone = [
        replace(record.table[0], index=90 + k, commanded_isi_ms=None, isi_ms=None, mep_mv=mep_mv)
        for k, mep_mv in enumerate((0.01, 0.03))
    ]
    profile = session_figure(replace(record, history=(*record.history, *alone))).axes[0]
    isis_ms, meps_uv = line(profile, "trial")
    assert {place_ms for place_ms, uv in zip(isis_ms, meps_uv, strict=True) if uv in (10.0, 30.0)} == {-12.0}
    assert profile.get_xlim() == (-20, 204)
    assert line(profile, "mean of TMS alone")[1] == [20.0, 20.0]
    assert [tick.get_text() for tick in profile.get_xticklabels()][:2] == ["TMS\nalone", "0"]


def test_subject_date_and_why_most_trials_lie_below_the_mean_are_in_the_picture(record: SessionRecord) -> None:
    header = record.header.model_copy(update={"subject": "$P07"})
    figure = session_figure(replace(record, header=header))
    assert figure.get_suptitle() == f"\\$P07, {header.created[:10]} (UTC)"
    assert figure.legends[0].get_title().get_text() == BELOW_THE_MEAN


def test_a_trial_that_counts_beyond_the_range_is_whole(record: SessionRecord) -> None:
    beyond = replace(record.table.told[0], index=90, isi_ms=207.0)
    profile = session_figure(replace(record, history=(*record.history, beyond))).axes[0]
    assert profile.get_xlim() == (-4, 211)


def test_trials_lie_where_they_were_realised(record: SessionRecord) -> None:
    profile = session_figure(record).axes[0]
    (trials,) = [line for line in profile.lines if line.get_label() == "trial"]
    told = record.table.told
    assert np.asarray(trials.get_xdata()).tolist() == [trial.isi_ms for trial in told]
    assert np.asarray(trials.get_ydata()).tolist() == pytest.approx(
        [max(1.0, 1e3 * known(trial.mep_mv)) for trial in told]
    )


def test_edges_beyond_the_range_are_drawn_at_its_border(record: SessionRecord) -> None:
    for line in session_figure(record).axes[1].lines:
        edges_ms = np.asarray(line.get_ydata(), dtype=float)
        assert ((edges_ms >= 0) & (edges_ms <= 200)).all()


def test_a_session_without_a_window_is_drawn(record: SessionRecord) -> None:
    for probability, grid_ms, said in (
        (0.03, (0.0, 200.0), "No window"),
        (0.25, (0.0, 200.0), "Undecided"),
        (None, (), "No answer yet"),
    ):
        profile = {} if grid_ms else {"grid_ms": (), "profile_mv": (), "band_low_mv": (), "band_high_mv": ()}
        update = {"segments_ms": (), "probability": probability, **profile}
        entries = [e.model_copy(update=update) if isinstance(e, EstimateRecord) else e for e in record.history]
        none = type(record)(record.path, record.header, tuple(entries), (), True)
        assert session_figure(none).axes[0].get_title(loc="left").startswith(said)
        assert "window" not in labels(session_figure(none))


def test_the_band_of_the_prediction_is_the_logs_and_wider_than_that_of_the_expectation(tmp_path: Path) -> None:
    strategy = make_strategy(space=SPACE, seed=1, max_trials=3, particles=200)
    Session(ScriptedDevice(), strategy, log=tmp_path / "d.mcap").run()
    record = read_session(tmp_path / "d.mcap")
    last, profile = record.estimates[-1], session_figure(record).axes[0]
    drawn = {collection.get_label(): collection for collection in profile.collections}
    band = drawn["prediction: 90 % of trials lie here"].get_paths()[0].vertices
    ends_uv = {round(float(uv), 2) for _, uv in np.asarray(band)}
    assert {round(1e3 * mv, 2) for mv in last.predicted_high_mv} <= ends_uv
    assert (np.asarray(last.predicted_high_mv) > np.asarray(last.profile_mv)).all()
    assert (np.asarray(last.predicted_low_mv) < np.asarray(last.profile_mv)).all()


def test_mistrials_are_where_they_happened_and_trials_are_counted_as_in_the_log(record: SessionRecord) -> None:
    profile, edges, chance = session_figure(record).axes
    (lost,) = [trial for trial in record.table if trial.reason is not None]
    isis_ms, meps_uv = line(profile, "mistrial")
    assert isis_ms == [lost.isi_ms]
    assert meps_uv == pytest.approx([1e3 * known(lost.mep_mv)])
    assert [lost.index] in [np.asarray(line.get_xdata()).tolist() for line in chance.lines]
    assert line(edges, "start of the window, with 90 % interval")[0] == [
        estimate.trial for estimate in record.estimates
    ]


def test_pulses_at_another_intensity_are_told_apart_as_the_profile_is_not_theirs(record: SessionRecord) -> None:
    strong = replace(record.table[0], index=90, isi_ms=50.0, mep_mv=0.9, intensity_pct_rmt=120.0)
    there = replace(record, history=(*record.history, strong))
    profile = session_figure(there).axes[0]
    assert line(profile, "trial at another intensity") == ([50.0], [900.0])
    assert 50.0 not in line(profile, "trial")[0]
    assert [trial["kind"] for trial in drawn(there)["trials"] if trial["number"] == 90] == ["other"]


def test_mistrials_without_an_mep_are_at_the_lower_edge_and_named(record: SessionRecord) -> None:
    unmeasured = [replace(e, mep_mv=None) if isinstance(e, Trial) and e.reason else e for e in record.history]
    figure = session_figure(replace(record, history=tuple(unmeasured)))
    (lost,) = [trial for trial in record.table if trial.reason is not None]
    assert line(figure.axes[0], "mistrial") == ([lost.isi_ms], [0.02])
    assert "mistrial" in labels(figure)


def test_where_nothing_counts_the_panels_say_so(record: SessionRecord) -> None:
    empty = type(record)(record.path, record.header, (), (), False)
    said = [[text.get_text() for text in axes.texts] for axes in session_figure(empty).axes]
    assert said == [["no trial counts"], *[["no estimate that rests on trials"]] * 2]


@pytest.mark.slow
def test_a_session_without_trials_is_drawn(record: SessionRecord, tmp_path: Path) -> None:
    empty = type(record)(record.path, record.header, (), (), False)
    assert save_session_plot(empty, tmp_path / "empty.png").stat().st_size > 1000


def test_trials_behind_a_gap_are_in_the_picture(record: SessionRecord) -> None:
    last = record.estimates[-1].trial
    kept = [e for e in record.history if not (isinstance(e, Trial) and e.index in range(1, last))]
    (low, high) = session_figure(replace(record, history=tuple(kept))).axes[-1].get_xlim()
    assert low < 0
    assert high > last
