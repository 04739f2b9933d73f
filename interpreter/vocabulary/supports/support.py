"""Base classes of supports: `Support`, and `DisplacementSupport` for those that prescribe displacement components.

A support is one file of this package and two lines at the table `SUPPORTS`. It holds the words of the scene, the
displacements, springs or pore pressure that it prescribes, a second formula for these, and what it requires of planes,
axes and analyses. Models, checks and reports ask the support for these and name no kind of support; only models of
networks, curved beams and single points, and references of one theory, list the kinds that they support, and refuse
all others. A class derived directly from `Support` is supported only by models that list it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from softmark.interpreter.vocabulary.values_in_states import in_state_of_value, scale_field

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.vocabulary.loads.load import Reason
    from softmark.solvers.mesh.shape import Shape

    Floats = NDArray[np.float64]
    Measured = Mapping[str, Any]  # tracked points of measurements, by name
else:
    from softmark.solvers.runtime.lazy_modules import np

Vector3 = tuple[float, float, float]
NOTHING: Vector3 = (0.0, 0.0, 0.0)
OFF_NODES = "supports are exchanged as imposed displacements of nodes"


class UndefinedMotion(Exception):
    """Exception for a support whose motion is not defined; it carries the code of the error and its reason.

    The problem in the reason continues the name of the support.
    """

    def __init__(self, code: str, reason: Reason) -> None:
        super().__init__(reason[1])
        self.code, self.reason = code, reason


class Support:
    """Base class of supports: the motion that they prescribe, and properties that models and checks use.

    The defaults describe a support that does not move. Each kind of support overrides the properties in which it
    differs.
    """

    role: ClassVar[Literal["constraint", "springs", "drain"]] = "constraint"
    implied: ClassVar[bool] = False  # a plane body adds it itself, and reports do not name it
    on_rigid_bodies: ClassVar[bool] = False  # it can hold or move a rigid body
    is_symmetry_plane: ClassVar[bool] = False  # the body is one half of a symmetric body
    prescribes_rotation: ClassVar[bool] = False  # its kind imposes an angle, which may be zero
    is_massless_plate: ClassVar[bool] = False  # its face stays parallel to itself; dynamic analyses refuse it
    unsupported_help: ClassVar[str] = ""  # help where a model does not support it; "": names such models
    nonrigid_reason: ClassVar[str] = ""  # why it does not move cross-sections as rigid bodies; "": it does
    export_fault: ClassVar[str] = ""  # why it cannot be exchanged with other programs; "": it can
    moves = False  # True if it imposes a motion
    damping = 0.0  # traction per velocity, Pa s/m, of its dashpots
    amplitude: Any = None  # amplitude over time, or from state to state
    components: tuple[int, ...]  # directions (0 x, 1 y, 2 z) that are held
    through: Vector3 | None = None  # point on the axis of its rotation, m

    @property
    def tracked(self) -> str | None:
        """Name of the measurement whose points the support follows, None for other supports."""
        return None

    @property
    def displacement(self) -> Vector3:
        """Prescribed displacement at full load, m, the same for all points of the support."""
        return NOTHING

    @property
    def imposed(self) -> Vector3:
        """Prescribed displacement at full load, m, with zeros in the directions that stay free."""
        x, y, z = (v if c in self.components else 0.0 for c, v in enumerate(self.displacement))
        return x, y, z

    @property
    def rotation(self) -> Vector3:
        """Prescribed rotation at full load as a vector along the axis, rad; it may exceed a full turn."""
        return NOTHING

    @property
    def rotates(self) -> bool:
        """True if the support rotates its points, so that displacements are not proportional to the load."""
        return any(self.rotation)

    @property
    def displaces(self) -> bool:
        """True if the support imposes displacements in proportion to the load that are not zero."""
        return any(self.displacement)

    @property
    def follows_amplitude(self) -> bool:
        """True if its motion follows `amplitude`, which all moving supports of a body share in dynamics."""
        return self.moves

    @property
    def mirror_plane(self) -> tuple[int, float] | None:
        """Index of the coordinate that is constant on its plane of symmetry, and its value, m; None without one."""
        return None

    @property
    def hinge_axis(self) -> Vector3 | None:
        """Axis about which it lets cross-sections rotate; None without such an axis."""
        return None

    @property
    def carries_moments(self) -> bool:
        """True if it prevents a rotation of the cross-sections at its points."""
        return True

    @property
    def clamps(self) -> bool:
        """True if it prevents all rotations of cross-sections."""
        return self.carries_moments and self.hinge_axis is None

    def prevents_rotation(self, planar: bool) -> bool:
        """Return whether the selected part of a solid cannot rotate, except as prescribed."""
        return self.rotates or set(range(2 if planar else 3)) <= set(self.components)

    def prescribed_displacements(self, X: Floats, share: float = 1.0, measured: Measured | None = None) -> Floats:
        """Return the displacements (n, 3), m, prescribed at points X (n, 3), m, at the fraction `share` of the load.

        `measured` has the tracked points of measurements, by name. Raises UndefinedMotion.
        """
        return np.tile(share * np.array(self.displacement), (len(X), 1))

    def independent_positions(self, X: Floats) -> Floats | None:
        """Return the prescribed positions (n, 3), m, of points X (n, 3), m, by another formula for verification.

        The result is None if there is no such formula.
        """
        from softmark.solvers.independent_forces.rigid_friction_forces import move_points

        through = np.array(X[0] if self.through is None else self.through)
        return move_points(X, np.array(self.displacement), np.array(self.rotation), through)

    def body_fault(self, name: str, body: str, shape: Shape) -> tuple[str, Reason] | None:
        """Return the code of the error and the reason if the support does not fit its body, or None.

        `name` is the name of the support, `body` that of the body, and `shape` its shape, which may be a file.
        """
        return None

    def plane_fault(self) -> Reason | None:
        """Return the reason why a plane body, in x and y, cannot have the support, or None."""
        if not any(self.rotation[:2]) and not (2 in self.components and self.displacement[2]):
            return None
        return (
            "",
            "moves a plane body out of its plane",
            "it has a component along z",
            "remove the z component: the body lies in the x-y plane",
        )

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a body of revolution about the y axis cannot have the support, or None."""
        return None

    def part(self, share: float) -> Self:
        """Return the support with its motion scaled to the fraction `share` of its full size."""
        return self

    def in_state(self, number: int, value: float) -> Self:
        """Return the support in one state of a static analysis, which has this number and value."""
        moved: Self = in_state_of_value(self, value)
        return moved


class DisplacementSupport(Support):
    """Support that prescribes some displacement components at all points selected by `where`.

    `components` are the prescribed directions, and `displacement` has their values.
    """

    where: Any


class UniformSupport(DisplacementSupport):
    """Support that prescribes the same displacement at all its points; every model supports it."""

    on_rigid_bodies = True


class VectorMotion(Support):
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
