"""Bodies: a shape made of a material.

Bodies of plane problems are slices of a plane region with a given thickness; `planar` names the kind of plane problem.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.values_in_states import HasMaterial
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape

Vector3 = tuple[float, float, float]
SLICE = 0.05  # thickness of the slice that represents a body of revolution, as a fraction of its size


@dataclass(frozen=True)
class Solid(HasMaterial):
    """A body of one material that fills a shape, undeformed and stress-free where it is declared."""

    shape: Annotated[Any, "shape", "undeformed geometry"]
    material: Annotated[Any, "material", "material of the body"]
    planar = ""

    def as_it_is(self, material: Any) -> Any:
        """Return the material law that acts in this body: the material unchanged."""
        return material


@dataclass(frozen=True)
class Rigid:
    """A rigid body, such as an instrument, a plate or a floor. It acts on other bodies only by a `contact`.

    It has no material and no mesh. It stays where it is declared unless supports move it as a whole: `displaced(ball,
    by = (0, 0, -1) mm, amplitude = per_state)` or `rotated(...)`, both without `where`. At most one support rotates it;
    this rotation comes first, followed by the sum of the displacements. The gap to another body is measured from the
    exact shape.

    With a `density`, or a `mass` spread evenly over its volume, it moves freely in a dynamic analysis. It then has six
    degrees of freedom and the inertia of its shape, and moves under `gravity(...)`, `point_force(...)` at one of its
    points, `torque(...)` without `where`, and contact forces. The momentum of both bodies together is conserved, with
    friction too; only the deformable body is damped. The report gives its motion in `solve.rigid`. The shape must be a
    sphere, box, cylinder, body of revolution or closed surface. It can touch one body, in three dimensions.

    In a static analysis a known force may press it against a body: `point_force(ball, ...)`, and its weight if it has a
    mass. It then moves along the one direction, x, y or z, that its supports leave free, and its travel is computed.
    `support guide = fixed(ball, components = (x, y))` holds the other directions and all rotations; `displaced(ball, by
    = ..., components = x)` prescribes a displacement there. In the plane only x or y can be free, and for a body of
    revolution only y, without a support. The supports carry the other components of the loads. The body moves until the
    contact force balances the load, within the tolerance of the analysis, at a stable equilibrium; if there is none,
    the model fails. The report gives its `travel_m` and the stiffness against it in `solve.rigid`. With friction each
    state is one step from the previous one.
    """

    shape: Annotated[Any, "shape", "geometry in its initial position"]
    density: Annotated[
        float | None,
        "kg/m^3 in (0, inf)",
        "makes it a free body in a dynamic analysis, and gives it weight in a static one",
    ] = None
    mass: Annotated[float | None, "kg in (0, inf)", "total mass, instead of a density"] = None
    velocity: Annotated[Vector3, "m/s", "initial velocity of a free body"] = (0.0, 0.0, 0.0)
    spin: Annotated[Vector3, "rad/s", "initial angular velocity of a free body about its centre of mass"] = (
        0.0,
        0.0,
        0.0,
    )
    planar = ""

    @property
    def free(self) -> bool:
        """True if the body has a mass or a density, so that it may move freely in a dynamic analysis."""
        return self.density is not None or self.mass is not None


class Planar(HasMaterial):
    """Slice of a plane region from z = -thickness/2 to thickness/2, whose points stay in their planes."""

    region: Any
    thickness: float

    @cached_property
    def shape(self) -> Shape:
        """Slice of the plane region; any other shape is returned unchanged and refused by validation."""
        if self.region.prebuilt:
            return self.slice_of_file
        if not self.region.flat:
            given: Shape = self.region
            return given
        sliced: Shape = self.region.slice(self.thickness)
        return sliced

    @property
    def slice_of_file(self) -> Shape:
        """Slice of a plane region that is read from a file."""
        from softmark.solvers.mesh.plane_region_files import FileSlice

        return FileSlice(self.region, self.thickness)

    def as_it_is(self, material: Any) -> Any:
        """Return the material law that acts in this body: by default the material unchanged."""
        return material


@dataclass(frozen=True)
class PlaneStrain(Planar):
    """A slice of a long body in plane strain: displacements only in x and y, the same for all z.

    The region lies in the plane z = 0. Forces act on the given thickness. The strain along z is zero, so there is a
    stress along z. Models are `fem` with `quad4`, `quad8`, `quad9`, `tri3` or `tri6`. Loads act on the edge, or as
    gravity. Conditions and points use x and y, with z = 0. Frequencies and reduced models are not available, because a
    thick slice also has motions that vary along z. The check of stability covers the whole slice, so it may find such
    an out-of-plane mode in a thick compressed slice; a thin slice behaves as the plane problem.
    """

    region: Annotated[Any, "shape", "a plane region, such as `quadrilateral(...)`, or a `mesh(...)` of plane cells"]
    material: Annotated[Any, "material", "material of the body"]
    thickness: Annotated[float, "m in (0, inf)", "thickness of the slice along z; forces are proportional to it"]
    planar = "plane_strain"


@dataclass(frozen=True)
class PlaneStress(Planar):
    """A thin plate in plane stress: its faces are free, so the stress along z is zero.

    The region lies in the plane z = 0. The stretch along z is solved for at each point so that the stress along z is
    zero, for any material law; a plate in tension grows thinner. The plate stays in its plane and does not buckle out
    of it. Models are `fem` with quadrilaterals or triangles. Volumetric locking does not occur here: `integration =
    selective` and formulations against locking are refused, and so is a Poisson's ratio of 0.5. Everything else is as
    for `plane_strain`.
    """

    region: Annotated[Any, "shape", "a plane region, such as `quadrilateral(...)`, or a `mesh(...)` of plane cells"]
    material: Annotated[Any, "material", "material of the body"]
    thickness: Annotated[float, "m in (0, inf)", "undeformed thickness of the plate"]
    planar = "plane_stress"

    def as_it_is(self, material: Any) -> Any:
        """Return the material law in plane stress: with the stretch along z that makes the stress along z zero."""
        from softmark.solvers.materials.plane_stress import Plate

        return Plate.from_material(material)


@dataclass(frozen=True)
class Axisymmetric(Planar):
    """A body of revolution about the y axis, given by its half section at x >= 0.

    x is the distance from the axis, y runs along the axis and z is the circumferential direction. Points move in x and
    y. Circumferential fibres are stretched by 1 + u_x / x, and points on the axis stay on it. For example, a quarter
    ring that touches the axis is half of a hollow ball, and a quadrilateral away from the axis is a tube. Forces are
    those of the whole body and point along y, because components across the axis cancel. Conditions and points use x
    and y, with z = 0; the components zz of stress, strain and stretch are circumferential. Models are `fem` with
    quadrilaterals or triangles in static analyses, with Poisson's ratios up to 0.5 if `formulation = mixed`. Parts of
    the body are rings, and volumes are those of whole rings. Dynamic analyses and point forces are refused. Torsion and
    buckling into forms without axial symmetry are not covered.
    """

    region: Annotated[Any, "shape", "a plane region with x >= 0, or a `mesh(...)` of one"]
    material: Annotated[Any, "material", "material of the body"]
    planar = "axisymmetric"

    @cached_property
    def thickness(self) -> float:  # type: ignore[override]
        """Thickness of the slice that represents the body, m; any value would give the same results."""
        if self.region.prebuilt:
            from softmark.solvers.mesh.plane_region_files import FileSlice

            bounds = FileSlice(self.region, 1.0).bounds
            (left, low, _), (right, high, _) = bounds or ((0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
        elif self.region.flat:
            (left, low), (right, high) = self.region.ends
        else:  # validation refuses it
            return 1.0
        return float(SLICE * max(right - left, high - low))


@dataclass(frozen=True)
class BeamNetwork:
    """Straight beams of one material between points, rigidly joined where they share a point: frames and lattices.

    Members are pairs of points, counted from 1. Sections are circular (`radius`), tubular (`radius` and `inner`) or
    rectangular: `height` is measured along the component of `up` across the member, and `side` across both. If a member
    points along `up`, its height is measured along x (along y for members along x). Give one section for all members,
    or a list with one for each. With `end_radius`, `end_inner`, `end_side` or `end_height` members taper linearly from
    their first point to their second. The only model is `frame6dof(...)`. Conditions and points use coordinates as
    everywhere; a support acts on points of the axes.
    """

    points: Annotated[tuple[Vector3, ...], "vectors of m", "end points of members"]
    members: Annotated[
        tuple[tuple[int, int], ...], "pairs of 1 in [1, 100000]", "numbers of the two points of each member"
    ]
    material: Annotated[Any, "material", "material of the body"]
    radius: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "radius of round sections"] = None
    inner: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "inner radius of tubular sections"] = None
    side: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "width of rectangular sections across `up`"] = (
        None
    )
    height: Annotated[
        tuple[float, ...] | None, "each of m in (0, inf)", "height of rectangular sections along `up`; default: `side`"
    ] = None
    up: Annotated[Vector3, "direction", "direction in which the height of sections is measured"] = (0.0, 0.0, 1.0)
    end_radius: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "radius at the second point"] = None
    end_inner: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "`inner` at the second point"] = None
    end_side: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "`side` at the second point"] = None
    end_height: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "`height` at the second point"] = None
    planar = ""

    @cached_property
    def shape(self) -> Shape:
        """Geometry of all members of the network."""
        from softmark.solvers.mesh.frame_shapes import Network

        first = self.radius, self.inner, self.side, self.height
        last = self.end_radius, self.end_inner, self.end_side, self.end_height
        return Network(self.points, self.members, *first, self.up, *last)

    def as_it_is(self, material: Any) -> Any:
        """Return the material law that acts in this body: the material unchanged."""
        return material
