"""The folder of a study: its configuration, and a part for each unit of work that is finished.

    study.toml            the study, and the versions that it was made with
    parts/KEY.parquet     the rows of a unit
    errors/KEY.parquet    what became of a unit that failed, one row a person

Each file is written beside its place, synced, and renamed into it by the process that runs the study, so that a file
is whole or not there. What is left over of a write that was cut off is written over when the unit is run again.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w
import torch

import isiw
from isiw.errors import StudyError
from isiw.log.durable import part_of, sync_folder
from isiw.studies.execution import Failure
from isiw.studies.plan import Study, Unit, study_from, study_values
from isiw.toml_files import read_toml

__all__ = ["Store", "begin_store", "open_store"]

_KEYS: Final = ["strategy", "cohort", "person", "trial"]


@dataclass(frozen=True)
class Store:
    """A study and its folder.

    Args:
        study: the study.
        folder: where its parts are.
    """

    study: Study
    folder: Path

    def left(self, *, retry: bool = False) -> list[Unit]:
        """The units that are still to be run.

        Args:
            retry: run those that failed once more.
        """
        done = self._keys("parts") | (set() if retry else self._keys("errors"))
        return [unit for unit in self.study.units() if unit.key not in done]

    def keep(self, unit: Unit, result: pd.DataFrame | Failure) -> None:
        """Put what a unit came to in its place, for good.

        Args:
            unit: the unit.
            result: its rows, or why there are none.
        """
        error = self._path("errors", unit.key)
        if isinstance(result, Failure):
            _write(error, _error_rows(unit, result))
            return
        _write(self._path("parts", unit.key), result)
        error.unlink(missing_ok=True)

    def rows(self) -> pd.DataFrame:
        """All rows of the finished units, sorted; empty where there are none."""
        return self._table("parts", self._keys("parts"), _KEYS)

    def errors(self) -> pd.DataFrame:
        """The people whose units failed: strategy, cohort, person, unit, error, details; sorted."""
        return self._table("errors", self._keys("errors") - self._keys("parts"), _KEYS[:3])

    def unit(self, key: str) -> Unit:
        """The unit of a key.

        Raises:
            StudyError: there is none.
        """
        for unit in self.study.units():
            if unit.key == key:
                return unit
        raise StudyError("the study has no such unit", got=key, remedy="The rows have their units in the column unit.")

    def _path(self, kind: str, key: str) -> Path:
        return self.folder / kind / f"{key}.parquet"

    def _keys(self, kind: str) -> set[str]:
        return {path.stem for path in (self.folder / kind).glob("*.parquet")}

    def _table(self, kind: str, keys: set[str], order: Sequence[str]) -> pd.DataFrame:
        if not keys:
            return pd.DataFrame()
        parts = [_read(self._path(kind, key)) for key in sorted(keys)]
        table: pd.DataFrame = pa.concat_tables(parts).to_pandas()
        return table.sort_values(list(order), ignore_index=True)


def begin_store(study: Study, folder: str | Path) -> Store:
    """The folder of a study, made where it is missing, gone on with where it is there.

    Args:
        study: the study.
        folder: where its results are.

    Raises:
        StudyError: the folder is another study's, or was made with another version of isiw.
    """
    store = Store(study, Path(folder))
    if (store.folder / "study.toml").exists():
        return _same(store, open_store(folder))
    for kind in ("parts", "errors"):
        (store.folder / kind).mkdir(parents=True, exist_ok=True)
    text = tomli_w.dumps(study_values(study) | {"versions": _versions()})
    _replace(store.folder / "study.toml", text.encode())
    return store


def open_store(folder: str | Path) -> Store:
    """The folder of a study that was begun.

    Raises:
        ConfigError: its configuration cannot be read.
        StudyError: it was made with another version of isiw.
    """
    path = Path(folder) / "study.toml"
    values = read_toml(path)
    made_with = values.pop("versions", {}).get("isiw")
    if made_with != isiw.__version__:
        raise StudyError(
            f"{folder} was made with another version of isiw",
            got=made_with,
            expected=isiw.__version__,
            remedy="Use that version, or begin in another folder.",
        )
    return Store(study_from(values, str(path)), Path(folder))


def _same(store: Store, kept: Store) -> Store:
    before, now = study_values(kept.study), study_values(store.study)
    differing = [f"{name} was {before[name]!r}, now {now[name]!r}" for name in now if before[name] != now[name]]
    if differing:
        raise StudyError(
            f"{store.folder} holds another study: {'; '.join(differing)}",
            remedy=f"Choose another folder, or go on with the study that is there: isiw study run {store.folder}",
        )
    return store


def _versions() -> dict[str, str]:
    made_with = {module.__name__: str(module.__version__) for module in (isiw, np, torch, pd)}
    return made_with | {"python": platform.python_version()}


def _error_rows(unit: Unit, failure: Failure) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "strategy": session.label,
            "cohort": session.cohort,
            "person": session.person,
            "unit": unit.key,
            "error": failure.error,
            "details": failure.details,
        }
        for session in unit.sessions
    )


def _read(path: Path) -> pa.Table:
    try:
        return pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise StudyError(
            f"a part of the study is damaged, or cannot be read: {error}",
            got=str(path),
            remedy="Delete that file and run the study again; only its people are computed anew.",
        ) from error


def _write(path: Path, rows: pd.DataFrame) -> None:
    sink = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_pandas(rows, preserve_index=False), sink)
    _replace(path, sink.getvalue().to_pybytes())


def _replace(path: Path, content: bytes) -> None:
    with part_of(path).open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    part_of(path).replace(path)
    sync_folder(path.parent)
