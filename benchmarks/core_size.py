"""How much must be read to change how a trial is learnt? Modules that one draws in, and their lines.

    python -m benchmarks.core_size --out benchmarks/results/core_size

What a module imports is followed at rest, through everything but imports for types alone; of lazy namespaces only the
modules that a name comes from. Lines are those of whole files.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import grimp
import pandas as pd
import typer

import isiw
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_tables

SCIENCE = ("isiw.models.particles", "isiw.acquisition")
PARTS = {
    "a strategy without a model": ("isiw.strategy.strategy",),
    "a loop of the lab's own, with its log": ("isiw.session.recorder",),
    "reading a log": ("isiw.log.reader",),
    "the core: these three, the default's model, acquisition functions": (
        "isiw.session.recorder",
        "isiw.log.reader",
        *SCIENCE,
    ),
    "analysis of trials that exist": ("isiw.existing.analysis",),
    "a session": ("isiw.session.loop",),
}
SOURCES = Path(isiw.__file__).parent


def lines_of(module: str) -> int:
    """Lines of a module's file."""
    path = SOURCES.joinpath(*module.split(".")[1:])
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return len(file.read_text(encoding="utf-8").splitlines())


def drawn_in(graph: grimp.ImportGraph, modules: tuple[str, ...]) -> set[str]:
    """All modules that some draw in, packages above them too."""
    left = [each for each in graph.modules if each in modules or each.startswith(tuple(f"{m}." for m in modules))]
    found: set[str] = set()
    while left:
        module = left.pop()
        if module in found:
            continue
        found.add(module)
        above = module.rpartition(".")[0]
        left += [*graph.find_modules_directly_imported_by(module), *([above] if "." in above else [])]
    return found


def main(out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("core_size")) -> None:
    """Count what each part draws in."""
    graph = grimp.build_graph("isiw", exclude_type_checking_imports=True)
    rows = []
    for name, modules in PARTS.items():
        found = drawn_in(graph, modules)
        rows.append({"part": name, "modules": len(found), "lines": sum(map(lines_of, found))})
    rows.append({"part": "isiw", "modules": len(graph.modules), "lines": sum(map(lines_of, graph.modules))})
    write_tables({"What each draws in": pd.DataFrame(rows)}, facts_of("core_size", "grimp"), out)


if __name__ == "__main__":
    understood("core_size")
    typer.run(main)
