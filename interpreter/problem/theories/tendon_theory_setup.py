"""Setup of the theory of a tendon-driven rod: makes the rod of a case."""

from __future__ import annotations

import math
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.theories.beam_theory_setup import clamped_end
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.references.straight_cantilever import Disc, NotApplicable, Rectangle, Ring
from softmark.references.tendon_driven_rod import DrivenRod, TendonRoute
from softmark.solvers.mesh.shape import Vector3, add_multiples, cross
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.mesh.tubes import Tube

NEAR = 1e-9  # relative to the length: tolerance of the force position


class TendonRodSetup(TheorySetup):
    """Makes the problem of a clamped rod that tendons bend."""

    def problem_from(self, reference: Declared, case: Case) -> DrivenRod:
        shape, name = case.shape, case.body.name
        if not isinstance(shape, Cylinder | Tube | Box):
            raise NotApplicable(
                f"`{name}` is not a straight body with a constant section", "use a cylinder, a tube or a box"
            )
        if case.parts:
            raise NotApplicable(
                f"the region `{case.parts[0].name}` has another material", "use one material for the whole body"
            )
        root, axis = clamped_end(case)
        frame = _section_frame(axis)
        tip = add_multiples(root, (shape.length, axis))
        force, routes = [0.0, 0.0, 0.0], []
        for load in case.loads:
            match load.thing.action:
                case BodyForce():
                    pass
                case PointLoad(at=at, force=pull) if math.dist(at, tip) <= NEAR * shape.length:
                    force = [a + b for a, b in zip(force, pull, strict=True)]
                case TendonLoad(guides=int()):
                    raise NotApplicable(f"the tendon `{load.name}` is straight between its guides",
                                  "remove `guides`: the theory assumes guides along the whole tendon")  # fmt: skip
                case TendonLoad() as tendon:
                    routes.append(_tendon_route(tendon, root, frame))
                case _:
                    raise NotApplicable(f"the theory does not include the load `{load.name}`",
                                  "use tendons, gravity and a force at the centre of the free end")  # fmt: skip
        if not routes:
            raise NotApplicable("no tendon drives the beam", "add one: `load pull = tendon(...)`")
        line = case.material.density * _declared_section(shape, frame).area
        weight = add_multiples((0.0, 0.0, 0.0), (line, case.gravity))
        stiffness = _rod_stiffness(case, frame)
        return DrivenRod(shape.length, stiffness, root, frame, weight, (force[0], force[1], force[2]), tuple(routes))


def _section_frame(axis: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Return three orthonormal vectors, of which the first is the given axis and the others span the section.

    They are coordinate axes if the given axis is one.
    """
    i = max(range(3), key=lambda k: abs(axis[k]))
    seed = [0.0, 0.0, 0.0]
    seed[(i + 1) % 3] = 1.0
    along = sum(a * b for a, b in zip(seed, axis, strict=True))
    across = [s - along * a for s, a in zip(seed, axis, strict=True)]
    size = math.hypot(*across)
    x, y, z = (c / size for c in across)
    return axis, (x, y, z), cross(axis, (x, y, z))


def _tendon_route(tendon: TendonLoad, root: Vector3, frame: tuple[Vector3, Vector3, Vector3]) -> TendonRoute:
    """Return the route of a tendon in the coordinates of a rod with this root, m, and frame.

    It begins at the end of the tendon that is nearer to the clamp.
    """
    ends = []
    for point in (tendon.begin, tendon.end):
        away = [p - r for p, r in zip(point, root, strict=True)]
        ends.append([sum(a * e for a, e in zip(away, unit, strict=True)) for unit in frame])
    (begin, *first), (end, *last) = sorted(ends)
    return TendonRoute(max(begin, 0.0), end, (first[0], first[1]), (last[0], last[1]), tendon.winding, tendon.tension)


def _declared_section(shape: Any, frame: tuple[Vector3, Vector3, Vector3]) -> Disc | Ring | Rectangle:
    """Return the cross-section as declared; the height of a box lies along the third vector of `frame`."""
    if isinstance(shape, Cylinder):
        return Disc(shape.radius)
    if isinstance(shape, Tube):
        return Ring(shape.radius, shape.inner)
    width, height = (sum(abs(e) * s for e, s in zip(unit, shape.size, strict=True)) for unit in frame[1:])
    return Rectangle(height=height, width=width)


def _rod_stiffness(case: Case, frame: Any) -> tuple[float, float, float, float, float, float]:
    """Return the section stiffnesses EA, GA2, GA3, N, and GJ, EI2, EI3, N m^2, of the rod of a case.

    Models compute their own, so that a mistake there shows as a difference from the theory.
    """
    return section_stiffness(_declared_section(case.shape, frame), case.material.young, case.material.poisson)


def section_stiffness(
    section: Disc | Ring | Rectangle, E: float, nu: float
) -> tuple[float, float, float, float, float, float]:
    """Return the stiffnesses EA, GA2, GA3, N, and GJ, EI2, EI3, N m^2, of a section with Young's modulus E, Pa.

    The height of a rectangle lies along its second axis.
    """
    G = E / (2.0 * (1.0 + nu))
    shear = section.shear_factor(nu) * G * section.area
    about_2, about_3, J = section.second_moment, section.second_moment, 2.0 * section.second_moment
    if isinstance(section, Rectangle):
        about_3 = Rectangle(height=section.width, width=section.height).second_moment
        J = _rectangle_torsion_constant(section.height, section.width)
    return E * section.area, shear, shear, G * J, E * about_2, E * about_3


def _rectangle_torsion_constant(height: float, width: float) -> float:
    """Return the torsion constant J of a rectangle, m^4, by Saint-Venant's series.

    Source: Timoshenko and Goodier 1970, section 109.
    """
    a, b = max(height, width), min(height, width)
    odd = range(1, 200, 2)
    series = sum(math.tanh(n * math.pi * a / (2.0 * b)) / n**5 for n in odd)
    return a * b**3 / 3.0 * (1.0 - 192.0 * b / (math.pi**5 * a) * series)
