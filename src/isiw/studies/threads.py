"""One torch thread for a session, and as many as before after it."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from isiw.lazy import torch


@contextmanager
def one_torch_thread() -> Generator[None, None, None]:
    """Have torch compute with one thread, without which the same session may come to other numbers, until the end."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
