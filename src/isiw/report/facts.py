"""What a session is: who, when, with what, within which limits, and by which versions, a line each."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from isiw.devices.limits import Limits
from isiw.log.reader import SessionRecord


class Fact(NamedTuple):
    """One thing that is known of a session."""

    name: str
    value: str


def first_facts(record: SessionRecord) -> list[Fact]:
    """Subject, date, device, limits, strategy with its seed, and version, a line each whatever is in them.

    Args:
        record: the session.
    """
    header = record.header
    versions = ", ".join(f"{package} {version}" for package, version in header.versions.items())
    told = {
        "subject": _subject(record),
        "date": header.created.replace("T", " ").replace("+00:00", " UTC"),
        "device": _device(record),
        "limits": _limits(header.limits),
        "strategy": f"{header.strategy.name or 'of own objects'}, seed {header.strategy.seed}",
        "version": f"isiw {header.isiw_version}" + (f" ({versions})" if versions else ""),
    }
    parts = {"date": "created", "version": "isiw_version"}
    return [Fact(name, " ".join(_read(record, parts.get(name, name), value).split())) for name, value in told.items()]


def further_facts(record: SessionRecord) -> list[Fact]:
    """The rest of what the log's header says: visit, ISIs, judgement, protocol."""
    header = record.header
    groups = {
        "visit": header.visit,
        "ISIs": header.space.told(header.stimulus),
        "tolerance": f"{header.space.tolerance_ms:g} ms",
        "judgement of a sweep": header.signals,
        "protocol": header.protocol,
        "deadline of a delivery": f"{header.timeout_s:g} s",
        "deadline of a choice": "none" if header.ask_deadline_s is None else f"{header.ask_deadline_s:g} s",
        "log": f"{record.path.name}, schema {header.schema_version}",
    }
    told = {name: value if isinstance(value, str) else _fields(value) for name, value in groups.items()}
    parts = {
        "judgement of a sweep": "signals",
        "deadline of a delivery": "timeout_s",
        "deadline of a choice": "ask_deadline_s",
    }
    return [Fact(name, _read(record, parts.get(name, name), value)) for name, value in told.items() if value]


def settings_facts(record: SessionRecord) -> list[Fact]:
    """The strategy's settings, those of a group with dots, as a configuration can have them."""
    return [
        Fact(key, json.dumps(value, ensure_ascii=False))
        for key, value in _flat(record.header.strategy.settings).items()
    ]


def _read(record: SessionRecord, part: str, value: str) -> str:
    """What is said of a part of the header, unless it cannot be read: then what it is by default says nothing."""
    return "cannot be read by this version of isiw" if part in record.unread else value


def _subject(record: SessionRecord) -> str:
    visit = record.header.visit
    parts = [record.header.subject or "not named"]
    parts += [f"day {visit.day}"] if visit.day is not None else []
    parts += [f"operator {visit.operator}"] if visit.operator else []
    return ", ".join(parts)


def _device(record: SessionRecord) -> str:
    info = record.header.device
    parts = [info.name, *([f"version {info.version}"] if info.version else [])]
    parts += [f"at {info.address}"] if info.address else []
    return ", ".join([*parts, "simulated: nobody was stimulated" if info.simulated else "real"])


def _limits(limits: Limits) -> str:
    said = [
        f"ISIs of {limits.low_ms:g}–{limits.high_ms:g} ms",
        f"at most {limits.max_pulses} stimuli",
        f"at least {limits.min_iti_s:g} s apart",
        f"a pause after {limits.max_consecutive_mistrials} mistrials in a row",
    ]
    if limits.max_block_pulses is not None:
        said.append(f"a rest of {limits.rest_s:g} s after {limits.max_block_pulses} stimuli")
    if limits.max_period_pulses is not None:
        said.append(f"at most {limits.max_period_pulses} in {limits.period_s:g} s")
    if limits.max_coil_c is not None:
        said.append(f"a coil of at most {limits.max_coil_c:g} °C")
    if limits.intensity_pct_mso is not None:
        said.append(f"only at {limits.intensity_pct_mso:g} % MSO")
    return ", ".join(said)


def _fields(settings: Any) -> str:
    """The fields of a dataclass that are set, in words."""
    values = dataclasses.asdict(settings)
    return ", ".join(f"{name} {_value(value)}" for name, value in values.items() if value not in (None, ""))


def _value(value: Any) -> str:
    if isinstance(value, tuple | list):
        return "–".join(map(_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _flat(settings: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in settings.items():
        name = f"{before}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, Mapping) else {name: value}
    return flat
