from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest

import isiw as library
from existing.conftest import reads_here
from existing.writers import as_edf

pytestmark = pytest.mark.usefixtures("blank_pictures")

if TYPE_CHECKING:
    from cli.conftest import Command

CONFIG = "[strategy.settings]\nparticles = 100\n"


@pytest.fixture
def read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests that are not about the process that reads a file, which takes a second to start."""
    reads_here(monkeypatch)


@pytest.fixture
def people(tmp_path: Path) -> Path:
    """A file with the trials of two people."""
    rng, rows = np.random.default_rng(1), list[tuple[str, float, float]]()
    for code in ("A", "B"):
        responder = library.subjects.cohort("gaussian", 1, 3)[0].begin(3)
        isis_ms = rng.choice(np.arange(0.0, 201.0, 5.0), 10).tolist()
        rows += [(code, isi_ms, responder.respond(isi_ms, "impact").mep_mv) for isi_ms in isis_ms]
    pd.DataFrame(rows, columns=["subject", "isi_ms", "mep_mv"]).to_csv(tmp_path / "people.csv", index=False)
    (tmp_path / "few.toml").write_text(CONFIG)
    return tmp_path / "people.csv"


@pytest.mark.slow
@pytest.mark.usefixtures("read_here")
def test_each_person_of_a_file_gets_a_log_and_called_again_nothing_is_made_twice(isiw: Command, people: Path) -> None:
    words = ("analyse", people, "--reference", "impact", "--config", "few.toml", "-o", "logs")
    first = isiw(*words)
    assert first.exit_code == 0, first.output
    assert sorted(path.name for path in Path("logs").iterdir()) == ["A.mcap", "A.png", "B.mcap", "B.png"]
    Path("logs/A.png").unlink()  # as if it had been interrupted between the log and its picture
    Path("logs/B.mcap").unlink()
    again = isiw(*words)
    assert again.exit_code == 0
    assert "A.mcap is there already" in again.output
    assert Path("logs/A.png").exists()
    assert "A.mcap" not in again.output.replace("A.mcap is there already", "")
    assert library.read_session("logs/B.mcap").header.imported
    other = isiw(*words, "--seed", "5")
    assert other.exit_code == 1
    assert "another log already" in other.output


@pytest.mark.usefixtures("read_here")
def test_the_intensity_that_a_table_says_of_its_pairs_goes_to_the_strategy(isiw: Command, people: Path) -> None:
    pd.read_csv(people).assign(intensity_pct_rmt=120).to_csv(people, index=False)
    made = isiw("analyse", people, "--reference", "impact", "--config", "few.toml", "--only", "A", "-o", "A.mcap")
    assert made.exit_code == 0, made.output
    assert library.read_session("A.mcap").header.strategy.settings["intensity_pct_rmt"] == 120.0
    assert "state the intensity" not in made.output


@pytest.mark.slow
@pytest.mark.usefixtures("read_here")
def test_what_reads_logs_reads_imported_ones_and_says_what_they_are(isiw: Command, people: Path) -> None:
    isiw("analyse", people, "--reference", "impact", "--config", "few.toml", "-o", "logs")
    logs = ("logs/A.mcap", "logs/B.mcap")
    said = {
        ("show", logs[0]): "imported from people.csv",
        ("plot", logs[0], "-o", "a.svg"): "picture: a.svg",
        ("report", logs[0]): "report: ",
        ("export", "logs", "tables"): "2 sessions with 20 trials",
        ("compare", *logs): "Imported, and no sessions of isiw: A (A.mcap), B (B.mcap).",
        ("prior", "learn", *logs, "-o", "lab.toml"): "Imported, and no sessions of isiw: A.mcap, B.mcap.",
    }
    for words, expected in said.items():
        result = isiw(*words)
        assert result.exit_code == 0, result.output
        assert expected in result.output
    refused: list[tuple[object, ...]] = [("resume", logs[0]), ("exclude", logs[0], 1, "--reason", "moved")]
    for each in refused:
        result = isiw(*each)
        assert result.exit_code == 1
        assert "delivered without isiw" in result.output


@pytest.mark.slow
@pytest.mark.usefixtures("few_sweeps", "read_here")
def test_a_session_after_an_imported_log_knows_it_and_says_what_it_is(isiw: Command, people: Path) -> None:
    made = ("--reference", "impact", "--config", "few.toml", "--simulated", "--only", "A", "-o", "A.mcap")
    assert isiw("analyse", people, *made).exit_code == 0
    Path("run.toml").write_text(f'[space]\nhigh_ms = 200.0\nreference = "impact"\n{CONFIG}max_trials = 2\n')
    result = isiw("run", "run.toml", "--after", "A.mcap", "--log", "next.mcap")
    assert result.exit_code == 0, result.output
    assert "Imported, and no sessions of isiw: A.mcap." in result.output


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "--reference"),
        (("--reference", "impact", "-o", "both.mcap"), "--only CODE"),
        (("--reference", "impact", "--only", "C"), "no person has this code"),
        (("--reference", "impact", "--column", "isi"), "KEY=NAME"),
        (("--reference", "impact", "--column", "width=isi_ms"), "what a column holds"),
        (("--reference", "valve", "--config", "impact.toml"), "is not that of the design space"),
    ],
)
@pytest.mark.usefixtures("read_here")
def test_what_is_missing_or_ambiguous_is_asked_for_and_nothing_is_written(
    words: tuple[str, ...], says: str, isiw: Command, people: Path
) -> None:
    Path("impact.toml").write_text('[space]\nhigh_ms = 200.0\nreference = "impact"\n')
    before = sorted(Path().iterdir())
    result = isiw("analyse", people, *words)
    assert result.exit_code == 1
    assert says in result.output
    assert sorted(Path().iterdir()) == before


@pytest.mark.slow
@pytest.mark.usefixtures("read_here")
def test_earlier_trials_of_a_visit_count_for_its_limit_lost_ones_among_them(isiw: Command, people: Path) -> None:
    table = pd.read_csv(people)
    table.loc[[2, 3], "mep_mv"] = np.nan
    table.to_csv(people, index=False)
    isiw("analyse", people, "--reference", "impact", "--config", "few.toml", "-o", "logs")
    limited = f"{CONFIG}max_trials = 3\n[space]\nreference = 'impact'\n[limits]\nmax_pulses = "
    for most, says in ((10, "have used up the limit of stimuli"), (12, "12 pulses, 10 of them before the session,")):
        Path("limited.toml").write_text(f"{limited}{most}\n")
        ended = isiw("run", "limited.toml", "--earlier", "logs/A.mcap", "--log", f"{most}.mcap")
        assert says in f"{' '.join(ended.output.split())}"
    assert len(library.read_session("12.mcap").table) == 2


@pytest.mark.slow
@pytest.mark.usefixtures("read_here")
def test_a_session_is_run_with_earlier_trials(isiw: Command, people: Path) -> None:
    made = ("--reference", "impact", "--config", "few.toml", "--simulated", "--only", "A", "-o", "A.mcap")
    assert isiw("analyse", people, *made).exit_code == 0
    never = "stop_width_ms = 0.001\nstop_expected_f1 = 1.0\n"  # or so few particles may be sure of a window at once
    Path("run.toml").write_text(f'[space]\nhigh_ms = 100.0\nreference = "impact"\n{CONFIG}{never}max_trials = 2\n')
    result = isiw("run", "run.toml", "--earlier", "A.mcap", "--log", "next.mcap")
    assert result.exit_code == 0, result.output
    record = library.read_session("next.mcap")
    assert (len(record.header.earlier), len(record.table)) == (10, 2)
    Path("valve.toml").write_text(f'[space]\nhigh_ms = 400.0\nreference = "valve"\n{CONFIG}')
    refused = isiw("run", "valve.toml", "--earlier", "A.mcap", "--log", "other.mcap")
    assert refused.exit_code == 1
    assert "not those of the session" in refused.output


@pytest.mark.slow
def test_a_file_is_replayed_for_one_person(isiw: Command, people: Path) -> None:
    words = ("replay", people, "--reference", "impact", "--strategy", "random", "--seeds", "1", "--trials", "6")
    result = isiw(*words, "--only", "A", "-o", "a.png")
    assert result.exit_code == 0, result.output
    assert "All 10 pairs of stimuli say" in result.output
    assert Path("a.png").exists()
    assert "--only CODE" in isiw(*words).output


@pytest.mark.usefixtures("read_here")
def test_who_cannot_be_analysed_keeps_nobody_else_from_it(isiw: Command, people: Path) -> None:
    rows = pd.read_csv(people)
    same = rows[rows["subject"] == "A"].assign(subject="0", isi_ms=30.0)
    pd.concat([same, rows[rows["subject"] == "B"]]).to_csv("some.csv", index=False)
    done = isiw(
        "analyse", "some.csv", "--reference", "impact", "--config", "few.toml", "--alone", "single", "-o", "logs"
    )
    assert done.exit_code == 1
    assert "1 person of 2 could not be analysed; got '0'" in done.output
    assert "the ISIs of some.csv, 0, are all the same" in done.output
    assert Path("logs/B.mcap").exists()


@pytest.mark.usefixtures("read_here")
def test_a_person_whose_code_is_spelt_in_two_ways_is_not_replayed_by_one_of_them(isiw: Command, people: Path) -> None:
    people.write_text(people.read_text().replace("B,", "a,"))
    done = isiw("replay", people, "--reference", "impact", "--only", "A")
    assert done.exit_code == 1
    assert "differs from another one only in case" in done.output


@pytest.mark.slow
@pytest.mark.usefixtures("read_here")
def test_a_replay_takes_every_option_that_a_file_may_need(isiw: Command, people: Path) -> None:
    rows = pd.read_csv(people)
    rows = rows[rows["subject"] == "A"].drop(columns="subject")
    rows.loc[0, "isi_ms"] = -1.0
    rows.to_csv("comma.csv", index=False, sep=";", decimal=",")
    words = ("--reference", "impact", "--decimal", ",", "--seeds", 1, "--trials", 3)
    done = isiw("replay", "comma.csv", "--alone", -1, *words)
    assert done.exit_code == 0, done.output
    assert "as --alone says" not in done.output
    other = isiw("replay", "comma.csv", "--alone", -5, *words)
    assert "No trial is TMS alone: no ISI is '-5', as --alone says." in other.output


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_a_look_into_a_file_writes_no_log(isiw: Command, tmp_path: Path) -> None:
    path = as_edf(tmp_path)
    done = isiw("analyse", path, "--look", "--unmarked", "alone", "--channel", "emg=FCR", "-o", "P01.mcap")
    assert done.exit_code == 0, done.output
    assert "Proposed: isiw analyse" in done.output
    assert sorted(one.name for one in tmp_path.iterdir()) == ["P01.edf", "P01_look.png"]


@pytest.mark.usefixtures("read_here")
def test_rows_are_chosen_by_what_a_column_says(isiw: Command, people: Path) -> None:
    rows = pd.read_csv(people)
    pd.concat([rows.assign(muscle=name) for name in ("FCR", "FDI")]).to_csv("both.csv", index=False)
    words = ("replay", "both.csv", "--reference", "impact", "--seeds", 1, "--trials", 3, "--strategy", "random")
    assert "--where" in isiw(*words, "--only", "A").output
    done = isiw(*words, "--only", "A", "--where", "muscle=FDI")
    assert done.exit_code == 0, done.output
    assert "All 10 pairs" in done.output
