"""Many files and people in one call: a log each, and what is there already of an earlier call is not made again."""

from __future__ import annotations

import json
import re
import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import isiw
from isiw.design import DesignSpace
from isiw.errors import ConfigError, InvalidValueError, LogError
from isiw.existing.delivered import Delivered, codes_of, spelt_otherwise
from isiw.existing.layout import Layout
from isiw.existing.limits import ReadingLimits
from isiw.existing.reading import people_in
from isiw.files import folded, hash_of, is_reserved
from isiw.log.places import log_exists
from isiw.visit import Visit

if TYPE_CHECKING:  # a file is read, and perhaps refused, before what analyses it is loaded
    from isiw.config.run import RunConfig
    from isiw.existing.analysis import Analysis

ANALYSED_KEY: Final = "isiw_analyse"  # where a log keeps from which file and how it was made
_LONGEST_STEM: Final = 200  # what a file's name may have before its suffix [bytes]; most systems take 255 in all


class Person(NamedTuple):
    """Trials of one person, where their log goes, and what it is made of."""

    delivered: Delivered
    log: Path | None
    made_of: Mapping[str, Any]
    refused: InvalidValueError | None = None  # why they cannot be analysed, which keeps nobody else from it


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
    limits: ReadingLimits = field(default_factory=ReadingLimits)
    also: tuple[Path, ...] = ()  # files elsewhere that recordings may refer to


def way_of(config: RunConfig | None, layout: Layout, *, simulated: bool = False, **reading: Any) -> Way:
    """Space, strategy, seed and visit by which trials are analysed, and what limits reading; None has the defaults."""
    if config is None:
        return Way(layout, simulated=simulated, **reading)
    if config.prior is not None or config.after:
        what = "an analysis says what the trials themselves tell, and learns from no prior and no earlier session"
        remedy = "Leave prior and after out of the configuration."
        raise ConfigError(what, got=str(config.prior or config.after[0]), remedy=remedy)
    visit, own = config.visit, config.strategy
    space = config.space if config.space_named else None
    return Way(layout, space, own.name, config.seed, own.settings, visit.subject, visit.noted(), simulated, **reading)


def read_files(
    sources: Sequence[str | Path], way: Way, output: str | Path | None = None, only: str | None = None
) -> list[Person]:
    """The people of some files, and where their logs go: one log (.mcap), or a folder for a log of each."""
    everybody = [person for source in sources for person in _read(Path(source), way)]
    why = spelt_otherwise(one.delivered.subject for one in everybody)
    people = [one._replace(refused=why.get(code)) for one in everybody if only in {None, code := one.delivered.subject}]
    if only is not None and not people:
        expected = codes_of([one.delivered for one in everybody])
        raise InvalidValueError("no person has this code", got=only, expected=expected)
    found = _placed(people, output)
    for person in found:
        if person.log is not None and person.refused is None and log_exists(person.log) and not is_there(person):
            what = "there is another log already, and it is never overwritten"
            raise LogError(what, got=str(person.log), remedy="Choose another path, or move it away.")
    return found


def _read(source: Path, way: Way) -> Iterator[Person]:
    layout = way.layout
    if layout.reference is None and way.space is not None:
        layout = replace(layout, reference=way.space.reference)
    if way.space is not None and layout.reference != way.space.reference:
        what = "the reference of the file is not that of the design space"
        remedy = "ISIs of one cannot be compared with those of the other: correct one of them."
        raise InvalidValueError(what, got=(layout.reference, way.space.reference), remedy=remedy)
    for delivered in people_in(source, layout, way.subject, way.limits, way.also):
        beside = {name: sha256 for name, sha256 in delivered.files.items() if name != source.name}
        digest = delivered.files.get(source.name) or (hash_of(source) if source.is_file() else "")
        own, simulated = delivered.visit, way.simulated or delivered.simulated
        pct_rmt = way.visit.intensity_pct_rmt or own.intensity_pct_rmt
        visit = replace(way.visit, day=own.day or way.visit.day, intensity_pct_rmt=pct_rmt)
        made_of = {
            **({"file": source.name, "sha256": digest} | ({"beside": beside} if beside else {})),
            "layout": {key: value for key, value in asdict(layout).items() if value not in (None, {}, ())},
            "strategy": {"name": way.strategy, "seed": way.seed, "settings": dict(way.settings)},
            "space": "as delivered" if way.space is None else f"{way.space}",
            "simulated": simulated,
        }
        as_logged = json.loads(json.dumps(made_of))  # a log knows no tuples
        yield Person(replace(delivered, visit=visit, simulated=simulated), None, as_logged)


