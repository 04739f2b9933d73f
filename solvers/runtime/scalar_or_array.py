"""Mathematical functions of a number or an array, so that a formula is written once for both.

For a `float` they call `math`, about twenty times as fast as numpy with an array of one number; for arrays they call
numpy. Outside their domain they return inf or NaN as numpy does, and raise nothing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar, overload

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np  # so that `dsl explain` needs no numpy

T = TypeVar("T")  # a float, or an array


@overload
def exp(x: float) -> float: ...
@overload
def exp(x: Array) -> Array: ...
def exp(x: Any) -> Any:
    """Return e^x."""
    if type(x) is not float:
        return np.exp(x)
    try:
        return math.exp(x)
    except OverflowError:
        return math.inf


@overload
def expm1(x: float) -> float: ...
@overload
def expm1(x: Array) -> Array: ...
def expm1(x: Any) -> Any:
    """Return e^x - 1, accurate near x = 0."""
    if type(x) is not float:
        return np.expm1(x)
    try:
        return math.expm1(x)
    except OverflowError:
        return math.inf


@overload
def log1p(x: float) -> float: ...
@overload
def log1p(x: Array) -> Array: ...
def log1p(x: Any) -> Any:
    """Return ln(1 + x), accurate near x = 0."""
    if type(x) is not float:
        return np.log1p(x)
    if x > -1.0:
        return math.log1p(x)
    return -math.inf if x == -1.0 else math.nan


def where(condition: Any, one: T, other: Any) -> T:
    """Return `one` where the condition holds, else `other`."""
    if type(condition) is bool:
        alone: T = one if condition else other
        return alone
    this: Any = one
    many: T = np.where(condition, this, other)
    return many


def full_like(x: Any, value: Any) -> Any:
    """Return `value` itself if `x` is a number, else an array of the shape of `x` filled with it."""
    return value if type(x) is float else np.full_like(x, value)
