"""Base classes of loads: `Load`, which a scene declares, and `Action`, the way in which a load acts on a body.

A load is one file of this package and two lines at the table `LOADS`. It holds the words of the scene, its forces on a
solid, a second formula for these forces, its resultant, and what it requires of planes, axes and symmetry. Models,
checks and reports ask the load for these and name no kind of load; only models of beams, networks and single points,
and references of one theory, list the actions that they support, and refuse all others.

Forces are written with the operations of `SolidForces` (models/shared/load_setup.py) and, in a second form, of
`IndependentForces` (verification/load_forces_check.py). Both integrate over regions, varying density, partly selected
facets and rings of bodies of revolution.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

from softmark.interpreter.vocabulary.values_in_states import in_state_of_value, scale_field

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from softmark.solvers.energies.energy import Energy

    Floats = NDArray[Any]
    Push = Callable[[Floats], Floats]  # forces (..., 3), N, on outward area vectors (..., 3), m^2

Vector3 = tuple[float, float, float]
Matrix3 = tuple[Vector3, Vector3, Vector3]
Reason = tuple[str, str, str, str]  # why a load is refused: field at fault ("" for all), problem, label and help

AMPLITUDE = "amplitude over time or from state to state; default: full load from the start"
NOTHING: Vector3 = (0.0, 0.0, 0.0)


class SolidForces(Protocol):
    """Operations that turn loads into energies, with nodal forces, of a solid mesh; the solver uses them."""

    small: bool  # small strain: loads act on the undeformed body

    def mass_forces(self, constant: Vector3, gradient: Matrix3 | None = None) -> Energy:
        """Return the energy of a force per mass `constant + gradient x`, m/s^2, in the current positions x, m."""

    def area_forces(self, where: Any, push: Push, linear: bool) -> Energy:
        """Return dead forces on the selected surface; `push` maps area vectors, m^2, to forces, N.

        `linear` states whether `push` is linear.
        """

    def follower_pressure(self, where: Any, pressure: float) -> Energy:
        """Return the energy of a pressure, Pa, on the selected part of the deformed surface."""

    def surface_moment(self, where: Any, moment: Vector3) -> Energy:
        """Return the energy of a moment, N m, on the selected part of the surface."""

    def point_force(self, at: Vector3, force: Vector3) -> Energy:
        """Return the energy of a dead force, N, at a material point, m."""

    def line_force(self, begin: Vector3, end: Vector3, force: Vector3) -> Energy:
        """Return the energy of a dead force per length, N/m, along a straight line, m."""


class IndependentForces(Protocol):
    """Operations that turn loads into nodal forces (n, 3), N, with their uncertainty, N, for verification.

    They are the operations of `SolidForces`, computed by other formulas.
    """

    small: bool

    def mass_forces(self, constant: Vector3, gradient: Matrix3 | None = None) -> tuple[Floats, float]:
        """Return the forces of a force per mass `constant + gradient x`, m/s^2, and their rounding error, N."""

    def area_forces(self, where: Any, push: Push, linear: bool = False, deformed: bool = False) -> tuple[Floats, float]:
        """Return the forces of a traction on the selected surface; `push` maps area vectors, m^2, to forces, N.

        `linear` states whether `push` is linear. With `deformed` the area vectors are those of the deformed surface.
        """

    def surface_moment(self, where: Any, moment: Vector3) -> tuple[Floats, float]:
        """Return the forces of a moment, N m, on the selected part of the surface, and their rounding error, N."""

    def point_force(self, at: Vector3, force: Vector3) -> tuple[Floats, float]:
        """Return the forces of a force, N, at a material point, m, and their rounding error, N."""

    def line_force(self, begin: Vector3, end: Vector3, force: Vector3) -> tuple[Floats, float]:
        """Return the forces of a force per length, N/m, along a straight line, m, and their rounding error, N."""


class ExactBody(Protocol):
    """The body of a scene, without a mesh, on which exact resultants are computed."""

    def mass(self) -> float | None:
        """Return the mass of a homogeneous body, kg; None if it varies or is not known."""

    def area(self, where: Any) -> tuple[float, Vector3] | None:
        """Return the selected area, m^2, and its area vector, m^2; None if they are not known exactly."""


class BodySize(Protocol):
    """Size of a meshed body, by which the order of magnitude of load forces is estimated."""

    def mass(self) -> float:
        """Return the mass, kg, with the largest density."""

    def length(self) -> float:
        """Return the largest distance of two nodes, m."""

    def area(self, where: Any) -> float:
        """Return the selected area, m^2."""


class Action:
    """Base class of the actions of loads on a body, such as a body force or a surface traction.

    Models apply actions. Each kind of action overrides the attributes and methods in which it differs.
    """

    dead: ClassVar[bool] = False  # forces do not depend on the deformation
    conservative: ClassVar[bool] = False  # forces have an energy, so that the tangent is symmetric
    balanced: ClassVar[bool] = False  # its forces and moments sum to zero
    unsupported: ClassVar[tuple[str, str] | None] = None  # label and help where a model does not support it
    exclusive: ClassVar[bool] = False  # a body can have only one of them
    in_dynamics: ClassVar[str] = ""  # why it is refused in dynamic analyses

    @property
    def surface(self) -> Any:
        """Condition that selects the loaded part of the surface; None if the load does not act on the surface."""
        return None

    @property
    def points(self) -> tuple[tuple[str, Vector3], ...]:
        """Points at which the load is singular, each with its field in the scene and its position, m.

        They are the point of a point force, or both ends of a line load.
        """
        return ()

    @property
    def length(self) -> float | None:
        """Length of the line along which the load acts, m; None if it does not act along a line."""
        return math.dist(*(point for _, point in self.points)) if len(self.points) == 2 else None

    @property
    def vector(self) -> Vector3:
        """Vector along the constant direction of the load; zero if it has none."""
        return NOTHING

    @property
    def moment_vector(self) -> Vector3 | None:
        """Moment of a load without a resultant force, N m; None for all other loads."""
        return None

    def plane_fault(self, revolved: bool) -> Reason | None:
        """Return the reason why a plane body, in x and y, cannot carry the load, or None.

        `revolved` is true for a body of revolution about the y axis.
        """
        if not self.vector[2]:
            return None
        return (
            "",
            "pulls a plane body out of its plane",
            "it has a component along z",
            "remove the z component: the body lies in the x-y plane",
        )

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a body of revolution about the y axis cannot carry the load, or None."""
        return None

    def mirror_fault(self, axis: int, place: float, plane: str) -> Reason | None:
        """Return the reason why the load is not symmetric about a plane, or None.

        The plane is normal to the coordinate `axis` (0 to 2) at `place`, m; `plane` names it in messages.
        """
        return None

    def exact_resultant(self, body: ExactBody) -> tuple[Vector3 | None, float | None]:
        """Return the exact resultant force, N, and the loaded area, m^2; None for what is not known."""
        return None, None

    def size(self, body: BodySize) -> float:
        """Return the order of magnitude of the resultant force of the load, N; 0 if it has none."""
        return 0.0

    def on_rigid_body(self, mass: Callable[[], float]) -> tuple[Vector3, Vector3 | None, Vector3] | None:
        """Return the force, N, its point, m, and the moment, N m, that the load exerts on a rigid body.

        The point None is the centre of mass. `mass` computes the mass of the body, kg. The result is None if the load
        does not act on rigid bodies.
        """
        return None

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the load on a solid mesh, at full size."""
        # models refuse such a load when a scene is checked
        raise NotImplementedError(f"{type(self).__name__} has no forces on a solid")

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float] | None:
        """Return the nodal forces (n, 3), N, of the load by independent formulas, and their uncertainty, N.

        The result is None if there are no such formulas.
        """
        return None


class SolidAction(Action):
    """An action that every model of a solid supports; it defines `solid_energy` and `independent_forces`."""


class SurfaceAction(SolidAction):
    """An action on a part of the surface, which the field `where` selects."""

    where: Any

    @property
    def surface(self) -> Any:
        """Condition that selects the loaded part of the surface."""
        return self.where

    def traction_on(self, normal: Floats) -> tuple[Floats, float] | None:
        """Return the traction (3,), Pa, on a face with a unit normal (3,), and the follower pressure, Pa.

        The traction is per undeformed area. The result is None if the traction is not given at each point, as for a
        moment.
        """
        return None


class Load:
    """Base class of the loads that a scene can declare; `action` is how the load acts on a body."""

    strength = ""  # name of the field with the size of the load
    amplitude: Any = None  # amplitude over time, or from state to state

    @property
    def action(self) -> Any:
        """Action of the load: an instance of one of the classes above, which models apply."""
        # every load defines its action; a plugin without one is refused when it is loaded
        raise NotImplementedError(f"{type(self).__name__} does not say how it acts")

    def part(self, share: float) -> Self:
        """Return the load scaled to the fraction `share` of its full size."""
        less: Self = scale_field(self, self.strength, share)
        return less

    def in_state(self, number: int, value: float) -> Self:
        """Return the load in one state of a static analysis, which has this number and value."""
        now: Self = in_state_of_value(self, value)
        return now
