"""Flat sections: strips that bend like a beam where they may curl across their width, and like a plate where not.

Bent lengthwise, a strip curls crosswise by Poisson's ratio times as much (anticlastic curvature), and is as stiff as a
beam, E I. A clamp keeps it from curling, and so does the bend itself where it is sharp: then it is as stiff as a plate,
E I / (1 - nu^2). Sources: Lamb (1891), "On the flexure of a flat elastic spring"; Searle (1908), "Experimental
Elasticity"; Ashwell (1950), "The anticlastic curvature of rectangular beams and plates".
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.shape import Section

FLAT = 4.0  # times as wide as thick: from here on a section is one of a strip
CLAMPED, STRIP = (
    1.6,
    3.2,
)  # times plate(nu) width / length at each clamp: of square and round sections, of flat ones
GRIPPED = 0.6  # the same of a rod that is pulled, at each clamp
THICK = 0.3  # times (width / length)^2
SEEN = 0.02  # of the stiffness: what is worth a warning


def curling(theta: float) -> float:
    """The share of anticlastic curvature that is left, 1 in a beam and 0 in a plate.

    2/theta (cosh theta - cos theta) / (sinh theta + sin theta), theta = b (3 (1 - nu^2))^(1/4) sqrt(curvature / t): a
    strip of width b and thickness t on the elastic foundation that its own curvature makes (Ashwell 1950).
    """
    if theta < 0.1:
        return 1.0 - theta**4 / 180.0
    if theta > 30.0:
        return 2.0 / theta
    return 2.0 / theta * (math.cosh(theta) - math.cos(theta)) / (math.sinh(theta) + math.sin(theta))


def stiffening(section: Section, poisson: float, curvature: float) -> float:
    """How much stiffer than a beam a bent strip is, relative: nu^2 (1 - F) / (1 - nu^2), curvature in 1/m."""
    thin, wide = sorted(section.extents)
    theta = wide * (3.0 * (1.0 - poisson**2)) ** 0.25 * math.sqrt(curvature / thin)
    return plate(poisson) * (1.0 - curling(theta))


def ovalling(section: Section, poisson: float, curvature: float) -> float:
    """How much softer than a beam a bent thin-walled tube is, relative: 3/2 (1 - nu^2) (r^2 curvature / t)^2.

    Its section flattens; r the middle radius and t the wall. Source: Brazier (1927), "On the flexure of thin
    cylindrical shells", the work of bending to second order in curvature. Zero of a section without a hole, and on the
    safe side of one with a thick wall.
    """
    if (hollow := section.hollow) is None:
        return 0.0
    outer = 0.5 * max(section.extents)
    r, t = 0.5 * (outer + hollow), outer - hollow
    return 1.5 * (1.0 - poisson**2) * (r * r * curvature / t) ** 2


def plate(poisson: float) -> float:
    """How much stiffer than a beam a plate is, relative: 1 / (1 - nu^2) - 1."""
    return poisson**2 / (1.0 - poisson**2)


def doubt(declared: Declared, case: Case) -> Diagnostic | None:
    """A warning where a section is flat, and curling matters."""
    thin, wide = sorted(case.prism.section.extents)
    most = plate(case.largest_poisson)  # of a material that varies, which is refused elsewhere, too
    if wide < FLAT * thin or most < SEEN:
        return None
    return diagnostic(
        "W382",
        declared.at(),
        f"a section {wide / thin:.3g} times as wide as thick bends between a beam and a plate",
        f"up to {100 * most:.2g} % stiffer than this model",
        "clamps and sharp bends keep it from curling across its width; compare with `fem(...)`",
    )


def missing(section: Section, length: float, poisson: float, spans: int, shear: bool) -> float:
    """What clamps and a thick section do that the theory of beams leaves out, relative, on the safe side.

    A clamp keeps its section from changing over CLAMPED / 4 of the width, where the body is as stiff as a plate; more
    where it is flat. The rest falls with the square of width over length, over as many parts as there are `spans`.
    tests/benchmarks/beams.py holds both against solids.
    """
    thin, wide = sorted(section.extents)
    reach = CLAMPED + (STRIP - CLAMPED) * min(1.0, (wide / thin - 1.0) / (FLAT - 1.0))
    thick = (spans * wide / length) ** 2
    return reach * spans * plate(poisson) * wide / length + (THICK if shear else THICK + 1.0) * thick


def gripped(section: Section, length: float, poisson: float, spans: int) -> float:
    """What clamps leave of the stretch of a rod that is pulled along its axis, relative, on the safe side.

    A clamp keeps its section from growing thinner: of round rods of any length it takes 0.27 plate(nu) width / length
    of what the end moves by, and twice that half way, as axisymmetric solids show.
    """
    return GRIPPED * spans * plate(poisson) * max(section.extents) / length


def bends(section: Section, length: float, bent: float, stretched: float) -> float:
    """How much of what a rod does may be bending, 0 to 1, by its strains: bent it moves length over width as far."""
    far = 4.0 * bent * length / max(section.extents)
    return min(1.0, far / stretched) if stretched > 0.0 else 1.0
