"""Text: from outside, made harmless; TOML files, checked key by key; words for stimuli, numbers and what was found."""

from isiw.text.sanitize import one_line, plain

__all__ = ["one_line", "plain"]
