"""Analyses: what is to be found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Static:
    """The state of rest under the loads: static equilibrium, by Newton's method.

    Converged means that the out-of-balance force is below `tolerance` times the larger of load and reactions.
    Anything else is reported as not converged, with its history.
    """

    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force"] = 1e-8
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations for each load step"] = 50