def _placed(people: Sequence[Person], output: str | Path | None) -> list[Person]:
    """People with the place of each one's log: the file that is named, or a file for each in a folder."""
    if output is None:
        return list(people)
    if Path(output).suffix == ".mcap":
        if len(people) > 1:
            what = f"there are trials of {len(people)} people or days, and a log is of one"
            remedy = "Name a folder with --output, or one of them with --only CODE."
            raise InvalidValueError(what, got=codes_of([one.delivered for one in people]), remedy=remedy)
        return [one._replace(log=Path(output)) for one in people]
    if Path(output).suffix and not Path(output).is_dir():
        what = "the output is neither a log nor a folder"
        remedy = "Name a log (.mcap), or a folder for a log of each person; make it first if its name has a full stop."
        raise InvalidValueError(what, got=str(output), remedy=remedy)
    days = [f"_day{day}" if (day := one.delivered.visit.day) else "" for one in people]
    stems = [code_in_names(one.delivered.subject) + day for one, day in zip(people, days, strict=True)]
    times = Counter(map(folded, stems))  # names that are two here may be one file on other computers
    why = (_no_log_of_its_own(stem, times[folded(stem)]) for stem in stems)
    return [one._replace(log=Path(output) / f"{stem}.mcap", refused=refused or one.refused)
            for one, stem, refused in zip(people, stems, why, strict=True)]  # fmt: skip


def code_in_names(subject: str) -> str:
    """A person's code as the name of a file can have it, which knows no `/`; an accent is part of its letter."""
    return re.sub(r"[^\w.-]+", "_", unicodedata.normalize("NFC", subject)).strip("._") or "unnamed"


def _no_log_of_its_own(stem: str, times: int) -> InvalidValueError | None:
    """Why a person's log can have no such name; None if it can."""
    if times > 1:
        what = "two of the people or days would have one log, here or on other systems"
        remedy = "Give each a code, or a day, of their own, that differs in more than capitals."
        return InvalidValueError(what, got=stem, remedy=remedy)
    if len(stem.encode()) > _LONGEST_STEM:
        return InvalidValueError("this code is too long for the name of a log", got=stem, remedy="Give a shorter one.")
    if is_reserved(f"{stem}.mcap"):
        return InvalidValueError("Windows keeps such a name for itself", got=stem, remedy="Give another code.")
    return None


def is_there(person: Person) -> bool:
    """True if the log of a person is there already, of the same file, read and analysed in the same way."""
    if person.log is None or person.refused is not None or not log_exists(person.log):
        return False
    return isiw.read_session(person.log).header.config.get(ANALYSED_KEY) == dict(person.made_of)


def analyse_person(person: Person, way: Way) -> Analysis:
    """Analyse one person, and write their log if it has a place."""
    if person.refused is not None:
        raise person.refused
    delivered = person.delivered
    stated = {"intensity_pct_rmt": delivered.visit.intensity_pct_rmt}
    settings = isiw.strategy.catalogue.known_settings(way.strategy, stated) | dict(way.settings)
    strategy = isiw.strategy.make_strategy(way.strategy, way.space or delivered.space(), way.seed, **settings)
    analysis = isiw.existing.analysed(delivered, strategy, {ANALYSED_KEY: dict(person.made_of)})
    if person.log is not None:
        analysis.to_log(person.log)
    return analysis
