"""The size of the house: tests that pin whole sentences, and guards: `python -m benchmarks.house [TESTS [SOURCE]]`.

A test pins a sentence if an assert in it, or a `match=` of `pytest.raises` or `pytest.warns`, has a text of at least
six words that ends with a full stop, a question mark, or, in `match=`, anyhow. What a test means can be asserted by the
kind of a finding, of a decision or of an error.

A guard is code that does nothing but refuse: an `if` whose body only raises, a call of a check of `self`, and a
`__post_init__` around nothing else.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from benchmarks.quick import understood

WORDS = 6
ROOT = Path(__file__).parents[1]


def is_sentence(text: str, *, anyhow: bool) -> bool:
    """Whether a text is a whole sentence; one that is matched needs no full stop."""
    return len(re.findall(r"[^\W\d_]+", text)) >= WORDS and (anyhow or text.rstrip().endswith((".", "?")))


def texts(node: ast.AST) -> Iterator[str]:
    """The texts within some code; what is filled into one counts as a word."""
    for part in ast.walk(node):
        if isinstance(part, ast.JoinedStr):
            yield "".join(each.value if isinstance(each, ast.Constant) else "x" for each in part.values)
        elif isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield part.value


def pins(test: ast.AST) -> bool:
    """Whether a test pins a sentence, in its body or its parameters."""
    said: list[tuple[ast.AST, bool]] = []
    for part in ast.walk(test):
        if isinstance(part, ast.Assert):
            said.append((part.test, False))
        elif isinstance(part, ast.keyword) and part.arg == "match":
            said.append((part.value, True))
        elif isinstance(part, ast.FunctionDef):
            said += [(made, False) for made in part.decorator_list]
    return any(is_sentence(text, anyhow=anyhow) for node, anyhow in said for text in texts(node))


def counted(folder: Path) -> tuple[int, Counter[str]]:
    """How many tests there are, and how many of each room pin a sentence."""
    total, pinned = 0, Counter[str]()
    for path in sorted(folder.rglob("test_*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                total += 1
                pinned[path.relative_to(folder).parts[0]] += pins(node)
    return total, pinned


def is_check(node: ast.AST) -> bool:
    """Whether a statement only calls a check of `self`, or of what it inherits."""
    call = node.value if isinstance(node, ast.Expr) else None
    return isinstance(call, ast.Call) and (
        ast.unparse(call.func) == "super().__post_init__"
        or (ast.unparse(call.func).startswith("check_") and bool(call.args) and ast.unparse(call.args[0]) == "self")
    )


def guards(folder: Path) -> Counter[str]:
    """Modules and lines of a package, and its guards by their kind with the lines that they take."""
    count = Counter[str]()
    for path in sorted(folder.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        count["modules"] += 1
        count["lines"] += len(text.splitlines())
        for node in ast.walk(ast.parse(text)):
            refuses = isinstance(node, ast.If) and not node.orelse and all(isinstance(x, ast.Raise) for x in node.body)
            only_checks = (
                isinstance(node, ast.FunctionDef) and node.name == "__post_init__" and all(map(is_check, node.body))
            )
            for kind, found in (("refusals", refuses), ("checks", is_check(node)), ("only checks", only_checks)):
                if found:
                    count[kind] += 1
                    count["lines of guards"] += 1 if only_checks else node.end_lineno - node.lineno + 1
    return count


def main() -> None:
    """Count the tests and the package of this checkout, or of other folders."""
    total, pinned = counted(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "tests")
    for room, count in pinned.most_common():
        if count:
            print(f"{count:4} {room}")
    print(f"{pinned.total()} of {total} tests pin a whole sentence")
    print(dict(guards(Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "src" / "isiw")))


if __name__ == "__main__":
    understood("house", prints=True)
    main()
