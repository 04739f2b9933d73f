"""Problem for an external program, and its results: only arrays, in SI units, with softmark's conventions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class NoAnswer(Exception):
    """Error that an external program has left no readable results, with a message for users."""


class ExternalNotConverged(NoAnswer):
    """Error that an external program did not converge, or that its motion is invalid, with a message for users."""


@dataclass(frozen=True)
class ExternalMaterial:
    """Material of a problem: the name of its law in scenes, its constants in SI by name, and its cells (k,)."""

    law: str  # linear_elastic, neo_hookean, st_venant_kirchhoff, ...
    constants: Mapping[str, float]
    density: float | None
    cells: Ints
    choices: Mapping[str, str] = field(default_factory=dict)  # choices of the law, such as volumetric = logarithmic

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants lam and mu, Pa, of a material that is given by moduli."""
        E, nu = self.constants["young"], self.constants["poisson"]
        return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * E / (1.0 + nu)


@dataclass(frozen=True)
class Motion:
    """Motion from rest, under loads at full size from the start, in `count` steps of `step`, s, each.

    States are requested after the numbers of steps in `after` (t,), the first of which is 0. Damping is Rayleigh's,
    a M + b K.
    """

    step: float
    count: int
    after: Ints
    masses: Floats  # (n,) kg, of nodes
    damping_mass: float = 0.0  # a, 1/s
    damping_stiffness: float = 0.0  # b, s
    explicit: bool = False  # explicit time steps
    iterations: int | None = None  # iterations of a step; None: the program's own default


@dataclass(frozen=True)
class Section:
    """Constant cross-section of a rod: area, stiffness and rotary inertia.

    `axes` (3, 3) are the undeformed unit vectors e1, e2, e3 as columns, with e1 along the rod.
    """

    area: float  # m^2
    stiffness: Floats  # (6,) to stretch, shears along e2 and e3, N; to twist, bendings about e2 and e3, N m^2
    inertia: Floats  # (3,) of a metre about e1, e2 and e3, kg m
    axes: Floats


@dataclass(frozen=True)
class Problem:
    """Body on a mesh under dead loads, in static equilibrium or in `motion`.

    Nodes and cells count from 0, in the order of solvers/elements. `held` (h, 2) are pairs of node and component
    (0, 1, 2) on which displacements `values` (h,), m, are imposed at full load. `forces` (n, 3), N, are the nodal
    forces of tractions and weight at full load, as softmark integrates them. Solutions are requested at load
    fractions `shares` (s,) in order; the last is 1.

    A problem of a rod has a `section`. Its cells are the segments (m, 2), and held components 3, 4, 5 are
    rotations.
    """

    points: Floats  # (n, 3) m
    cells: Ints  # (m, a)
    element: str  # tet4, tet10, hex8, hex20, ...
    strain: str  # small or finite
    stuff: tuple[ExternalMaterial, ...]
    held: Ints
    values: Floats
    forces: Floats
    shares: tuple[float, ...] = (1.0,)
    tolerance: float = 1e-8  # of the residual
    values_of_states: tuple[float, ...] = ()  # values of states, such as 0.125; may be empty
    motion: Motion | None = None
    section: Section | None = None
    named: NamedParts | None = None  # named parts, for a program that receives loads by name

    @property
    def is_held(self) -> NDArray[np.bool_]:
        """Return which displacement components of nodes are held (n, 3)."""
        found = np.zeros(self.points.shape, dtype=np.bool_)
        found[self.held[:, 0], self.held[:, 1]] = True
        return found


@dataclass(frozen=True)
class Answer:
    """Results of an external program: displacements `u` (s, n, 3), m, in the requested states.

    For a motion the states are those after the requested steps; for a rod, `turned` are the section axes, as
    columns. `settled` is whether the program's log reports convergence, None if unknown. `clocks` are the times
    that the program measured, s, absent if unknown: `setup_s`, `solve_s`, `io_s`, and `whole_s` if only the total
    is reported.
    """

    u: Floats
    settled: bool | None = None
    iterations: int | None = None
    clocks: Mapping[str, float] = field(default_factory=dict)
    said: str = ""  # messages of its log for the user
    rounding: float = 0.0  # relative, of numbers as it writes them: 5e-7 of seven digits, 0 of doubles
    steps_s: Floats | None = None  # (count,) s that each step of a motion took, by the program's clock
    turned: Floats | None = None  # (s, n, 3, 3) section axes at the nodes of a rod
    unsolved: int = 0  # number of steps of a motion that did not converge, or may not have
