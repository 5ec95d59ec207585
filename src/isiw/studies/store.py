"""The folder of a study: its configuration, and a part for each unit of work that is finished.

    study.toml                   the study, its checksum, and the versions and the code that it was made with
    parts/KEY.CHECKSUM.parquet   the rows of a unit
    errors/KEY.CHECKSUM.parquet  what became of a unit that failed, one row a person

Files are renamed into their place once they are whole. The CRC-32 in a name tells whether one was damaged later, and
the checksum in a part whose study it is of. One process at a time runs a study, and has `study.toml` locked.
"""

from __future__ import annotations

import platform
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import tomli_w

import isiw
from isiw.errors import OtherVersionsWarning, StudyError, os_errors, warn
from isiw.files import TEMPORARY, put
from isiw.lazy import pa, parquet, pd
from isiw.log.durable import claim
from isiw.native import engine
from isiw.opening import opened
from isiw.studies.execution import Failure
from isiw.studies.plan import Study, Unit, begun_study, study_values
from isiw.text.sanitize import command
from isiw.text.toml_files import read_toml


@cache
def code_checksum() -> str:
    """The CRC-32 of isiw's modules, whatever their line endings, and of the sources of its compiled engine."""
    root, checksum = Path(isiw.__file__).parent, zlib.crc32(engine.sources().encode())
    for path in sorted(root.rglob("*.py")):
        checksum = zlib.crc32(path.relative_to(root).as_posix().encode(), checksum)
        checksum = zlib.crc32(path.read_bytes().replace(b"\r\n", b"\n"), checksum)
    return f"{checksum:08x}"


_KEYS: Final = ["strategy", "cohort", "person", "trial"]

_OF_STUDY: Final = b"isiw_study"
"""Where a part names its study."""


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
        """The units that are still to be run; with `retry` those that failed, too."""
        done = set(self._files("parts")) | (set() if retry else set(self._files("errors")))
        return [unit for unit in self.study.units() if unit.key not in done]

    def keep(self, unit: Unit, result: pd.DataFrame | Failure) -> None:
        """Put what a unit came to in its place, for good.

        Args:
            unit: the unit.
            result: its rows, or why there are none.

        Raises:
            StudyError: it cannot be written.
        """
        failed = isinstance(result, Failure)
        rows = _error_rows(unit, result) if isinstance(result, Failure) else result
        with _disk_errors(self.folder):
            kinds = ["errors"] if failed else ["parts", "errors"]
            outdated = {files[unit.key] for files in map(self._files, kinds) if unit.key in files}
            written = _write(self.folder / kinds[0], unit.key, rows, self._state)
            for path in outdated - {written}:
                path.unlink(missing_ok=True)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Within, this process alone runs the study; a StudyError if another one does."""
        with _disk_errors(self.folder), (self.folder / "study.toml").open("r+b") as file:
            if not claim(file):
                raise StudyError(
                    "the study is being run by another process",
                    got=str(self.folder),
                    remedy="Wait for it, or run the study in another folder.",
                )
            for unfinished in (f"*/{TEMPORARY}*", "*/*.part"):  # the latter of earlier versions
                for left_over in self.folder.glob(unfinished):
                    left_over.unlink()
            yield

    def rows(self) -> pd.DataFrame:
        """All rows of the finished units, sorted; empty if there are none."""
        return _table(self._files("parts").values(), _KEYS, self._state)

    def errors(self) -> pd.DataFrame:
        """The people whose units failed: strategy, cohort, person, unit, error, details; sorted."""
        done = self._files("parts")
        failed = (path for key, path in self._files("errors").items() if key not in done)
        return _table(failed, _KEYS[:3], self._state)

    def unit(self, key: str) -> Unit:
        """The unit of a key; a StudyError if there is none."""
        for unit in self.study.units():
            if unit.key == key:
                return unit
        raise StudyError("the study has no such unit", got=key, remedy="The rows have their units in the column unit.")

    def require_same_code(self) -> None:
        """Raise StudyError if isiw was changed since, but not its version: new rows do not belong to the others.

        Warns:
            OtherVersionsWarning: what isiw computes with has another version, so that rows may differ a little.
        """
        began_with, now = read_toml(self.folder / "study.toml").get("versions", {}), _versions()
        if (code := began_with.pop("code", None)) not in {None, now["code"]}:
            raise StudyError(
                f"isiw was changed since {self.folder} was begun: new rows may not belong to those that are there",
                got=f"code {now['code']}",
                expected=f"code {code}",
                remedy="Go back to that code, or begin in another folder. If you know that the change cannot matter, "
                "take the line `code` out of study.toml.",
            )
        others = (f"{name} {was} (now {now.get(name)})" for name, was in began_with.items() if was != now.get(name))
        if said := ", ".join(others):
            warn(f"{self.folder} was begun with {said}: new rows may differ from its others.", OtherVersionsWarning)

    @cached_property
    def _state(self) -> str:
        return _state(study_values(self.study))

    def _files(self, kind: str) -> dict[str, Path]:
        """The files of a kind, by their unit's key, in its order."""
        found = ((path.stem.rpartition(".")[0], path) for path in (self.folder / kind).glob("*.parquet"))
        return dict(sorted(found))


