"""Libraries that are imported when first used, and fields of values that are worked out when somebody looks at them.

Torch takes 2 s and 500 MB, pandas and SciPy half a second each: a command that only reads a log waits for none of them.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

__all__ = ["botorch", "gpytorch", "pa", "parquet", "pd", "pyro", "scipy", "sklearn", "torch"]


class _Library:
    """A library that stays out of `sys.modules` until it is used, since others look there for what is in use."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        with warnings.catch_warnings():
            # GPyTorch's stack compiles functions with torch.jit.script as it is imported, which torch has deprecated;
            # whoever imports isiw can do nothing about it.
            for category in (FutureWarning, DeprecationWarning):
                warnings.filterwarnings("ignore", message=r".*torch\.jit\.script.*", category=category)
            value = getattr(importlib.import_module(self._name), name)
        setattr(self, name, value)  # found at once from now on
        return value


if TYPE_CHECKING:
    import botorch
    import gpytorch
    import pandas as pd
    import pyarrow as pa
    import pyro
    import scipy
    import sklearn
    import torch
    from pyarrow import parquet
else:
    botorch, gpytorch, pyro, torch = map(_Library, ("botorch", "gpytorch", "pyro", "torch"))
    pa, parquet, pd = map(_Library, ("pyarrow", "pyarrow.parquet", "pandas"))
    scipy, sklearn = map(_Library, ("scipy", "sklearn"))


T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Later(Generic[T]):
    """A value that its `work` gives when it is first looked at."""

    work: Callable[[], T]


class WorkedOut(Generic[T]):
    """A field that may be given as `Later`."""

    def __init__(self, name: str, default: T) -> None:
        self.name, self.default = name, default

    def __get__(self, instance: object, owner: type) -> T:
        if instance is None:  # a dataclass asks for the default
            return self.default
        value = instance.__dict__[self.name]
        if isinstance(value, Later):
            value = instance.__dict__[self.name] = value.work()
        known: T = value
        return known

    def __set__(self, instance: object, value: T | Later[T]) -> None:
        unset = isinstance(value, WorkedOut)  # a field has it for its default
        instance.__dict__[self.name] = self.default if unset else value
