"""Results of supports and contacts in the report: selected part, force, moment, contact pressure and friction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Protocol

from softmark.interpreter.results.json_records import JsonRecord
from softmark.interpreter.results.load_results import Vector
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Reaction(JsonRecord):
    """Reaction of a support at static equilibrium: force, N, and moment about the origin, N m.

    `own_moment` is the moment about `at`, the centre of the supported part, m: in the deformed shape, or in the
    undeformed shape at small strain. `shared` names the supports that also hold some of that part, and `shared_force`
    is the reaction there, N. The shared force counts for the support that comes first in the scene, so that the sum
    over all supports is the reaction of the body.
    """

    force: Vector
    moment: Vector
    at: Vector
    own_moment: Vector
    shared: tuple[str, ...] = ()
    shared_force: Vector = (0.0, 0.0, 0.0)

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries: force, moments and their point, and shared forces if there are any."""
        own = {"force": self.force, "moment": self.moment, "about": (0.0, 0.0, 0.0), "at": self.at,
               "own_moment": self.own_moment}  # fmt: skip
        return own | ({"shared": self.shared, "shared_force": self.shared_force} if self.shared else {})


@dataclass(frozen=True)
class SupportResult(JsonRecord):
    """Result of a support in the report: the supported area relative to its selection, and its reaction.

    `held` is the fraction of the selected area that the mesh supports; None without a mesh. `beyond` is the area
    supported outside the selection, as a fraction of the selected area. `reason` is the reason why the reaction is
    unknown.
    """

    held: float | None
    beyond: float
    reaction: Reaction | None
    reason: str | None

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries: the reaction, and the fractions of the selection `held` and `beyond`."""
        shares = {} if self.held is None else {"held": self.held} | ({"beyond": self.beyond} if self.beyond else {})
        carried = {"force": None, "moment": None, "reason": self.reason}
        return {**shares, **(carried if self.reaction is None else self.reaction.entries())}


@dataclass(frozen=True)
class ContactNumbers(JsonRecord):
    """Contact results as numbers: area under pressure, m^2, largest pressure, Pa, and smallest gap, m.

    The gap is None if no parts of the surface face each other, which is possible in self-contact. Area and pressure
    refer to the deformed surface, or to the undeformed surface at small strain. `left` is the mean gap, m, that the
    barrier leaves at points with pressure. `field` gives the pressure and gap at any point of the surface. `rubbing`
    contains the results of friction, if any.
    """

    area: float
    pressure: float
    gap: float | None
    left: float = 0.0
    field: PressedSurface | None = None
    rubbing: Friction | None = None

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries: area, pressure, gaps and friction, but not the values at points (`field`)."""
        own = {"area": self.area, "pressure": self.pressure, "gap": self.gap, "left": self.left}
        return own | ({} if self.rubbing is None else {"friction": self.rubbing})


@dataclass(frozen=True)
class Friction(JsonRecord):
    """Friction results of a contact.

    `slip` is the largest sliding distance of a node under pressure, m. `sticks` is the fraction of the normal contact
    forces that acts at sticking points. `area` is the undeformed sticking area, m^2. `work` is the heat dissipated in
    this state only, J.
    """

    slip: float
    sticks: float
    area: float
    work: float


@dataclass(frozen=True)
class ContactResult(JsonRecord):
    """Result of a contact in the report: its numbers, and its force and moment on the deformable body.

    `overlap` is the largest penetration depth of facets between their nodes, m; None if unknown. `taken` is the area of
    the facets that may touch relative to the selected area; None if everything is selected. `beyond` is the contact
    force over the product of area and largest pressure, if a coarse mesh makes it exceed 1.
    """

    touch: ContactNumbers
    reaction: Reaction
    overlap: float | None = None
    taken: float | None = None
    beyond: float | None = None

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries: contact numbers, penetration, force and moment."""
        known = {"taken": self.taken, "beyond": self.beyond}
        own = {"overlap": self.overlap} | {name: value for name, value in known.items() if value is not None}
        return {**self.touch.entries(), **own, **self.reaction.entries()}


class PressedSurface(Protocol):
    """Interface of the pressures on the surface of a body in contact."""

    def pressures(self, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return pressures (n,), Pa, at material points X (n, 3), m; NaN at points off the surface."""

    @property
    def at_nodes(self) -> Mapping[str, NDArray[np.float64]]:
        """Return `pressure`, Pa, and `gap`, m, at all nodes of the mesh (n,); off the surface they are zero and NaN.

        With friction there are also `slip`, m, and `sticks`: 1 for sticking, -1 for sliding, 0 without pressure.
        """


class ContactHistory(Protocol):
    """Interface of contact results over time."""

    def states(self, surface: bool) -> tuple[NDArray[np.float64], Iterator[EquilibriumForces]]:
        """Return times (t,), s, and an iterator over the forces at each time.

        With `surface`, only the times at which the surface is known are included.
        """


class Fluid(Protocol):
    """Interface of the results of the fluid in a porous body."""

    @property
    def outflows(self) -> Mapping[str, float]:
        """Return the fluid volume that has left through each permeable support, m^3, by name."""

    @property
    def pressures(self) -> tuple[float, float]:
        """Return the smallest and the largest fluid pressure in the body, Pa."""

    def pressure(self, point: tuple[float, float, float]) -> float:
        """Return the fluid pressure at a material point (coordinates in m), Pa."""


@dataclass(frozen=True)
class EquilibriumForces:
    """Forces and energies of a solution: reactions and works of loads by name, and the strain energy, J.

    In a dynamic analysis they are those of the final state, and `followed` holds contact results at earlier
    times. The work of a load at full size, J, is None if it depends on the path. `acting` is the largest nodal
    force of a load or the largest reaction, N; `moved` is the largest nodal displacement, m; `extent` is the size
    of the body, m. If only the listed reactions are known, `reason` states why.
    """

    reactions: Mapping[str, Reaction] = field(default_factory=dict)
    work: Mapping[str, float | None] = field(default_factory=dict)
    energy: float = 0.0
    acting: float = 0.0
    moved: float = 0.0
    extent: float = 0.0
    reason: str | None = None
    dissipated: float = 0.0  # heat dissipated by viscoelasticity since the start, J
    fluid: Fluid | None = None  # fluid of a porous body
    touches: Mapping[str, ContactNumbers] = field(default_factory=dict)  # contact results by name
    relative_error: float | None = None  # relative modelling error of a theory's forces
    followed: ContactHistory | None = None  # of a dynamic analysis

    def knows(self, name: str | None) -> bool:
        """Return whether the reaction of a support or contact is known; without a name, all forces on the body."""
        return self.reason is None or name in self.reactions
