"""What a report says of a support: what it holds, and the force and the moment that it holds it with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Protocol

from softmark.interpreter.results.json_records import Plain
from softmark.interpreter.results.load_results import Vector
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Reaction(Plain):
    """What a support does to a body at rest: force in N, and moment in N m about the origin.

    `own_moment` is that about `at`, the middle of what is held, m: deformed, or undeformed in a model of small strain.
    `shared` names the supports that hold some of it as well, and `shared_force` is what acts there; it counts as that
    of the support that comes first in the scene, so that the sum over all of them is that of the body.
    """

    force: Vector
    moment: Vector
    at: Vector
    own_moment: Vector
    shared: tuple[str, ...] = ()
    shared_force: Vector = (0.0, 0.0, 0.0)

    def entries(self) -> Mapping[str, object]:
        """With what its moment is about, and without what is not shared."""
        own = {"force": self.force, "moment": self.moment, "about": (0.0, 0.0, 0.0), "at": self.at,
               "own_moment": self.own_moment}  # fmt: skip
        return own | ({"shared": self.shared, "shared_force": self.shared_force} if self.shared else {})


@dataclass(frozen=True)
class HeldSupport(Plain):
    """What a report says of a support: the share of its selection that is held, and what it carries.

    `held` is None where there is no mesh, `beyond` what is held besides, as a share as well. `reason` says why nothing
    is known of what it carries.
    """

    held: float | None
    beyond: float
    reaction: Reaction | None
    reason: str | None

    def entries(self) -> Mapping[str, object]:
        """What it carries among them; shares where there are any."""
        shares = {} if self.held is None else {"held": self.held} | ({"beyond": self.beyond} if self.beyond else {})
        carried = {"force": None, "moment": None, "reason": self.reason}
        return {**shares, **(carried if self.reaction is None else self.reaction.entries())}


@dataclass(frozen=True)
class Touch(Plain):
    """What a contact comes to: the area that is pressed, m^2, the largest pressure, Pa, and the least gap, m.

    The gap is None where it is not known: no parts of a surface that touches itself face each other.
    Area and pressure are those of the body as it is deformed, or undeformed in a model of small strain. `left` is the
    mean gap where something presses, m, which a barrier leaves; `field` tells pressures and gaps at places; `rubbing`
    is what friction makes of it, where there is some.
    """

    area: float
    pressure: float
    gap: float | None
    left: float = 0.0
    field: Pressed | None = None
    rubbing: Friction | None = None

    def entries(self) -> Mapping[str, object]:
        """Without the field."""
        own = {"area": self.area, "pressure": self.pressure, "gap": self.gap, "left": self.left}
        return own | ({} if self.rubbing is None else {"friction": self.rubbing})


@dataclass(frozen=True)
class Friction(Plain):
    """What friction makes of a contact.

    `slip` is how far a node that is pressed has slid in all, at most, m, `sticks` the share of the forces that press
    where nothing slides, `area` the area there before deformation, m^2, and `work` what has become heat in this state
    alone, J.
    """

    slip: float
    sticks: float
    area: float
    work: float


@dataclass(frozen=True)
class Touched(Plain):
    """What a report says of a contact: what it comes to, and its force and moment on the body that deforms.

    `overlap` is how deep facets cut into the rigid body between their nodes, m; None where that is not known. `taken`
    is the area of the facets that may touch over that of what the contact selects; None where it selects all. `beyond`
    is what presses over area times largest pressure, where a coarse mesh makes it more than 1.
    """

    touch: Touch
    reaction: Reaction
    overlap: float | None = None
    taken: float | None = None
    beyond: float | None = None

    def entries(self) -> Mapping[str, object]:
        """Of all three."""
        known = {"taken": self.taken, "beyond": self.beyond}
        own = {"overlap": self.overlap} | {name: value for name, value in known.items() if value is not None}
        return {**self.touch.entries(), **own, **self.reaction.entries()}


class Pressed(Protocol):
    """The surface of a body that something may press on."""

    def pressures(self, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """At material points X (n, 3), m: Pa (n,). Not a number where one is not on the surface."""

    @property
    def at_nodes(self) -> Mapping[str, NDArray[np.float64]]:
        """`pressure`, Pa, and `gap`, m, at all nodes of the mesh (n,): nothing and not a number beyond the surface.

        With friction `slip`, m, and `sticks`: 1 where it does, -1 where it slides, 0 where nothing presses.
        """


class States(Protocol):
    """What contacts come to over time."""

    def states(self, surface: bool) -> tuple[NDArray[np.float64], Iterator[AtRest]]:
        """Times (t,), s, with what is known at each: at all, or at those at which the surface is known as well."""


class Fluid(Protocol):
    """The fluid in a porous body."""

    @property
    def outflows(self) -> Mapping[str, float]:
        """What has left through each support that lets it through, by name, m^3."""

    @property
    def pressures(self) -> tuple[float, float]:
        """The least and the largest pressure in the body, Pa."""

    def pressure(self, point: tuple[float, float, float]) -> float:
        """At a material point, m: Pa."""


@dataclass(frozen=True)
class AtRest:
    """What a state of rest says of forces: reactions and works of loads by name, and the strain energy, J.

    Of a motion it says at its end, and has `followed` for the times before, what contacts do and nothing else.

    The work of a load at full size is None where it depends on the way. `acting` is the largest load, by the sizes of
    its forces at nodes, or reaction, N; `moved` the largest displacement of a node, and `extent` that of the body, m.
    `reason` says why nothing is known, but of what has a reaction here.
    """

    reactions: Mapping[str, Reaction] = field(default_factory=dict)
    work: Mapping[str, float | None] = field(default_factory=dict)
    energy: float = 0.0
    acting: float = 0.0
    moved: float = 0.0
    extent: float = 0.0
    reason: str | None = None
    dissipated: float = 0.0  # J, since the start of what remembers
    fluid: Fluid | None = None  # of a porous body
    touches: Mapping[str, Touch] = field(default_factory=dict)  # what contacts come to, by name
    off: float | None = None  # of a theory: how far its forces may be off for what it leaves out, relative
    followed: States | None = None  # in a motion

    def knows(self, name: str | None) -> bool:
        """Whether anything is known of a support or contact, or where none is named of the whole body."""
        return self.reason is None or name in self.reactions
