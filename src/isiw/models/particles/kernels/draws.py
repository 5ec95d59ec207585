"""Random draws in loops: SplitMix64 (Steele et al., OOPSLA 2014), whose state is an array of one whole number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from isiw.compiled import inlined, log, loop

_f, _u = np.float32, np.uint64
_GOLDEN, _FIRST, _SECOND = _u(0x9E3779B97F4A7C15), _u(0xBF58476D1CE4E5B9), _u(0x94D049BB133111EB)
_BY_30, _BY_27, _BY_31, _BY_40, _BY_32 = (_u(bits) for bits in (30, 27, 31, 40, 32))
_LOW_16, _BY_16, _BY_48, _LOW_32 = _u(0xFFFF), _u(16), _u(48), _u(0xFFFFFFFF)
_PER_24 = _f(2.0**-24)
_PER_32, _HALF, _ONE, _TWO, _PI = _f(2.0**-32), _f(0.5), _f(1.0), _f(2.0), _f(math.pi)
_S3, _S5, _S7, _S9, _S11 = (_f((-1) ** ((n - 1) // 2) / math.factorial(n)) for n in (3, 5, 7, 9, 11))
_OF_FOUR, _PER_FOUR = _f(2.0 * (2**16 - 1)), _f(math.sqrt(3.0) / 2.0**16)


@inlined
def _bits(dice: Any) -> Any:
    """64 random bits."""
    dice[0] += _GOLDEN
    z = dice[0]
    z = (z ^ (z >> _BY_30)) * _FIRST
    z = (z ^ (z >> _BY_27)) * _SECOND
    return z ^ (z >> _BY_31)


@inlined
def uniform(dice: Any) -> Any:
    """A draw between 0 and 1, in single precision; never 1."""
    return _f(_bits(dice) >> _BY_40) * _PER_24


@loop
def normal(dice: Any) -> Any:
    """A draw from the standard normal law, in single precision (Box and Muller)."""
    bits = _bits(dice)
    turned = _f(np.int64(bits & _LOW_32)) * _PER_32 - _HALF
    square = _PI * turned * (_PI * turned)
    sine = _PI * turned * (_ONE + square * (_S3 + square * (_S5 + square * (_S7 + square * (_S9 + square * _S11)))))
    return math.sqrt(_f(-2.0) * log((_f(np.int64(bits >> _BY_32)) + _ONE) * _PER_32)) * (_TWO * sine * sine - _ONE)


@inlined
def blur(dice: Any) -> Any:
    """A symmetric draw of mean 0 and SD 1, nearly normal: the sum of four uniform ones."""
    bits = _bits(dice)
    summed = (bits & _LOW_16) + ((bits >> _BY_16) & _LOW_16) + ((bits >> _BY_32) & _LOW_16) + (bits >> _BY_48)
    return (_f(summed) - _OF_FOUR) * _PER_FOUR
