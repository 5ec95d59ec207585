"""The folder of a study."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from isiw.design import DesignSpace
from isiw.errors import ConfigError, OtherVersionsWarning, StudyError
from isiw.native import engine
from isiw.studies.execution import Failure
from isiw.studies.plan import Unit, load_study
from isiw.studies.store import Store, begin_store, code_checksum, open_store
from studies.tiny import tiny


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return begin_store(tiny(), tmp_path / "s")


def rows_of(unit: Unit) -> pd.DataFrame:
    """Rows as a unit may have come to."""
    (session,) = unit.sessions
    keys = {"strategy": session.label, "cohort": session.cohort, "person": session.person, "unit": unit.key}
    return pd.DataFrame([keys | {"trial": trial, "f1": trial / 10} for trial in (4, 2)])


def test_a_unit_is_left_until_it_is_kept(store: Store) -> None:
    units = store.left()
    assert units == store.study.units()
    store.keep(units[1], rows_of(units[1]))
    assert store.left() == [units[0], *units[2:]]
    assert open_store(store.folder).left() == store.left()


def test_a_study_is_not_continued_with_another_engine(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.require_same_code()
    monkeypatch.setattr(engine, "sources", lambda: "0123456789abcdef")
    code_checksum.cache_clear()
    try:
        with pytest.raises(StudyError, match="isiw was changed since"):
            store.require_same_code()
    finally:
        code_checksum.cache_clear()


def test_rows_come_sorted_whatever_the_order_in_which_units_were_finished(store: Store) -> None:
    for unit in reversed(store.left()):
        store.keep(unit, rows_of(unit))
    rows = store.rows()
    keys = list(rows[["strategy", "cohort", "person", "trial"]].itertuples(index=False, name=None))
    assert keys == sorted(keys)
    assert len(rows) == 2 * len(store.study.units())


def test_a_failed_unit_is_run_again_only_where_that_is_wanted_and_its_error_goes_with_success(store: Store) -> None:
    unit = store.left()[0]
    store.keep(unit, Failure("ValueError: no air", "a traceback"))
    assert store.errors()[["unit", "error", "details"]].to_numpy().tolist() == [
        [unit.key, "ValueError: no air", "a traceback"]
    ]
    assert unit not in store.left()
    assert unit in store.left(retry=True)
    store.keep(unit, rows_of(unit))
    assert len(store.errors()) == 0
    assert unit not in store.left(retry=True)


def test_without_finished_units_there_are_no_rows(store: Store) -> None:
    assert store.rows().empty
    assert store.errors().empty


def test_an_unknown_unit_is_refused(store: Store) -> None:
    known = store.study.units()[2]
    assert store.unit(known.key) == known
    with pytest.raises(StudyError, match="no such unit"):
        store.unit("nobody")


def test_a_write_that_was_cut_off_is_no_part(store: Store) -> None:
    unit = store.left()[0]
    (store.folder / "parts" / f"{unit.key}.parquet.part").write_bytes(b"half of it")
    assert store.rows().empty
    assert unit in store.left()
    store.keep(unit, rows_of(unit))
    assert unit not in store.left()


def test_a_study_that_was_changed_in_its_folder_is_refused(store: Store) -> None:
    file = store.folder / "study.toml"
    text = file.read_text()
    changed = re.sub(r"(?m)^seed = .*$", "seed = 77", text)
    assert changed != text
    file.write_text(changed)
    with pytest.raises(StudyError, match="was changed"):
        open_store(store.folder)
    file.write_text("# a remark\n" + text)
    assert open_store(store.folder).study == store.study


def test_a_folder_of_before_there_was_a_checksum_can_be_opened(store: Store) -> None:
    file = store.folder / "study.toml"
    file.write_text(re.sub(r"(?m)^checksum = .*$", "", file.read_text()))
    assert open_store(store.folder).study == store.study


def test_a_part_of_another_study_is_refused(store: Store, tmp_path: Path) -> None:
    other = begin_store(replace(store.study, seed=store.study.seed + 1), tmp_path / "other")
    unit = other.left()[0]
    other.keep(unit, rows_of(unit))
    (part,) = (other.folder / "parts").iterdir()
    shutil.copy(part, store.folder / "parts")
    with pytest.raises(StudyError, match="is of another study") as refused:
        store.rows()
    assert part.name in str(refused.value)
    assert len(other.rows()) == 2


def test_sessions_without_their_study_are_not_taken_for_another_ones(store: Store) -> None:
    unit = store.left()[0]
    store.keep(unit, rows_of(unit))
    (store.folder / "study.toml").unlink()
    with pytest.raises(StudyError, match=r"not its study\.toml"):
        begin_store(store.study, store.folder)


def test_empty_folders_that_version_control_left_out_are_made_again(store: Store) -> None:
    for kind in ("parts", "errors"):
        (store.folder / kind).rmdir()
    kept, failed = store.left()[:2]
    store.keep(kept, rows_of(kept))
    store.keep(failed, Failure("ValueError: no air"))
    again = open_store(store.folder)
    assert (len(again.rows()), len(again.errors())) == (2, 1)


def test_a_folder_that_other_code_began_is_read_and_not_gone_on_with(store: Store) -> None:
    path = store.folder / "study.toml"
    path.write_text(re.sub(r'code = "\w+"', 'code = "00000000"', path.read_text()))
    again = open_store(store.folder)
    with pytest.raises(StudyError, match="was changed since"):
        again.require_same_code()
    path.write_text(re.sub(r'code = "\w+"\n', "", path.read_text()))
    again.require_same_code()
    path.write_text(re.sub(r'numpy = ".+"', 'numpy = "1.0.0"', path.read_text()))
    with pytest.warns(OtherVersionsWarning, match=r"was begun with numpy 1\.0\.0 \(now "):
        again.require_same_code()


def test_no_part_is_written_through_a_link_and_left_overs_go_with_the_next_run(store: Store) -> None:
    victim, unit = store.folder / "victim", store.left()[0]
    victim.write_text("precious")
    (store.folder / "parts" / f"{unit.key}.part").symlink_to(victim)
    (store.folder / "parts" / ".isiw-0123").write_text("cut off")
    store.keep(unit, rows_of(unit))
    with store.locked():
        pass
    assert victim.read_text() == "precious"
    assert [path.suffix for path in (store.folder / "parts").iterdir()] == [".parquet"]
    assert len(store.rows()) == 2


def test_a_begun_study_whose_space_has_no_reference_counts_from_the_impact(tmp_path: Path) -> None:
    begin_store(tiny(space=DesignSpace(0, 100, reference="impact")), tmp_path)
    kept = (tmp_path / "study.toml").read_text()
    (tmp_path / "study.toml").write_text(kept.replace('reference = "impact"\n', ""))
    assert open_store(tmp_path).study.space.reference == load_study(tmp_path / "study.toml").space.reference == "impact"
    new = 'strategies = ["even"]\ncohorts = ["recruitment"]\nspace = { low_ms = 0, high_ms = 9 }'
    (tmp_path / "new.toml").write_text(new)
    with pytest.raises(ConfigError, match=r"space.*needs its reference"):
        load_study(tmp_path / "new.toml")
