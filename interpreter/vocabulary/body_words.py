"""Bodies: a shape made of a material.

Those of plane problems are slices of a plane region, a given thickness of it: `planar` says which problem it is.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.load_words import MadeOf
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape

Vector3 = tuple[float, float, float]
SLICE = 0.05  # of its size: how thick the slice is that stands for a body of revolution


@dataclass(frozen=True)
class Solid(MadeOf):
    """A body of one material that fills a shape, undeformed and free of stress where it is declared."""

    shape: Annotated[Any, "shape", "its geometry before deformation"]
    material: Annotated[Any, "material", "what it is made of"]
    planar = ""

    def as_it_is(self, material: Any) -> Any:
        """A material, as it is in this body."""
        return material


@dataclass(frozen=True)
class Rigid:
    """A body that nothing deforms: an instrument, a plate, a floor. It acts on others through a `contact` alone.

    It has no material and no mesh, and stays where it is declared, or goes where supports take it as a whole:
    `displaced(ball, by = (0, 0, -1) mm, course = state)`, `turned(...)`, without a `where`: it is turned first, by one
    of them, and goes by the sum of what others say. The gap between it and what it touches is that of the shape itself.

    With a `density`, or a `mass` that is spread over its volume, it is free in a dynamic analysis: it has six degrees
    of freedom, the inertia of its shape, and moves as `gravity(...)`, a `point_force(...)` at a point of it, a
    `torque(...)` without `where` and what it touches let it; momentum of both together is kept, with friction too, and
    damping is that of the body that deforms alone. A report says how in `solve.rigid`. Spheres, boxes, cylinders,
    bodies of revolution and closed surfaces have a mass; it meets one body, in space.

    At rest a known force may press it: `point_force(ball, ...)`, and its weight where it has a mass. How far it goes
    is found, along the one way, x, y or z, that is left to it: `support guide = fixed(ball, components = (x, y))` holds
    it in the others, and so from turning, or `displaced(ball, by = ..., components = x)` takes it along there. A body
    in the plane leaves it x or y, and one of revolution y alone, without a support. What holds it bears the rest of its
    loads. It goes on until what it meets bears the force, to the tolerance of the analysis, and resists more of it;
    where nothing does there is no answer. `solve.rigid` of the report has its `travel_m`, and the stiffness that it
    meets. With friction each state is one step from the one before.
    """

    shape: Annotated[Any, "shape", "its geometry where it is declared"]
    density: Annotated[
        float | None, "kg/m^3 in (0, inf)", "makes it free to move and turn in time; its weight at rest"
    ] = None
    mass: Annotated[float | None, "kg in (0, inf)", "what it weighs in all, in place of a density"] = None
    velocity: Annotated[Vector3, "m/s", "of a free one at the start"] = (0.0, 0.0, 0.0)
    spin: Annotated[Vector3, "rad/s", "angular velocity of a free one at the start, about its centre of mass"] = (
        0.0,
        0.0,
        0.0,
    )
    planar = ""

    @property
    def free(self) -> bool:
        """Whether it has a mass."""
        return self.density is not None or self.mass is not None


class Planar(MadeOf):
    """A slice of a plane region, from z = -thickness/2 to thickness/2: its points stay in their planes."""

    region: Any
    thickness: float

    @cached_property
    def shape(self) -> Shape:
        """The slice; a shape that is no plane region as it is, which is refused."""
        if self.region.prebuilt:
            return self.of_file
        if not self.region.flat:
            given: Shape = self.region
            return given
        sliced: Shape = self.region.slice(self.thickness)
        return sliced

    @property
    def of_file(self) -> Shape:
        """The slice of a region in a file."""
        from softmark.solvers.mesh.plane_region_files import FlatFile

        return FlatFile(self.region, self.thickness)

    def as_it_is(self, material: Any) -> Any:
        """A material, as it is in this body."""
        return material


@dataclass(frozen=True)
class PlaneStrain(Planar):
    """A slice of a long body that cannot grow or shrink along z: displacements in x and y alone, the same for all z.

    The region lies in the plane z = 0. Forces are those on the given thickness, and stress along z is what keeps it so.
    Models are `fem` with `quad4`, `quad8`, `quad9`, `tri3` or `tri6`. Loads act on the edge, or as gravity. Conditions,
    and points, are of x and y, with z = 0. Frequencies are not found, nor reduced models made: a thick slice has
    motions that vary through it, which the plane has not. Whether an equilibrium is stable is judged of the slice
    as well, which may find such a motion in one that is thick and pressed: thin slices are as the plane.
    """

    region: Annotated[Any, "shape", "a plane region, such as `quadrilateral(...)`, or a `mesh(...)` of plane cells"]
    material: Annotated[Any, "material", "what it is made of"]
    thickness: Annotated[float, "m in (0, inf)", "of the slice, along z: forces are proportional to it"]
    planar = "plane_strain"


@dataclass(frozen=True)
class PlaneStress(Planar):
    """A thin plate in its plane, its faces free: no stress along z, and as much strain as that takes.

    The region lies in the plane z = 0. At each point the stretch along z is found that leaves no stress there, whatever
    the law, so that the plate grows thinner where it is pulled; it stays in its plane, and does not buckle out of it.
    Models are `fem` with quadrilaterals or triangles, which do not lock here: `integration = selective` and
    formulations against locking are refused, and so is a Poisson's ratio of 0.5. Otherwise as `plane_strain`.
    """

    region: Annotated[Any, "shape", "a plane region, such as `quadrilateral(...)`, or a `mesh(...)` of plane cells"]
    material: Annotated[Any, "material", "what it is made of"]
    thickness: Annotated[float, "m in (0, inf)", "of the plate at rest"]
    planar = "plane_stress"

    def as_it_is(self, material: Any) -> Any:
        """A material, as it is in this body."""
        from softmark.solvers.materials.plane_stress import Thin

        return Thin.made(material)


@dataclass(frozen=True)
class Axisymmetric(Planar):
    """A body of revolution about the y axis, by the half of its section that lies where x >= 0.

    x is the distance from the axis and y goes along it; z is around. Points move in x and y, rings around the axis are
    stretched by 1 + u_x / x, and what lies on the axis stays on it. A quarter ring that touches the axis is half of a
    hollow ball, a quadrilateral beside it a tube. Forces are those of the whole body, and along y: across the axis they
    cancel. Conditions and points are of x and y, with z = 0; components zz of stress, strain and stretch are those
    around the axis. Models are `fem` with quadrilaterals or triangles, at rest, which take Poisson's ratios up to 0.5
    with `formulation = mixed`. Parts of it are rings; their volumes are those of whole rings. Motions and forces at
    points are refused. Twist is not known, nor what buckles out of the form.
    """

    region: Annotated[Any, "shape", "a plane region with x >= 0, or a `mesh(...)` of one"]
    material: Annotated[Any, "material", "what it is made of"]
    planar = "axisymmetric"

    @cached_property
    def thickness(self) -> float:  # type: ignore[override]
        """Of the slice that stands for it, m: any would do."""
        if self.region.prebuilt:
            from softmark.solvers.mesh.plane_region_files import FlatFile

            bounds = FlatFile(self.region, 1.0).bounds
            (left, low, _), (right, high, _) = bounds or ((0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
        elif self.region.flat:
            (left, low), (right, high) = self.region.ends
        else:  # which is refused
            return 1.0
        return float(SLICE * max(right - left, high - low))


@dataclass(frozen=True)
class BeamNetwork:
    """Straight beams between points, of one material, rigidly joined where they share a point: frames and lattices.

    Members are pairs of points, counted from 1. Sections are round (`radius`), rings (`inner`) or rectangular: `height`
    along `up`, as far as that is across the member, and `side` across both; of members along `up` the height is along
    x (along y of those along x). One section for all, or a list with one for each member. With `end_radius` and its
    like members taper, linearly from their first point to their second. Models are `frame6dof(...)` alone. Conditions
    and points are of coordinates as everywhere; a support takes points of the axes.
    """

    points: Annotated[tuple[Vector3, ...], "vectors of m", "where members begin and end"]
    members: Annotated[tuple[tuple[int, int], ...], "pairs of 1 in [1, 100000]", "the two points of each member"]
    material: Annotated[Any, "material", "what it is made of"]
    radius: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "radius of round sections"] = None
    inner: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "radius of the hollow of round sections"] = None
    side: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "extent of rectangular sections across `up`"] = (
        None
    )
    height: Annotated[
        tuple[float, ...] | None, "each of m in (0, inf)", "extent of rectangular sections along `up`; `side` without"
    ] = None
    up: Annotated[Vector3, "direction", "which way sections are upright"] = (0.0, 0.0, 1.0)
    end_radius: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "radius at the second point"] = None
    end_inner: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "`inner` at the second point"] = None
    end_side: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "`side` at the second point"] = None
    end_height: Annotated[tuple[float, ...] | None, "each of m in (0, inf)", "`height` at the second point"] = None
    planar = ""

    @cached_property
    def shape(self) -> Shape:
        """Its members as one geometry."""
        from softmark.solvers.mesh.frame_shapes import Network

        first = self.radius, self.inner, self.side, self.height
        last = self.end_radius, self.end_inner, self.end_side, self.end_height
        return Network(self.points, self.members, *first, self.up, *last)

    def as_it_is(self, material: Any) -> Any:
        """A material, as it is in this body."""
        return material
