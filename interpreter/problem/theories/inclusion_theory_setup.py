"""Setup of the theory of a round inclusion or hole under remote stress, and the stress field of the theory."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.conforming_mesh import cuts_for
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.vocabulary.loads.pressure import PressureLoad
from softmark.interpreter.vocabulary.loads.remote_stress import RemoteStress
from softmark.records import dataclass
from softmark.references.inclusion import BodyWithRoundCore, Hookean
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.materials.linear_elastic import LinearElastic
from softmark.solvers.mesh.plane_regions import QuarterRing, Slice
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.stress_recovery.analytic_stress_field import AnalyticField

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
    from softmark.solvers.stress_recovery.stress_measures import Tensors
else:
    from softmark.solvers.runtime.lazy_modules import np

Vector3 = tuple[float, float, float]

WAYS = ((0.36, 0.48, 0.8), (0.8, 0.6, 0.0), (0.6, 0.0, 0.8), (0.0, 0.28, 0.96), (2 / 3, 1 / 3, 2 / 3), (1.0, 0.0, 0.0))
PLANE = ((0.6, 0.8, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.28, 0.96, 0.0))
ROUND = 1e-9  # relative to the body's size: how much a border may vary around the centre
IN_PLANE = 1e-9  # relative to the body's size: how far beside the centre a plane of symmetry may lie
BALL = 'a `sphere(part = octant)` with one part around its centre, a `spherical_shell(part = octant)`, or a '\
       '`quarter_ring` that turns'  # fmt: skip
SMALL = 0.01  # gradient of the displacement up to which small strain and rotation are said nothing of
LARGE = "it assumes small strains and rotations, but they reach {:.3g} %: a body with large ones differs"
PULLS = "`remote_stress(...)` and `pressure(...)` on the whole outer border, and no other load"


def _elastic_constants(material: LinearElastic, case: Case) -> Hookean:
    """Return the elastic constants of a material; for plane stress, the equivalent ones for plane strain."""
    nu = material.poisson
    return Hookean(material.shear_modulus, nu / (1.0 + nu) if case.planar == "plane_stress" else nu)


# ------------------------------------------------------------------ the body


def _ring_radii(case: Case) -> tuple[float, float]:
    """Return the inner and outer radius, m, of a quarter ring between circles. Raises NotApplicable."""
    region = case.shape.region if isinstance(case.shape, Slice) else None
    if not isinstance(region, QuarterRing) or case.parts:
        raise NotApplicable(
            f"`{case.body.name}` is not a ring of one material", "use `quarter_ring(inner = ..., outer = ...)`"
        )
    if region.inner_y not in (None, region.inner) or region.outer_y not in (None, region.outer):
        raise NotApplicable("its borders are not circles", "remove `inner_y` and `outer_y`")
    return region.inner, region.outer


def inclusion_in_ball(case: Case) -> tuple[float, float, Vector3]:
    """Return the radius of the inclusion and that of the ball, m, and their common centre, m. Raises NotApplicable."""
    shape, name = case.shape, case.body.name
    if case.planar == "axisymmetric":
        return *_ring_radii(case), (0.0, 0.0, 0.0)
    if not isinstance(shape, Sphere | SphericalShell) or shape.part != "octant":
        raise NotApplicable(f"`{name}` is not an octant of a ball", f"use {BALL}")
    if isinstance(shape, SphericalShell):
        if case.parts:
            raise NotApplicable(f"`{name}` has a hollow and also regions of other materials", "use one or the other")
        return shape.inner, shape.radius, shape.origin
    if len(case.parts) != 1:
        raise NotApplicable(
            f"`{name}` has {len(case.parts) or 'no'} regions of other materials", "declare exactly one inclusion"
        )
    return _inclusion_radius(case.parts[0], shape), shape.radius, shape.origin


def _inclusion_radius(part: Declared, shape: Sphere) -> float:
    """Return the radius, m, of a region that is a sphere around the centre of the ball. Raises NotApplicable."""
    where: Condition = part.thing.where
    cuts = [cut for cut in cuts_for(where, shape) if cut.axis == "radius"]
    if not depends_on_radius(where, shape.origin, shape.radius) or len(cuts) != 1:
        raise NotApplicable(
            f"the region `{part.name}` is not a sphere around the centre of the ball",
            f"select a sphere: `where = x^2 + y^2 + z^2 <= a^2`{_distance_origin_note(shape.origin)}",
        )
    if not holds_at_radius(where, shape.origin, 0.5 * cuts[0].at, shape.diagonal):
        raise NotApplicable(
            f"the region `{part.name}` is the part around the inclusion", "declare the inclusion as the region"
        )
    return float(cuts[0].at)


def _distance_origin_note(origin: Vector3) -> str:
    """Return the part of a remedy that states from where distances are measured; empty for a centre at the origin."""
    return ", with distances from its centre" if any(origin) else ""


def depends_on_radius(where: Condition, centre: Vector3, radius: float, planar: bool = False) -> bool:
    """Return whether a condition depends only on the distance from the centre, tested at points of two spheres.

    In two dimensions (`planar`) the points lie in the plane z = 0.
    """
    ways = PLANE if planar else WAYS
    return not where.groups and all(
        max(levels) - min(levels) <= ROUND * radius**border.power
        for border in where.borders
        for r in (0.37 * radius, radius)
        for levels in [[border.at(*_point_at(centre, r, way)) for way in ways]]
    )


def _point_at(centre: Vector3, radius: float, way: Vector3) -> Vector3:
    """Return the point, m, at a distance `radius`, m, from the centre in the direction `way`."""
    x, y, z = (c + radius * w / math.hypot(*way) for c, w in zip(centre, way, strict=True))
    return x, y, z


def holds_at_radius(where: Condition, centre: Vector3, radius: float, extent: float) -> bool:
    """Return whether a condition on the distance from the centre holds at the distance `radius`, m.

    `extent`, m, is the diagonal of the body, from which tolerances are taken.
    """
    return bool(where.holds(*_point_at(centre, radius, PLANE[0]), extent))


# ------------------------------------------------------------------ supports and loads


def check_symmetry_supports(case: Case, planes: tuple[int, ...], centre: Vector3, size: float) -> None:
    """Check that supports hold all given planes through the centre along their normals, and nothing else.

    `planes` are the directions 0 to 2 of their normals; `size`, m, is the scale of tolerances. Raises NotApplicable.
    """
    found = set()
    for support in case.named_supports:
        normal = support.thing.mirror_plane
        if normal is None or abs(normal[1] - centre[normal[0]]) > IN_PLANE * size:
            raise NotApplicable(f"the support `{support.name}` is not a plane of symmetry through the centre",
                          "hold it with `symmetric(...)` only")  # fmt: skip
        found.add(normal[0])
    if missing := [axis for axis in planes if axis not in found]:
        raise NotApplicable(f"its plane normal to {'xyz'[missing[0]]} through the centre is not held",
                      "use `symmetric(...)` on the planes of a part of a ball or a ring")  # fmt: skip


def _applied_stress(case: Case, inner: float, outer: float, centre: Vector3) -> Vector3:
    """Return the normal stresses, Pa, along x, y and z that loads apply on the outer border. Raises NotApplicable."""
    total = [0.0, 0.0, 0.0]
    for load in case.loads:
        action = load.thing.action
        if not isinstance(action, RemoteStress | PressureLoad):
            raise NotApplicable(f"the theory does not include the load `{load.name}`", f"use {PULLS}")
        if not _covers_border(action.where, case, inner, outer, centre):
            raise NotApplicable(f"the load `{load.name}` does not act on exactly the whole outer border",
                          "select it by the distance from the centre: `where = x^2 + y^2 + z^2 >= b^2`"
                          f"{_distance_origin_note(centre)}")  # fmt: skip
        for axis, along in enumerate(_stress_of_load(load, case)):
            total[axis] += along
    if not case.loads:
        raise NotApplicable("no load acts on the body", f"use {PULLS}")
    return total[0], total[1], total[2]


def _covers_border(where: Condition, case: Case, inner: float, outer: float, centre: Vector3) -> bool:
    """Return whether a condition holds on the whole outer border, and not on the border of a hole."""
    extent, hollow = case.shape.diagonal, not case.parts
    return (
        depends_on_radius(where, centre, outer, bool(case.planar))
        and holds_at_radius(where, centre, outer, extent)
        and not (hollow and holds_at_radius(where, centre, inner, extent))
    )


def _stress_of_load(load: Declared, case: Case) -> Vector3:
    """Return the normal stresses, Pa, along x, y and z that one load applies. Raises NotApplicable."""
    action = load.thing.action
    if isinstance(action, PressureLoad):
        p = -action.pressure
        return p, p, 0.0 if case.planar and not case.depth else p
    x, y, z = (action.stress * c**2 for c in action.direction)
    if max(map(abs, action.direction)) < 1.0:
        raise NotApplicable(
            f"`{load.name}` pulls in an oblique direction",
            "use a tension along x, y or z, which is symmetric about all planes",
        )
    return x, y, x if case.depth else z  # across the axis of a body of revolution it pulls all around


# ------------------------------------------------------------------ stress field


@dataclass(frozen=True)
class InclusionStress(AnalyticField):
    """Exact stress field of the theory around an inclusion, by formulas in place of a mesh."""

    theory: BodyWithRoundCore

    def at(self, X: Floats) -> Tensors:
        """Return the stress, Pa, at points X (n, 3), m, of the undeformed body."""
        from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC
        from softmark.solvers.stress_recovery.stress_measures import Tensors

        H, sigma = self.theory.fields(X)
        return Tensors(np.stack([sigma[:, i, j] for i, j in SYMMETRIC], axis=1), H.reshape(-1, 9), True)

    def count_interface_points(self, X: Floats) -> int:
        """Return how many of the points X (n, 3), m, lie on the interface, where the stress has two values."""
        return int(self.theory.on_border(X).sum())

    @property
    def usual(self) -> tuple[float, float, float]:
        """Return scales for relative errors: remote stress, Pa, strain of the matrix, and deviatoric remote stress, Pa.

        Each is the Frobenius norm of the tensor that the remote stress causes without the inclusion.
        """
        stress, mean = self.theory.stress, sum(self.theory.stress) / 3.0
        far = 0.5 / self.theory.matrix.shear_modulus
        deviator = math.hypot(*(t - mean for t in stress))
        soft = self.theory.matrix.softness(3) * mean
        return math.hypot(*stress), math.hypot(far * deviator, math.sqrt(3.0) * soft), deviator


# ------------------------------------------------------------------ setups


class InclusionSetup(TheorySetup):
    """Makes the problem of a spherical inclusion or cavity in a ball under remote stress."""

    dimensions: Literal[2, 3] = 3

    def problem_from(self, reference: Declared, case: Case) -> BodyWithRoundCore:
        for material in (case.body.thing.material, *(part.thing.material for part in case.parts)):
            if not isinstance(material, LinearElastic):
                raise NotApplicable(
                    f"`{case.body.name}` does not consist of linear elastic solids", "use `linear_elastic(...)`"
                )
        inner, outer, centre = self.radii_and_centre(case)
        planes = (0, 1, 2) if not case.planar else (1,) if case.depth else (0, 1)
        check_symmetry_supports(case, planes, centre, outer)
        stress = _applied_stress(case, inner, outer, centre)
        core = _elastic_constants(case.parts[0].thing.material, case) if case.parts else None
        thin = case.body.thing.material.poisson if case.planar == "plane_stress" else None
        return BodyWithRoundCore(
            self.dimensions,
            core,
            _elastic_constants(case.body.thing.material, case),
            inner,
            outer,
            stress,
            centre,
            thin,
        )

    def radii_and_centre(self, case: Case) -> tuple[float, float, Vector3]:
        """Return the radii of inclusion and body, m, and their common centre, m. Raises NotApplicable."""
        return inclusion_in_ball(case)

    def stress(self, solution: BodyWithRoundCore) -> InclusionStress:
        return InclusionStress(solution)

    def warning(self, solution: BodyWithRoundCore) -> str | None:
        """Return a warning if deformations are too large for this theory of small strain, else None."""
        large = solution.largest_gradient
        return LARGE.format(100.0 * large) if large > SMALL else None

    def facts(self, solution: BodyWithRoundCore) -> Mapping[str, Any]:
        place = "around the hole" if solution.core is None else "at the border of the inclusion"
        note = (
            f"it is exact for a body of this size; stress {place} differs from that in an infinite body by up to "
            f"{100.0 * solution.size_matters:.3g} % of the remote stress"
        )
        warning = self.warning(solution)
        return {"size_matters": solution.size_matters, "said": f"{note}; {warning}" if warning else note}


class HoleSetup(InclusionSetup):
    """Makes the problem of a round hole in a plate under remote stress."""

    dimensions = 2

    def radii_and_centre(self, case: Case) -> tuple[float, float, Vector3]:
        """Return the radius of the hole and that of the plate, m, and their common centre, m. Raises NotApplicable."""
        if case.planar not in ("plane_strain", "plane_stress"):
            raise NotApplicable(f"`{case.body.name}` is not a plate", "use `plane_stress(...)` or `plane_strain(...)`")
        return *_ring_radii(case), (0.0, 0.0, 0.0)
