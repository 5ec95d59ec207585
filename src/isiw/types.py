"""Array aliases and the shape alphabet.

Shapes in docstrings use one alphabet throughout:

    n  trials              t  candidate ISIs, or the points of the design grid
    s  posterior samples   p  particles
    b  parallel subjects   w  waveform samples
    q  quadrature nodes    y  values of the next MEP
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import WithJsonSchema

__all__ = [
    "Array",
    "ArrayLike",
    "BoolArray",
    "Conditioning",
    "FloatArray",
    "IntArray",
    "Number",
    "Numbers",
    "Reference",
    "Singles",
]

FloatArray: TypeAlias = NDArray[np.float64]
Singles: TypeAlias = NDArray[np.float32]
"""Numbers of the compiled engine, in single precision."""

Array: TypeAlias = NDArray[np.floating[Any]]
"""Numbers of either precision: what posteriors answer, and acquisition functions score."""

IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]

Reference: TypeAlias = Literal["impact", "valve"]

Conditioning: TypeAlias = Literal["tap", "electrical"]

Number: TypeAlias = Annotated[float, WithJsonSchema({"type": ["number", "string"]})]
Numbers: TypeAlias = Annotated[
    tuple[float, ...], WithJsonSchema({"type": "array", "items": {"type": ["number", "string"]}})
]
"""As JSON has them, which knows no infinity: in its place are the strings "Infinity", "-Infinity" and "NaN"."""