def begin_store(study: Study, folder: str | Path) -> Store:
    """The folder of a study, made if it is missing, continued if it is there."""
    store = Store(study, Path(folder))
    if (store.folder / "study.toml").exists():
        return _same(store, open_store(folder))
    if any(store.folder.glob("parts/*.parquet")):
        raise StudyError(
            f"{folder} has sessions of a study, but not its study.toml",
            remedy="Put that file back, or choose another folder.",
        )
    values = study_values(study)
    text = tomli_w.dumps(values | {"checksum": _state(values), "versions": _versions()})
    with _disk_errors(store.folder):
        for kind in ("parts", "errors"):
            (store.folder / kind).mkdir(parents=True, exist_ok=True)
        try:
            put(store.folder / "study.toml", text.encode(), replacing=False)
        except FileExistsError:  # somebody began here at the same moment
            return _same(store, open_store(folder))
    return store


def open_store(folder: str | Path) -> Store:
    """The folder of a study that was begun.

    Raises:
        ConfigError: its configuration cannot be read.
        StudyError: it was made with another version of isiw, or its study was changed since.
    """
    path = Path(folder) / "study.toml"
    values = read_toml(path)
    made_with = values.get("versions", {}).get("isiw")
    if made_with != isiw.__version__:
        raise StudyError(
            f"{folder} was made with another version of isiw",
            got=made_with,
            expected=isiw.__version__,
            remedy="Use that version, or begin in another folder.",
        )
    study = begun_study(values, str(path))
    if values.get("checksum") not in {None, _state(study_values(study))}:
        raise StudyError(
            f"{path} was changed since its sessions were run",
            remedy="Undo the change, or run the changed study in another folder.",
        )
    return Store(study, Path(folder))


def _versions() -> dict[str, str]:
    """The versions of what rows depend on, and the code of isiw."""
    packages = {name: version(name) for name in ("numpy", "torch", "pandas") if find_spec(name)}
    own = {"isiw": isiw.__version__, "code": code_checksum()}
    return own | packages | {"python": platform.python_version()}


def _state(values: Mapping[str, Any]) -> str:
    return _checksum(tomli_w.dumps(values).encode())


def _same(store: Store, kept: Store) -> Store:
    before, now = study_values(kept.study), study_values(store.study)
    if before != now and {**before, "strategies": _uncoded(before)} == {**now, "strategies": _uncoded(now)}:
        raise StudyError(
            f"your own code was changed since {store.folder} was begun",
            expected="the code that made the rows that are there",
            remedy="Go back to that code, or begin in another folder.",
        )
    differing = [f"{name} was {before[name]!r}, now {now[name]!r}" for name in now if before[name] != now[name]]
    if differing:
        going_on = command("study", "run", store.folder)
        raise StudyError(
            f"{store.folder} holds another study: {'; '.join(differing)}",
            remedy=f"Choose another folder, or continue the study that is there: {going_on}",
        )
    return store


def _uncoded(values: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The strategies of a study, without the checksums of one's own code."""
    return [{key: value for key, value in strategy.items() if key != "code"} for strategy in values["strategies"]]


def _error_rows(unit: Unit, failure: Failure) -> pd.DataFrame:
    people = [(one.label, one.cohort, one.person) for one in unit.sessions]
    return pd.DataFrame(people, columns=_KEYS[:3]).assign(unit=unit.key, error=failure.error, details=failure.details)


def _disk_errors(folder: Path) -> AbstractContextManager[None]:
    """Within, what the operating system refuses is a StudyError."""
    remedy = "Check its permissions and make room, then run the study again: all that is finished is kept."
    return os_errors(StudyError, "the study's folder cannot be written", folder, remedy)


def _table(paths: Iterable[Path], order: Sequence[str], state: str) -> pd.DataFrame:
    parts = [_read(path, state) for path in paths]
    if not parts:
        return pd.DataFrame()
    table: pd.DataFrame = pa.concat_tables(parts).to_pandas()
    return table.sort_values(list(order), ignore_index=True)


def _read(path: Path, state: str) -> pa.Table:
    try:
        with opened(path) as file:
            content = file.read()
        if path.suffixes[-2:-1] != [f".{_checksum(content)}"]:
            raise pa.ArrowInvalid("its checksum fails")
        part = parquet.read_table(pa.BufferReader(content))
    except (pa.ArrowException, OSError) as error:
        raise StudyError(
            f"a part of the study is damaged, or cannot be read: {error}",
            got=str(path),
            remedy="Delete that file and run the study again; only its people are computed again.",
        ) from error
    if (part.schema.metadata or {}).get(_OF_STUDY) not in {None, state.encode()}:  # None before parts named it
        raise StudyError(
            "a part in the study's folder is of another study",
            got=str(path),
            remedy="Move that file away and run the study again.",
        )
    return part


def _write(folder: Path, key: str, rows: pd.DataFrame, state: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)  # version control keeps no empty folders
    sink, part = pa.BufferOutputStream(), pa.Table.from_pandas(rows, preserve_index=False)
    parquet.write_table(part.replace_schema_metadata({**(part.schema.metadata or {}), _OF_STUDY: state}), sink)
    content = sink.getvalue().to_pybytes()
    path = folder / f"{key}.{_checksum(content)}.parquet"
    put(path, content, replacing=True)
    return path


def _checksum(content: bytes) -> str:
    return f"{zlib.crc32(content):08x}"
