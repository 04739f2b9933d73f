"""Supports: where a body is held, or moved by a given amount.

To add one: a class with the fields `body`, `where` and `components`, a line in SUPPORTS. Derived from Holding it holds
components of all that it selects, at rest or moved by one vector, and every model takes it. Derived from Support alone
it is refused by every model whose `supports` do not name it, until its formulas are written.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from softmark.interpreter.vocabulary.load_words import at_state, scaled
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np

Vector3 = tuple[float, float, float]


class Support:
    """What every support says."""

    moves = False  # it imposes a motion
    course: Any = None  # how it moves in a dynamic analysis, or from state to state
    components: tuple[int, ...]  # directions of x, y and z in which it holds

    @property
    def tracked(self) -> str | None:
        """The measurement whose points it follows."""
        return None

    @property
    def displacement(self) -> Vector3:
        """That it imposes at full load on all that it moves alike, m."""
        return (0.0, 0.0, 0.0)

    @property
    def imposed(self) -> Vector3:
        """The same without the directions that it leaves free, m."""
        x, y, z = (v if c in self.components else 0.0 for c, v in enumerate(self.displacement))
        return x, y, z

    @property
    def rotation(self) -> Vector3:
        """By how much it turns what it moves at full load: along the axis, in rad, of any size."""
        return (0.0, 0.0, 0.0)

    @property
    def turns(self) -> bool:
        """Whether what it imposes is not in proportion to the load: points move on circles."""
        return any(self.rotation)

    def moved(self, X: Floats, share: float = 1.0) -> Floats:
        """What it imposes on points X (n, 3) at a share of the load (n, 3), m."""
        return np.tile(share * np.array(self.displacement), (len(X), 1))

    def part(self, share: float) -> Self:
        """The same at a part of its full size."""
        return self

    def in_state(self, number: int, value: float) -> Self:
        """The same in one state of a static analysis, of this value."""
        moved: Self = at_state(self, value)
        return moved


class Holding(Support):
    """One that holds `components` of all points `where` it selects them, and moves them by its `displacement`."""

    where: Any


class ByVector(Support):
    """One that moves what it holds `by` one vector."""

    by: Vector3

    @property
    def displacement(self) -> Vector3:
        """That it imposes at full load, m."""
        return self.by

    def part(self, share: float) -> Self:
        """The same at a part of its full size."""
        moved: Self = scaled(self, "by", share)
        return moved


@dataclass(frozen=True)
class Fixed(Holding):
    """Holds the selected part of a body where it is.

    `components` chooses what is held; without it all three are. A beam model turns the condition into its rigid
    cross-section: a clamp over a whole section holds its rotation as well.
    """

    body: Annotated[str, "body", "the body that is held"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    components: Annotated[tuple[int, ...], "components", "directions in which they are held"] = (0, 1, 2)


@dataclass(frozen=True)
class InPlane(Holding):
    """Holds all points of a plane body in their planes: no scene names it, the body does."""

    body: str
    where: Any
    components = (2,)


@dataclass(frozen=True)
class OnAxis(InPlane):
    """Holds the points of a body of revolution that lie on its axis there."""

    components = (0,)


@dataclass(frozen=True)
class Symmetric(Holding):
    """Lets a body stand for itself and its mirror image: a plane of symmetry, in which its points may move.

    `where` selects the plane face that lies in it, as `x <= 0 mm` does of a body with x >= 0; what is normal to the
    plane is held. The plane is normal to x, y or z, and the body lies on one side of it. A beam model holds the two
    rotations as well that a section in the plane cannot make. Loads and supports must be symmetric too: gravity across
    the plane is refused, as are motions that start across it, and a traction, an elastic foundation or a drain on the
    plane itself, which is a face of the half alone. Forces, energies and mass are those of the part; of a force at a
    point of the plane give half (`W335`). The answer is symmetric as well: what buckles or vibrates to one side alone
    is not found.
    """

    body: Annotated[str, "body", "the body that is held"]
    where: Annotated[Any, "condition", "the plane face, by coordinates before deformation: `x <= 0 mm`"]

    @property
    def normal(self) -> tuple[int, float] | None:
        """Which coordinate is constant on the plane, and where it lies, m; None where this is about no such plane."""
        found = set()
        for border in self.where.borders:
            *normal, d = border.plane or (1.0, 1.0, 1.0, 0.0)
            along = [i for i, c in enumerate(normal) if c]
            if len(along) != 1:
                return None
            found.add((along[0], -d / normal[along[0]]))
        return found.pop() if len(found) == 1 else None

    @property
    def components(self) -> tuple[int, ...]:  # type: ignore[override]
        """The direction that is held: the plane's normal."""
        return () if self.normal is None else (self.normal[0],)


