"""Faults for `benchmarks.mutations`: what cosmic-ray can make of a source, without what no test could find."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from difflib import SequenceMatcher
from typing import Any, Final, NamedTuple

import numpy as np

QUIET: Final = {"cache", "cached_property", "final", "lru_cache", "overload", "override"}
"""Decorators without which everything is as before, but slower or without its types."""


class Fault(NamedTuple):
    """Lines of a module, and what stands there instead."""

    module: str
    line: int
    operator: str
    before: list[str]
    after: list[str]

    def made_in(self, source: str) -> str:
        """A source with the fault, where its lines are nearest to where they were; it has to have them."""
        lines, size = source.splitlines(), len(self.before)
        places = [n for n in range(len(lines)) if lines[n : n + size] == self.before]
        place = min(places, key=lambda n: abs(n + 1 - self.line))
        return "\n".join([*lines[:place], *self.after, *lines[place + size :], ""])


def drawn(sources: Mapping[str, str], number: int, seed: int) -> list[Fault]:
    """Faults at different places, each place as likely as any other.

    Args:
        sources: by their modules.
        number: how many.
        seed: of the draw.
    """
    import cosmic_ray.ast  # noqa: PLC0415 - tests import this module without the extra
    import cosmic_ray.mutating  # noqa: PLC0415 - same
    import cosmic_ray.plugins  # noqa: PLC0415 - same

    names = [name for name in cosmic_ray.plugins.operator_names() if not name.startswith("core/Variable")]
    operators = {name: cosmic_ray.plugins.get_operator(name)() for name in names}
    places: dict[tuple[str, tuple[int, int]], list[tuple[str, int]]] = {}
    for module, source in sources.items():
        made = dict.fromkeys(operators, 0)
        for node in cosmic_ray.ast.ast_nodes(cosmic_ray.ast.get_ast(source)):
            for name, operator in operators.items():
                for begin, _ in operator.mutation_positions(node):
                    places.setdefault((module, begin), []).append((name, made[name]))
                    made[name] += 1
    quiet, rng, faults = {module: _quiet(source) for module, source in sources.items()}, np.random.default_rng(seed), []
    ordered = sorted(places)
    for place in rng.permutation(len(ordered)):
        module, at = ordered[place]
        found, source = places[module, at], sources[module]
        name, occurrence = found[rng.integers(len(found))]
        around = [numbers for begin, end, numbers in quiet[module] if begin <= at < end]
        if len(faults) < number and all(numbers and name == "core/NumberReplacer" for numbers in around):
            changed = cosmic_ray.mutating.mutate_code(source, operators[name], occurrence)
            faults += _between(module, name.removeprefix("core/"), source, changed)
    return faults


def _between(module: str, operator: str, source: str, changed: str) -> Iterator[Fault]:
    """What differs; nothing where that is layout alone, or is no Python."""
    try:
        same = ast.dump(ast.parse(changed)) == ast.dump(ast.parse(source))
    except SyntaxError:
        return
    if not same:
        old, new = source.splitlines(), changed.splitlines()
        ops = [each for each in SequenceMatcher(None, old, new, autojunk=False).get_opcodes() if each[0] != "equal"]
        begin, end = ops[0][1], ops[-1][2]
        line = next(n for n in range(begin, end) if old[n].strip()) + 1
        yield Fault(module, line, operator, old[begin:end], new[ops[0][3] : ops[-1][4]])


def _quiet(source: str) -> list[tuple[tuple[int, int], tuple[int, int], bool]]:
    """From where to where no test could find a fault, and whether one of a number it could, as in a field's bounds."""
    found: list[tuple[Any, bool]] = []
    for node in ast.walk(ast.parse(source)):
        field = isinstance(node, ast.AnnAssign)
        found += [(getattr(node, part, None), field) for part in ("returns", "annotation")]
        found += [(each, False) for each in getattr(node, "decorator_list", ()) if QUIET & _names(each)]
        typed = isinstance(node, ast.If) and "TYPE_CHECKING" in _names(node.test)
        alias = isinstance(node, ast.AnnAssign) and "TypeAlias" in _names(node.annotation)
        if typed or alias or (isinstance(node, ast.Assign) and "__all__" in _names(node)):
            found.append((node, False))
    return [
        ((each.lineno, each.col_offset - 1), (each.end_lineno, each.end_col_offset), numbers)
        for each, numbers in found
        if each is not None
    ]


def _names(node: ast.AST) -> set[str]:
    return {getattr(each, "id", getattr(each, "attr", "")) for each in ast.walk(node)}


def statement(source: str, line: int) -> range:
    """The lines of the statement that a line is of; of a compound one without what is in it."""
    every = [each for each in ast.walk(ast.parse(source)) if isinstance(each, ast.stmt)]
    inner: Any = max(
        (s for s in every if s.lineno <= line <= (s.end_lineno or 0)), key=lambda s: s.lineno, default=None
    )
    if inner is None:
        return range(line, line + 1)
    last = inner.body[0].lineno - 1 if hasattr(inner, "body") else inner.end_lineno
    return range(inner.lineno, last + 1) if line <= last else range(line, line + 1)
