"""Supports: parts of a body that are fixed, or moved by a given amount.

To add a support: a class with the fields `body`, `where` and `components`, and a line in SUPPORTS. A class derived from
Holding prescribes components of the displacement at all selected points, zero or given by one vector, and every model
supports it. A class derived directly from Support is refused by every model that does not list it in `supports`, until
its formulas are written.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from softmark.interpreter.vocabulary.values_in_states import in_state_of_value, scale_field
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
else:
    from softmark.solvers.runtime.lazy_modules import np

Vector3 = tuple[float, float, float]


class Support:
    """Base class of supports: constraints, elastic foundations and drained boundaries on a part of a body."""

    moves = False  # True if it imposes a motion
    amplitude: Any = None  # amplitude over time, or from state to state
    components: tuple[int, ...]  # directions (0 x, 1 y, 2 z) that are held

    @property
    def tracked(self) -> str | None:
        """Name of the measurement whose points the support follows, None for other supports."""
        return None

    @property
    def displacement(self) -> Vector3:
        """Prescribed displacement at full load, m, the same for all points of the support."""
        return (0.0, 0.0, 0.0)

    @property
    def imposed(self) -> Vector3:
        """Prescribed displacement at full load, m, with zeros in the directions that stay free."""
        x, y, z = (v if c in self.components else 0.0 for c, v in enumerate(self.displacement))
        return x, y, z

    @property
    def rotation(self) -> Vector3:
        """Prescribed rotation at full load as a vector along the axis, rad; it may exceed a full turn."""
        return (0.0, 0.0, 0.0)

    @property
    def turns(self) -> bool:
        """True if the support rotates its points, so that displacements are not proportional to the load."""
        return any(self.rotation)

    def moved(self, X: Floats, share: float = 1.0) -> Floats:
        """Return the displacements (n, 3), m, prescribed at points X (n, 3), m, at the fraction `share` of the load."""
        return np.tile(share * np.array(self.displacement), (len(X), 1))

    def part(self, share: float) -> Self:
        """Return the support with its motion scaled to the fraction `share` of its full size."""
        return self

    def in_state(self, number: int, value: float) -> Self:
        """Return the support in one state of a static analysis, which has this number and value."""
        moved: Self = in_state_of_value(self, value)
        return moved


class Holding(Support):
    """Support that prescribes some displacement components at all points selected by `where`.

    `components` are the prescribed directions, and `displacement` has their values.
    """

    where: Any


class ByVector(Support):
    """Support that displaces its points by one vector, `by`."""

    by: Vector3

    @property
    def displacement(self) -> Vector3:
        """Prescribed displacement at full load, m."""
        return self.by

    def part(self, share: float) -> Self:
        """Return the support with its displacement scaled to the fraction `share`."""
        moved: Self = scale_field(self, "by", share)
        return moved


@dataclass(frozen=True)
class Fixed(Holding):
    """Fixes the selected part of a body.

    `components` chooses the directions; by default all three are fixed. A beam model applies the support to its rigid
    cross-sections: a clamp over a whole section also fixes its rotation.
    """

    body: Annotated[str, "body", "body that is held"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    components: Annotated[tuple[int, ...], "components", "directions that are fixed"] = (0, 1, 2)


@dataclass(frozen=True)
class InPlane(Holding):
    """Support that keeps all points of a plane body in their planes.

    Plane bodies add it themselves; scenes do not declare it.
    """

    body: str
    where: Any
    components = (2,)


@dataclass(frozen=True)
class OnAxis(InPlane):
    """Support that keeps the points on the axis of a body of revolution on that axis."""

    components = (0,)


@dataclass(frozen=True)
class Symmetric(Holding):
    """Plane of symmetry: the body represents itself and its mirror image, and points of the plane stay in it.

    `where` selects the plane face that lies in it, such as `x <= 0 mm` for a body with x >= 0. Displacements normal to
    the plane are zero. The plane is normal to x, y or z, and the body lies on one side of it. A beam model also fixes
    the two rotations that would tilt the section out of the plane. Loads and supports must be symmetric too: gravity
    across the plane and initial velocities across it are refused. So are a traction, an elastic foundation or a drain
    on the plane itself, because only the half model has that face. Forces, energies and mass are those of the half
    model; for a force at a point of the plane give half of it (`W335`). The solution is symmetric as well: buckling and
    vibration modes that are not symmetric are not found.
    """

    body: Annotated[str, "body", "body that is held"]
    where: Annotated[Any, "condition", "plane face, by undeformed coordinates: `x <= 0 mm`"]

    @property
    def normal(self) -> tuple[int, float] | None:
        """Index of the coordinate that is constant on the plane, and its value, m.

        None if `where` selects no such plane.
        """
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
        """Direction in which displacements are zero: the normal of the plane."""
        return () if self.normal is None else (self.normal[0],)


@dataclass(frozen=True)
class Displaced(ByVector, Holding):
    """Moves the selected part of a body by a given vector; directions not listed in `components` stay free."""

    moves = True

    body: Annotated[str, "body", "body that is moved"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    by: Annotated[Vector3, "m", "displacement at full load"]
    components: Annotated[tuple[int, ...], "components", "directions in which displacements are imposed"] = (0, 1, 2)
    amplitude: Annotated[
        Any | None,
        "amplitude",
        "amplitude over time or from state to state; default: full motion from the start",
    ] = None


@dataclass(frozen=True)
class Rotated(Holding):
    """Rotates the selected part of a body about an axis (right-hand rule), by up to ten full turns.

    Every point moves exactly on its circle about the axis, not only to first order. A static analysis applies the
    rotation in steps of at most 15 degrees from rest, and raises the loads with them, so a rotation of 360 degrees
    differs from none. With all components held the part keeps its shape; with `components = (y, z)` a part that rotates
    about x may slide along x. `moment(NAME, along = +x)` is the torque of the support, `force(NAME, along = +x)` its
    axial force. On a beam whole cross-sections rotate. Because of the load steps, `path = arc_length`,
    `max_iterations`, reduced models and `disturbed` starts are refused. In small strain a large rotation would appear
    as growth of the body.
    """

    moves = True

    body: Annotated[str, "body", "body that is rotated"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    axis: Annotated[Vector3, "direction", "axis of rotation, right-hand rule"]
    angle: Annotated[float, "rad in [-62.831854, 62.831854]", "angle of rotation at full load: `180 deg`"]
    through: Annotated[Vector3, "m", "point on the axis"] = (0.0, 0.0, 0.0)
    components: Annotated[tuple[int, ...], "components", "directions in which displacements are imposed"] = (0, 1, 2)
    amplitude: Annotated[
        Any | None,
        "amplitude",
        "amplitude over time or from state to state; default: full rotation from the start",
    ] = None

    @property
    def rotation(self) -> Vector3:
        """Prescribed rotation at full load as a vector along the axis, rad."""
        x, y, z = (self.angle * c for c in self.axis)
        return x, y, z

    def moved(self, X: Floats, share: float = 1.0) -> Floats:
        """Return the prescribed displacements (n, 3), m, of points X (n, 3), m, by Rodrigues' formula.

        sin a  n x r + (1 - cos a) n x (n x r), with a the angle, n the axis and r the vector from the axis.
        """
        n, angle = np.array(self.axis), share * self.angle
        across = np.cross(n, X - np.array(self.through))
        found: Floats = math.sin(angle) * across + 2.0 * math.sin(0.5 * angle) ** 2 * np.cross(n, across)
        return found

    def part(self, share: float) -> Self:
        """Return the support with its angle scaled to the fraction `share`."""
        turned: Self = scale_field(self, "angle", share)
        return turned


@dataclass(frozen=True)
class MeasuredMotion(Holding):
    """Moves the selected part of a body as tracked points moved in an experiment.

    Displacements between the tracked points are interpolated by thin plate splines (Duchon 1977), exact at the points,
    and extrapolated beyond the outermost ones. If the points form a layer, a tenth as thick as wide or less, they are
    treated as lying in its plane: changes across the layer are ignored. Only tracked points within `reach` of the
    selected part are used. In a solid model every node of the selected part is moved.
    """

    moves = True

    body: Annotated[str, "body", "body that is moved"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    of: Annotated[str, "reference", "measurement: a reference with tracked points"]
    reach: Annotated[float, "m in (0, inf)", "largest distance of a tracked point from the selected part"]
    components: Annotated[tuple[int, ...], "components", "directions in which displacements are imposed"] = (0, 1, 2)

    @property
    def tracked(self) -> str:
        """Name of the measurement whose points the support follows."""
        return self.of


@dataclass(frozen=True)
class Pinned(ByVector):
    """Holds or moves points on the axes of a network, and leaves their cross-sections free to rotate.

    With an `axis` sections rotate only about it, as on a pin; by default they rotate freely, as on a ball joint.
    `components` chooses the directions that are held: `components = y` is a roller that slides along x and z. This is
    not a hinge between two members: members that meet are joined rigidly.
    """

    body: Annotated[str, "body", "beam network that is held"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    axis: Annotated[Vector3 | None, "direction", "axis about which sections may rotate; default: all axes"] = None
    by: Annotated[Vector3, "m", "displacement at full load"] = (0.0, 0.0, 0.0)
    components: Annotated[tuple[int, ...], "components", "directions that are held"] = (0, 1, 2)
    amplitude: Annotated[
        Any | None, "amplitude", "amplitude from state to state; default: full motion from the start"
    ] = None

    @property
    def moves(self) -> bool:  # type: ignore[override]
        """True if the support prescribes a nonzero displacement."""
        return any(self.by)


@dataclass(frozen=True)
class ElasticFoundationSupport(Support):
    """Elastic foundation: springs and dashpots under a part of the surface, for surrounding tissue, foam or soil.

    The traction -(stiffness u + damping v) acts at every point, per undeformed area, with u the displacement and v the
    velocity. It acts in all directions, or only along the undeformed normal (`directions = normal`), so that the
    surface can slide. The springs resist tension and compression alike; there is no lift-off. Their directions stay
    fixed, and they exert no moments of their own. The dashpots act only in a dynamic analysis. Finite elements support
    it in three dimensions and in the plane. The force between foundation and body is a reaction as of any support:
    `force(NAME, along = +z)`.
    """

    components = ()  # no displacement is prescribed

    body: Annotated[str, "body", "body on the foundation"]
    where: Annotated[Any, "condition", "part of its surface, by undeformed coordinates"]
    stiffness: Annotated[float, "Pa/m in (0, inf)", "traction per displacement: `10 kPa/mm`"]
    damping: Annotated[float, "Pa*s/m in [0, inf)", "traction per velocity"] = 0.0
    directions: Annotated[Literal["all", "normal"], "directions in which it acts"] = "all"


@dataclass(frozen=True)
class RigidPlate(Support):
    """Keeps a plane face parallel to itself: a rigid frictionless plate on it that cannot tilt.

    All points of the face move by the same distance along its normal, which follows from the loads, and freely in the
    plane of the face. A load on the plate is a load on the face, such as a `traction`; only its resultant matters. For
    a plate with a given displacement use `displaced(...)`. The constraint is enforced by springs between each point and
    the mean of all points, 1e6 times as stiff as the body behind them; an unevenness of about 1e-5 of the displacement
    remains. Finite elements support it in static and quasistatic analyses, in three dimensions and in the plane, for
    faces normal to x, y or z.
    """

    components = ()  # no displacement is prescribed
    damping: ClassVar[float] = 0.0

    body: Annotated[str, "body", "body under the plate"]
    where: Annotated[Any, "condition", "plane face, by undeformed coordinates"]


class Drain(Support):
    """Support that prescribes the pore pressure on a part of the surface of a porous body; its points move freely."""

    components = ()
    body: str
    where: Any

    @property
    def pressure(self) -> float:
        """Prescribed pore pressure at full size, Pa."""
        return 0.0


@dataclass(frozen=True)
class Drained(Drain):
    """Free drainage of a `biphasic` body: fluid crosses the selected surface freely, with pore pressure 0.

    Surfaces without such a support are sealed. It does not hold the solid in place: a porous plate that carries a load
    needs that load declared as well. `outflow(NAME)` is the fluid volume that has left through it. An edge that two of
    these supports share belongs to the first.
    """

    body: Annotated[str, "body", "biphasic body"]
    where: Annotated[Any, "condition", "part of its surface, by undeformed coordinates"]


@dataclass(frozen=True)
class PorePressure(Drain):
    """Prescribes the pore pressure on a part of the surface of a `biphasic` body, as a bath, pump or column does.

    The pressure is relative to the surrounding air; fluid enters or leaves as needed. It acts only on the fluid: the
    pressure of a bath on the solid is a load, `pressure(...)` of the same size. `outflow(NAME)` is the fluid volume
    that has left through it.
    """

    moves = True

    body: Annotated[str, "body", "biphasic body"]
    where: Annotated[Any, "condition", "part of its surface, by undeformed coordinates"]
    value: Annotated[float, "Pa", "pore pressure at full size"]
    amplitude: Annotated[Any | None, "amplitude", "amplitude over time; default: full pressure from the start"] = None

    @property
    def pressure(self) -> float:
        """Prescribed pore pressure at full size, Pa."""
        return self.value

    def part(self, share: float) -> Self:
        """Return the support with its pressure scaled to the fraction `share`."""
        less: Self = scale_field(self, "value", share)
        return less