@dataclass(frozen=True)
class Displaced(ByVector, Holding):
    """Moves the selected part of a body by a given vector; components that are not named stay free."""

    moves = True

    body: Annotated[str, "body", "the body that is moved"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    by: Annotated[Vector3, "m", "displacement at full load"]
    components: Annotated[tuple[int, ...], "components", "directions in which it is imposed"] = (0, 1, 2)
    course: Annotated[
        Any | None,
        "course",
        "how it moves in a dynamic analysis, or from state to state of a static one; at once without",
    ] = None


@dataclass(frozen=True)
class Turned(Holding):
    """Turns the selected part of a body about an axis, right-handed: by half a turn, or by three, and ten at most.

    Every point of it moves on its circle about the axis, exactly and not to first order. A static analysis goes there
    in steps of at most 15 degrees from rest, loads growing with them, so that a turn of 360 degrees is not none. With
    all components held the part keeps its distances; with `components = (y, z)` what turns about x may slide along it.
    `moment(NAME, along = +x)` is the torque that it takes, `force(NAME, along = +x)` the pull along the axis. A beam
    turns whole sections. Steps of loads leave no room for `path = arc_length`, caps, reduced models and disturbed
    starts. Small strain takes a large turn for a growth of the body.
    """

    moves = True

    body: Annotated[str, "body", "the body that is turned"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    axis: Annotated[Vector3, "direction", "the axis of the turn, right-handed"]
    angle: Annotated[float, "rad in [-62.831854, 62.831854]", "by how much, at full load: `180 deg`"]
    through: Annotated[Vector3, "m", "a point of the axis"] = (0.0, 0.0, 0.0)
    components: Annotated[tuple[int, ...], "components", "directions in which it is imposed"] = (0, 1, 2)
    course: Annotated[
        Any | None,
        "course",
        "how it turns in a dynamic analysis, or from state to state of a static one; at once without",
    ] = None

    @property
    def rotation(self) -> Vector3:
        """By how much it turns what it moves at full load, along the axis, rad."""
        x, y, z = (self.angle * c for c in self.axis)
        return x, y, z

    def moved(self, X: Floats, share: float = 1.0) -> Floats:
        """Of points X (n, 3) on their circles (n, 3), m: sin a  n x r + (1 - cos a) n x (n x r) (Rodrigues)."""
        n, angle = np.array(self.axis), share * self.angle
        across = np.cross(n, X - np.array(self.through))
        found: Floats = math.sin(angle) * across + 2.0 * math.sin(0.5 * angle) ** 2 * np.cross(n, across)
        return found

    def part(self, share: float) -> Self:
        """The same at a part of its full size."""
        turned: Self = scaled(self, "angle", share)
        return turned


@dataclass(frozen=True)
class Follows(Holding):
    """Moves the selected part of a body as tracked points moved in an experiment.

    Between the points their displacements are interpolated by thin plate splines (Duchon 1977) that pass through them,
    and beyond the outermost ones extrapolated. Points of one layer, a tenth as thick as wide or less, are taken to lie
    in its plane: what changes across the layer is not followed. Only points near the selected part count: those within
    `reach` of it. In a solid model every node of the selected part is moved.
    """

    moves = True

    body: Annotated[str, "body", "the body that is moved"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    of: Annotated[str, "reference", "the measurement: a reference of tracked points"]
    reach: Annotated[float, "m in (0, inf)", "how far from the selected part a tracked point may lie"]
    components: Annotated[tuple[int, ...], "components", "directions in which it is imposed"] = (0, 1, 2)

    @property
    def tracked(self) -> str:
        """The measurement whose points it follows."""
        return self.of


@dataclass(frozen=True)
class Hinged(ByVector):
    """Holds points of the axes of a network, or moves them, and leaves their sections to turn.

    With an `axis` they turn about that alone, as on a bolt; without one in every way, as on a ball. `components`
    chooses what is held of their places: `components = y` is a roller that slides along x and z. A hinge between two
    members is no support: members that meet are joined rigidly.
    """

    body: Annotated[str, "body", "the network that is held"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    axis: Annotated[Vector3 | None, "direction", "what sections may turn about; every axis without"] = None
    by: Annotated[Vector3, "m", "displacement at full load"] = (0.0, 0.0, 0.0)
    components: Annotated[tuple[int, ...], "components", "directions in which places are held"] = (0, 1, 2)
    course: Annotated[Any | None, "course", "how it moves from state to state; at once without"] = None

    @property
    def moves(self) -> bool:  # type: ignore[override]
        """Whether it imposes a motion."""
        return any(self.by)


@dataclass(frozen=True)
class Bedded(Support):
    """Lets a part of a surface lie on springs, and on dashpots: on tissue around it, foam, soil.

    A traction -(stiffness u + damping v) acts on every point of it, u how far it has moved and v how fast, per area
    before deformation: in all directions, or along the normal before deformation alone (`directions = normal`), so that
    it slides. Springs pull as they press: what lifts off is not known to them. They keep their directions, and have no
    moment of their own. The dashpots act in a dynamic analysis. Finite elements take it, in space and in the plane.
    What stands between bed and body is a reaction as of any support: `force(NAME, along = +z)`.
    """

    components = ()  # it holds nothing where it is

    body: Annotated[str, "body", "the body that lies on it"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    stiffness: Annotated[float, "Pa/m in (0, inf)", "traction for each length moved: `10 kPa/mm`"]
    damping: Annotated[float, "Pa*s/m in [0, inf)", "traction for each speed"] = 0.0
    directions: Annotated[Literal["all", "normal"], "the ways in which it acts"] = "all"


@dataclass(frozen=True)
class Level(Support):
    """Keeps a plane face level: a rigid plate on it without friction, which does not tilt.

    All points of the face move alike along its normal, by as much as loads and the body make them, and as they like
    within it. What presses the plate is a load on the face, such as a `traction`: it counts by its sum alone. A plate
    whose travel is given is `displaced(...)`. It is held level by springs between each point and the mean of all, 1e6
    times as stiff as the body behind it: an unevenness of about 1e-5 of the travel is left. Finite elements take
    it at rest and in quasistatic analyses, in space and in the plane, of faces normal to x, y or z.
    """

    components = ()  # it holds nothing where it is
    damping: ClassVar[float] = 0.0

    body: Annotated[str, "body", "the body that it lies on"]
    where: Annotated[Any, "condition", "which plane face of it, by coordinates before deformation"]


class Drain(Support):
    """One that lets fluid through a part of the surface of a porous body: it holds a pressure there, and no point."""

    components = ()
    body: str
    where: Any

    @property
    def pressure(self) -> float:
        """Of the fluid there at full size, Pa."""
        return 0.0


@dataclass(frozen=True)
class Drained(Drain):
    """Lets fluid leave and enter freely through a part of the surface of a `biphasic` body: its pressure there is 0.

    Faces that no support names are sealed. It holds no point where it is: a porous plate that carries a load needs the
    load besides. `outflow(NAME)` is what has left through it. An edge that two of them share is the first's.
    """

    body: Annotated[str, "body", "the body whose fluid it lets through"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]


@dataclass(frozen=True)
class PorePressure(Drain):
    """Holds the pressure of the fluid at a part of the surface of a `biphasic` body: of a bath, a pump, a column.

    It is a pressure above that of the air around, and fluid enters or leaves as it must. It is that of the fluid alone:
    what a bath presses on the solid is a load, `pressure(...)` of the same size. `outflow(NAME)` is what has left.
    """

    moves = True

    body: Annotated[str, "body", "the body whose fluid it presses"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    value: Annotated[float, "Pa", "the pressure of the fluid, at full size"]
    course: Annotated[Any | None, "course", "how it comes to that in time; at once without"] = None

    @property
    def pressure(self) -> float:
        """Of the fluid there at full size, Pa."""
        return self.value

    def part(self, share: float) -> Self:
        """The same at a part of its full size."""
        less: Self = scaled(self, "value", share)
        return less
