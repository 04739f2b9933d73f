"""Time history of a dynamic analysis."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

KEPT = 2000  # maximum number of stored states; of more steps only every second, third ... is kept


@dataclass(frozen=True)
class History:
    """Time history of a dynamic analysis at t accepted times; the first is the start of the motion."""

    times: NDArray[np.float64]  # (t,) s
    displacement: Callable[[NDArray[np.float64]], NDArray[np.float64]]  # (n, 3) -> (t, n, 3), m
    step_s: tuple[float, ...]  # wall seconds of each step
    step_cpu_s: tuple[float, ...]
    step: float  # s, the step that the scene asked for
    solved: tuple[bool, ...] = ()  # whether each step met its tolerance; empty: all did
    events: tuple[tuple[float, str], ...] = ()  # (time in s, what happened): a step that was halved
    energies: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)  # (t,) J
