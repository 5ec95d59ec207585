"""Many files and people in one call: a log each, and what is there already of an earlier call is not made again."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from isiw.config.run import RunConfig
from isiw.design import DesignSpace
from isiw.errors import ConfigError, InvalidValueError, LogError
from isiw.existing.analysis import Analysis, analysed
from isiw.existing.delivered import Delivered, codes_of
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people
from isiw.files import opened
from isiw.log.durable import log_exists
from isiw.log.reader import read_session
from isiw.strategy.catalogue import make_strategy
from isiw.visit import Visit

ANALYSED_KEY: Final = "isiw_analyse"
"""Where a log keeps from which file and how it was made."""


class Person(NamedTuple):
    """Trials of one person, where their log goes, and what it is made of."""

    delivered: Delivered
    log: Path | None
    made_of: Mapping[str, Any]


@dataclass(frozen=True)
class Way:
    """Settings by which trials are read and analysed."""

    layout: Layout = field(default_factory=Layout)
    space: DesignSpace | None = None  # the range of the ISIs that were delivered
    strategy: str = "default"
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    subject: str = ""  # of a person who has no code in the file
    visit: Visit = field(default_factory=Visit)
    simulated: bool = False


def way_of(config: RunConfig, layout: Layout, *, simulated: bool = False) -> Way:
    """Space, strategy, seed and visit of a configuration, by which trials are analysed."""
    if config.prior is not None or config.after:
        raise ConfigError(
            "an analysis says what the trials themselves tell, and learns from no prior and no earlier session",
            got=str(config.prior or config.after[0]),
            remedy="Leave prior and after out of the configuration.",
        )
    return Way(
        layout,
        config.space.design() if config.space_named else None,
        config.strategy.name,
        config.seed,
        config.strategy.settings,
        config.visit.subject,
        config.visit.noted(),
        simulated,
    )


def read_files(
    sources: Sequence[str | Path], way: Way, output: str | Path | None = None, only: str | None = None
) -> list[Person]:
    """The people of some files, and where their logs go: one log (.mcap), or a folder for a log of each."""
    everybody = [person for source in sources for person in _read(Path(source), way)]
    people = [one for one in everybody if only in {None, one.delivered.subject}]
    if only is not None and not people:
        codes = codes_of([one.delivered for one in everybody])
        raise InvalidValueError("no person has this code", got=only, expected=codes)
    paths = _paths([one.delivered for one in people], output)
    found = [one._replace(log=path) for one, path in zip(people, paths, strict=True)]
    for person in found:
        if person.log is not None and log_exists(person.log) and not is_there(person):
            raise LogError(
                "there is another log already, and it is never overwritten",
                got=str(person.log),
                remedy="Choose another path, or move it away.",
            )
    return found


def _read(source: Path, way: Way) -> Iterator[Person]:
    layout = way.layout
    if layout.reference is None and way.space is not None:
        layout = replace(layout, reference=way.space.reference)
    if way.space is not None and layout.reference != way.space.reference:
        raise InvalidValueError(
            "the reference of the file is not that of the design space",
            got=(layout.reference, way.space.reference),
            remedy="ISIs of one cannot be compared with those of the other: correct one of them.",
        )
    people = read_people(source, layout, subject=way.subject)
    digest = _sha256(source)
    for delivered in people:
        visit = replace(way.visit, day=delivered.visit.day or way.visit.day)
        simulated = way.simulated or delivered.simulated
        made_of = {
            "file": source.name,
            "sha256": digest,
            "layout": {key: value for key, value in asdict(layout).items() if value not in (None, {}, ())},
            "strategy": {"name": way.strategy, "seed": way.seed, "settings": dict(way.settings)},
            "space": "as delivered" if way.space is None else f"{way.space}",
            "simulated": simulated,
        }
        as_logged = json.loads(json.dumps(made_of))  # a log knows no tuples
        yield Person(replace(delivered, visit=visit, simulated=simulated), None, as_logged)


def _sha256(source: Path) -> str:
    """The hash of a file, which may be larger than the memory."""
    digest = hashlib.sha256()
    with opened(source) as file:
        while block := file.read(2**20):
            digest.update(block)
    return digest.hexdigest()


def _paths(people: Sequence[Delivered], output: str | Path | None) -> list[Path | None]:
    """Where the logs go: the file that is named, or a file for each in a folder."""
    if output is None:
        return [None] * len(people)
    if Path(output).suffix == ".mcap":
        if len(people) > 1:
            raise InvalidValueError(
                f"there are trials of {len(people)} people or days, and a log is of one",
                got=codes_of(people),
                remedy="Name a folder with --output, or one of them with --only CODE.",
            )
        return [Path(output)]
    codes = [re.sub(r"[^\w.-]+", "_", one.subject).strip("._") or "unnamed" for one in people]
    days = [f"_day{one.visit.day}" if one.visit.day else "" for one in people]
    stems = list(map(str.__add__, codes, days))
    twice = sorted({stem for stem in stems if stems.count(stem) > 1})
    if twice:
        raise InvalidValueError(
            "two of the people or days would have one log",
            got=twice[0],
            remedy="Give each a code, or a day, of their own.",
        )
    return [Path(output) / f"{stem}.mcap" for stem in stems]


def is_there(person: Person) -> bool:
    """True if the log of a person is there already, of the same file, read and analysed in the same way."""
    if person.log is None or not log_exists(person.log):
        return False
    return read_session(person.log).header.config.get(ANALYSED_KEY) == dict(person.made_of)


def analyse_person(person: Person, way: Way) -> Analysis:
    """Analyse one person, and write their log if it has a place."""
    delivered = person.delivered
    strategy = make_strategy(way.strategy, way.space or delivered.space(), way.seed, **way.settings)
    analysis = analysed(delivered, strategy, {ANALYSED_KEY: dict(person.made_of)})
    if person.log is not None:
        analysis.to_log(person.log)
    return analysis
