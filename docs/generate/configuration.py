"""The keys of configuration files, from the models that read them: sessions, strategies' settings, and studies."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from docs.generate.tables import arguments, cell, code, sentence, table
from pydantic import TypeAdapter

import isiw
from isiw.config.run import RunConfig
from isiw.studies import Study, StudyStrategy


def pages() -> Iterator[tuple[str, str]]:
    """A page for sessions, one for strategies' settings, one for studies."""
    yield "configuration.md", _sessions()
    yield "settings.md", _settings()
    yield "study.md", _study()


def keys() -> dict[str, dict[str, tuple[str, str]]]:
    """Default and meaning of each key, by section; keys outside sections are in that without a name."""
    sections = {"": _fields(RunConfig)}
    for name, field in RunConfig.model_fields.items():
        if (section := _section(field.annotation)) is not None:
            del sections[""][name]
            sections[name] = _fields(section)
    return sections


def _section(annotation: Any) -> Any:
    """The class of a section; None for a plain key."""
    kinds = [annotation, *getattr(annotation, "__args__", ())]
    return next(
        (
            one
            for one in kinds
            if isinstance(one, type) and (hasattr(one, "model_fields") or dataclasses.is_dataclass(one))
        ),
        None,
    )


def _fields(section: Any) -> dict[str, tuple[str, str]]:
    meanings = {name: said for owner in reversed(section.__mro__) for name, said in arguments(owner).items()}
    if dataclasses.is_dataclass(section):
        return {one.name: (_default(one), meanings.get(one.name, "")) for one in dataclasses.fields(section)}
    return {
        name: (
            "required" if field.is_required() else _shown(field.get_default(call_default_factory=True)),
            meanings.get(name, ""),
        )
        for name, field in section.model_fields.items()
    }


def _default(one: dataclasses.Field[Any]) -> str:
    if one.default is not dataclasses.MISSING:
        return _shown(one.default)
    return "required" if one.default_factory is dataclasses.MISSING else "–"


def _shown(value: Any) -> str:
    plain = TypeAdapter(Any).dump_python(value, mode="json")
    return "–" if plain in (None, "", [], {}) else code(plain)


def _sessions() -> str:
    parts = [
        """# Configuration of a session

What `isiw run CONFIG.toml` reads. Every key may be left out unless it is required; an unknown key is an error.
"""
    ]
    for name, fields in keys().items():
        rows = [[code(key), default, cell(meaning)] for key, (default, meaning) in fields.items()]
        parts.append(
            f"\n## {f'`[{name}]`' if name else 'Outside sections'}\n\n{table(['key', 'default', 'meaning'], rows)}"
        )
    return "".join(parts) + "\nThe keys of `[strategy.settings]` are those of the [strategy](settings.md).\n"


def _settings() -> str:
    parts = [
        """# Strategies and their settings

The keys of `[strategy.settings]`, and the keywords of `isiw.make_strategy`. `isiw strategies NAME` prints the same.
"""
    ]
    families: dict[tuple[str, ...], tuple[str, dict[str, Any]]] = {}
    for name, says in isiw.list_strategies().items():
        settings = isiw.list_settings(name)
        parts.append(f"\n## `{name}`\n\n{says}\n\n")
        shape = tuple(one.key for one in settings)
        first, values = families.setdefault(shape, (name, {one.key: one.value for one in settings}))
        rows = [
            [code(one.key), "" if one.group else _shown(one.value), cell(one.unit), cell(one.meaning)]
            for one in settings
            if first == name or one.key in {"acquisition", "law", "stop_rule"}
        ]
        if first != name:
            parts.append(f"It has the settings of [`{first}`](#{first}), with other values in these:\n\n")
            rows = [
                [code(one.key), _shown(one.value), cell(one.unit), cell(one.meaning)]
                for one in settings
                if values[one.key] != one.value
            ]
        parts.append(table(["key", "default", "unit", "meaning"], rows) if rows else "")
    return "".join(parts)


def _study() -> str:
    parts = ["# Configuration of a study\n\nThe keys of STUDY.toml, which `isiw study run` reads.\n"]
    for title, kind in (("Outside sections", Study), ("Each of `strategies`", StudyStrategy)):
        meanings = arguments(kind)
        rows = [[code(one.name), _default(one), cell(meanings.get(one.name, ""))] for one in dataclasses.fields(kind)]
        parts.append(f"\n## {title}\n\n{sentence(kind)}\n\n{table(['key', 'default', 'meaning'], rows)}")
    return "".join(parts)
