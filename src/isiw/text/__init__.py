"""Text from outside: what a terminal or a page would obey is taken out, and TOML files are checked key by key."""

from isiw.text.harmless import one_line, plain

__all__ = ["one_line", "plain"]
