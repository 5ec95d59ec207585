"""Links that no page has to write: citations, public names, and the first use of a term that the glossary explains."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

_KEY = re.compile(r"\[((?:[A-Z]|ter)[A-Za-z]+[12][0-9]{3})\b[^\]]*\]")
_NAME = re.compile(r"(isiw(?:\.\w+)+)(?:\(.*\))?$", re.DOTALL)
_NO_LINKS = (nodes.title, nodes.reference, nodes.literal, nodes.literal_block, nodes.term, nodes.rubric)


def connect(app: Any) -> None:
    """Connect it."""
    app.connect("doctree-read", _anchor_references)
    app.connect("doctree-resolved", _link)


def _anchor_references(app: Any, tree: nodes.document) -> None:
    """Each reference can be linked to by its key."""
    if app.env.docname != "references":
        return
    for item in tree.findall(nodes.list_item):
        if found := re.match(r"\[(\w+)\]", item.astext()):
            item["ids"].append(f"ref-{found[1].lower()}")


def _link(app: Any, tree: nodes.document, docname: str) -> None:
    uri = app.builder.get_relative_uri
    if docname != "references":
        _replace(tree, _KEY, lambda found: f"{uri(docname, 'references')}#ref-{found[1].lower()}")
    _link_names(app, tree, docname)
    terms = {
        name.lower(): (page, anchor)
        for name, _, kind, page, anchor, _ in app.env.domains["std"].get_objects()
        if kind == "term"
    }
    if docname.split("/", maxsplit=1)[0] in {"glossary", "results", "project", "reference", "references"} or not terms:
        return
    used: set[tuple[str, str]] = set()

    def first_use(found: re.Match[str]) -> str | None:
        target = terms[found[0].lower()]
        if target in used:
            return None
        used.add(target)
        return f"{uri(docname, target[0])}#{target[1]}"

    words = "|".join(map(re.escape, sorted(terms, key=len, reverse=True)))
    _replace(tree, re.compile(rf"\b(?:{words})\b", re.IGNORECASE), first_use, css="term-link")


def _link_names(app: Any, tree: nodes.document, docname: str) -> None:
    objects = {name: (page, anchor) for name, _, _, page, anchor, _ in app.env.domains["py"].get_objects()}
    for literal in list(tree.findall(nodes.literal)):
        found = _NAME.match(literal.astext())
        if found and found[1] in objects and not _inside(literal, (nodes.title, nodes.reference)):
            page, anchor = objects[found[1]]
            link = nodes.reference(
                "", "", internal=True, refuri=f"{app.builder.get_relative_uri(docname, page)}#{anchor}"
            )
            literal.replace_self(link)
            link += literal


def _replace(tree: nodes.document, pattern: re.Pattern[str], target: Any, css: str = "") -> None:
    """Make links of what a pattern finds in running text."""
    for text in list(tree.findall(nodes.Text)):
        if _inside(text, _NO_LINKS):
            continue
        parts: list[nodes.Node] = []
        rest, end = str(text), 0
        for found in pattern.finditer(rest):
            if (uri := target(found)) is not None:
                parts += [nodes.Text(rest[end : found.start()]), _reference(found[0], uri, css)]
                end = found.end()
        if parts:
            text.parent.replace(text, [*parts, nodes.Text(rest[end:])])


def _reference(words: str, uri: str, css: str) -> nodes.reference:
    return nodes.reference("", words, internal=True, refuri=uri, classes=[css] if css else [])


def _inside(node: nodes.Node, kinds: tuple[type[nodes.Node], ...]) -> bool:
    while (node := node.parent) is not None:
        if isinstance(node, kinds):
            return True
    return False
