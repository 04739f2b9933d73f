"""Results of a solved model or reference, used by metrics and reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.probe_domains import ProbeDomain
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.interpreter.results.run_report import ProbeResult, Timing
from softmark.records import dataclass

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """Results of a model or a reference that metrics and reports use.

    `displacement` is None without a displacement field, if nothing was found or only a surface was measured.
    """

    name: str
    body: str
    case: Case
    message: str | None = None  # reason why there is no result
    displacement: Callable[[Floats], Floats] | None = None
    probes: Mapping[str, ProbeResult] = field(default_factory=dict)
    weights: Mapping[str, Floats] = field(default_factory=dict)
    domains: Mapping[str, ProbeDomain] = field(default_factory=dict)  # domains of probes of stress or strain
    surface: Any = None  # measured: points, triangles, uncertainty; or how to register it onto a computed one
    curve: Any = None  # measured: x, y and the uncertainty of y
    value: Any = None  # given: a KnownValue
    uncertainty: float = 0.0  # m, of a reference
    doubt: str | None = None  # why a reference is not exact for the loaded body
    clock: Mapping[str, Timing | None] = field(default_factory=dict)
    history: History | None = None
    solve: Mapping[str, Any] = field(default_factory=dict)
    stress: Callable[[], Any] | None = None  # stress field of a model on a mesh, computed on demand
    at_rest: EquilibriumForces | None = None  # reactions and energies of a model
    step_errors: Callable[[], Any] | None = None  # time step error by modes of a dynamic analysis, computed on demand
    vibrations: Callable[[int], Floats] | None = None  # the lowest frequencies, Hz; raises Undefined
