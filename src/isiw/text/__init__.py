"""Text: from outside, without what a terminal or a page would obey; TOML files, checked key by key; what was found."""

from isiw.text.harmless import one_line, plain

__all__ = ["one_line", "plain"]
