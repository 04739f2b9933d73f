"""Flat sections: strips bend like a beam if they are free to curl across their width, otherwise like a plate.

A strip that is bent lengthwise curls crosswise with Poisson's ratio times its curvature (anticlastic
curvature), and then has the stiffness of a beam, E I. A clamp, or a sharp bend, prevents the curling; the strip
then has the stiffness of a plate, E I / (1 - nu^2).

Sources: Lamb (1891), "On the flexure of a flat elastic spring"; Searle (1908), "Experimental Elasticity"; Ashwell
(1950), "The anticlastic curvature of rectangular beams and plates".
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.solvers.mesh.shape import CircularSection

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.shape import Section

FLAT = 4.0  # ratio of width to thickness above which a section is a strip
CLAMPED, STRIP = (
    1.6,
    3.2,
)  # factors of plate(nu) width / length at each clamp: square and round sections, flat sections
WARPED = 2.25  # factor of the lost twist: half-way to the end, the loss is twice as large relative to the twist
SQUARE = 0.15  # ratio of the lost twist of a square to that of a strip: solids lose 0.024 widths at each clamp
GRIPPED = 0.6  # factor of plate(nu) width / length at each clamp for a rod under tension
THICK = 0.3  # factor of (width / length)^2
SEEN = 0.02  # of the stiffness: smallest change that causes a warning


def remaining_anticlastic_curvature(theta: float) -> float:
    """Return the remaining fraction of the anticlastic curvature: 1 in a beam and 0 in a plate.

    It is 2/theta (cosh theta - cos theta) / (sinh theta + sin theta), with theta = b (3 (1 - nu^2))^(1/4)
    sqrt(curvature / t), for a strip of width b and thickness t on the elastic foundation that its own curvature
    provides (Ashwell 1950).
    """
    if theta < 0.1:
        return 1.0 - theta**4 / 180.0
    if theta > 30.0:
        return 2.0 / theta
    return 2.0 / theta * (math.cosh(theta) - math.cos(theta)) / (math.sinh(theta) + math.sin(theta))


def strip_stiffening(section: Section, poisson: float, curvature: float) -> float:
    """Return how much stiffer a bent strip is than a beam, as a fraction: nu^2 (1 - F) / (1 - nu^2).

    F is the remaining anticlastic curvature at this curvature, 1/m.
    """
    thin, wide = sorted(section.extents)
    theta = wide * (3.0 * (1.0 - poisson**2)) ** 0.25 * math.sqrt(curvature / thin)
    return plate_curl_stiffening(poisson) * (1.0 - remaining_anticlastic_curvature(theta))


def ovalling_softening(section: Section, poisson: float, curvature: float) -> float:
    """Return how much softer a bent thin-walled tube is than a beam, as a fraction.

    It is 3/2 (1 - nu^2) (r^2 curvature / t)^2. The section flattens; r is the middle radius and t the wall
    thickness. The result is zero for a section without a hole, and conservative for a thick wall.

    Source: Brazier (1927), "On the flexure of thin cylindrical shells", the work of bending to second order in
    curvature.
    """
    if (hollow := section.hole_radius) is None:
        return 0.0
    outer = 0.5 * max(section.extents)
    r, t = 0.5 * (outer + hollow), outer - hollow
    return 1.5 * (1.0 - poisson**2) * (r * r * curvature / t) ** 2


def plate_curl_stiffening(poisson: float) -> float:
    """Return how much stiffer a plate is than a beam, as a fraction: 1 / (1 - nu^2) - 1."""
    return poisson**2 / (1.0 - poisson**2)


def curling_warning(declared: Declared, case: Case) -> Diagnostic | None:
    """Return a warning if a section is flat and prevented curling would change its stiffness noticeably, else None."""
    thin, wide = sorted(case.prism.section.extents)
    most = plate_curl_stiffening(case.largest_poisson)  # of a material that varies, which is refused elsewhere, too
    if wide < FLAT * thin or most < SEEN:
        return None
    return diagnostic(
        "W382",
        declared.at(),
        f"a section {wide / thin:.3g} times as wide as thick bends partly like a plate",
        f"the body may be {100 * most:.2g} % stiffer than this model",
        "near clamps and sharp bends the section cannot curl across its width: compare with `fem(...)`",
    )


def clamp_effect_on_bending(section: Section, length: float, poisson: float, spans: int, shear: bool) -> float:
    """Return a conservative relative error of beam theory in bending, because it ignores clamps and thickness.

    A clamp keeps its section from changing shape over CLAMPED / 4 of the width, where the body is as stiff as a
    plate; this effect is larger for flat sections. The other effects decrease with the square of width over length,
    for each of the `spans`. tests/benchmarks/beams.py compares both with solids.
    """
    thin, wide = sorted(section.extents)
    reach = CLAMPED + (STRIP - CLAMPED) * min(1.0, (wide / thin - 1.0) / (FLAT - 1.0))
    thick = (spans * wide / length) ** 2
    return reach * spans * plate_curl_stiffening(poisson) * wide / length + (THICK if shear else THICK + 1.0) * thick


def clamp_effect_on_torsion(section: Section, length: float, poisson: float, spans: int) -> float:
    """Return a conservative relative error of the twist of a rod, because beam theory ignores clamps and thickness.

    A clamp keeps its section from warping, which removes the twist of a length sqrt(E C / (G J)). For a thin strip,
    with C = b^3 t^3 / 144 and J = b t^3 / 3, that length is the width times sqrt((1 + nu) / 24). Squares warp
    little, circles do not warp. Solids of aspect ratio 10 to 1 and 4 to 1 show this loss, to 5 %.

    Source: Vlasov (1961), "Thin-walled elastic beams", chapter II.
    """
    thin, wide = sorted(section.extents)
    warping = 0.0 if isinstance(section, CircularSection) else max(SQUARE, 1.0 - (thin / wide) ** 2)
    lost = warping * wide * math.sqrt((1.0 + poisson) / 24.0)
    return spans * WARPED * lost / length + THICK * (spans * wide / length) ** 2


def clamp_effect_on_stretch(section: Section, length: float, poisson: float, spans: int) -> float:
    """Return a conservative relative error of the stretch of a rod in tension, because beam theory ignores clamps.

    A clamp keeps its section from contracting. For round rods of any length this reduces the end displacement by
    0.27 plate(nu) width / length, and the displacement at half length by twice that, as axisymmetric solids show.
    """
    return GRIPPED * spans * plate_curl_stiffening(poisson) * max(section.extents) / length


def bending_share(section: Section, length: float, bent: float, stretched: float) -> float:
    """Return the ratio of a rod's displacements by bending and by stretch, at most 1.

    `bent` and `stretched` are the strains of bending and of stretch. For equal strains, bending displaces the rod by
    length over width times as much as stretch does.
    """
    far = 4.0 * bent * length / max(section.extents)
    return min(1.0, far / stretched) if stretched > 0.0 else 1.0
