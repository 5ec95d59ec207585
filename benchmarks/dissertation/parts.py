"""A part of the gallery: what it tells, and how it is kept, so that a run that was interrupted goes on after it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from benchmarks.dissertation.claims import REPRODUCED, Claim, claims_as_json
from benchmarks.dissertation.size import Size
from benchmarks.provenance import facts_of

__all__ = ["Told", "keep", "kept", "verdict"]

VERSIONS: Final = ("numpy", "scipy", "torch", "scikit-learn", "matplotlib")


@dataclass(frozen=True, eq=False)
class Told:
    """What a part tells.

    Args:
        note: where its data come from, and what that means, in a sentence or two.
        claims: what the text says and what comes out here.
        pictures: by the table or figure that they stand beside, such as "Fig. 3.8".
    """

    note: str
    claims: Sequence[Claim]
    pictures: Mapping[str, Figure] = field(default_factory=dict)


def verdict(*, holds: bool, otherwise: str) -> str:
    """The verdict "reproduced" where a comparison holds.

    Args:
        holds: the comparison.
        otherwise: what to say else: "not, because …" or "under reading …".
    """
    return REPRODUCED if holds else otherwise


def kept(path: Path, size: Size, seed: int) -> bool:
    """Whether a part lies there already, of the same size and seed.

    Args:
        path: its JSON file.
        size: how much is to be run.
        seed: the seed.
    """
    if not path.exists():
        return False
    facts = json.loads(path.read_text())["facts"]
    return bool(facts["size"] == asdict(size) and facts["seed"] == seed)


def keep(tell: Callable[[Size, int], Told], path: Path, size: Size, seed: int) -> None:
    """Run a part and keep its claims as JSON, with its pictures beside it.

    Args:
        tell: the part.
        path: of the JSON file.
        size: how much is run.
        seed: the first seed.
    """
    began_s = time.monotonic()
    told = tell(size, seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    names = {place: _save(picture, path, place) for place, picture in told.pictures.items()}
    facts = facts_of("dissertation", *VERSIONS, seed=seed, size=asdict(size))
    facts |= {"minutes": round((time.monotonic() - began_s) / 60, 1)}
    content = {"facts": facts, "note": told.note, "claims": claims_as_json(told.claims), "pictures": names}
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def _save(picture: Figure, path: Path, place: str) -> str:
    kind, number = place.split()
    name = f"{kind.rstrip('.').lower()}_{number.replace('.', '_')}.png"
    picture.savefig(path.with_name(name), dpi=70)
    return name
