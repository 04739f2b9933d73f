"""Constants that vary in space, in laws within other laws: every combination is checked or refused in words."""

from __future__ import annotations

from itertools import product

import pytest

import softmark

CONSTANTS = {
    "young": "young = 50 kPa + x * 1 kPa / (1 mm), poisson = 0.3, density = 1000 kg/m^3",
    "poisson": "young = 50 kPa, poisson = 0.3 + 0.1 * x / (1 m), density = 1000 kg/m^3",
    "density": "young = 50 kPa, poisson = 0.3, density = 1000 kg/m^3 + x * 1 kg/m^3 / (1 mm)",
}
RELAXING = "viscoelastic({}, g = [0.5], tau = [1] s)"
PULLING = "active({}, tension = 1 kPa, own = +x)"
SHORTENING = "active_strain({}, shortening = 0.1, own = +x)"
POROUS = "biphasic({}, permeability = 1e-12 m^4/(N*s))"
WRAPPED = {
    "plain": "{}", "active": PULLING, "active_strain": SHORTENING, "viscoelastic": RELAXING, "biphasic": POROUS,
    "whole": RELAXING.replace("tau", "of = whole, tau"), "no_fibres": "active({}, tension = 1 kPa)",
    "viscous_active": RELAXING.format(PULLING), "active_viscous": PULLING.format(RELAXING),
    "biphasic_active": POROUS.format(PULLING), "active_biphasic": PULLING.format(POROUS),
    "biphasic_viscous": POROUS.format(RELAXING),
}  # fmt: skip
PLANE = "quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 10, 0) mm, (0, 10, 0) mm)"
BODIES = {
    "solid": "solid(box(size = (20, 10, 0.2) mm), {})",  # so flat that beams are doubted, by Poisson's ratio
    "plane_stress": f"plane_stress({PLANE}, {{}}, thickness = 1 mm)",
    "plane_strain": f"plane_strain({PLANE}, {{}}, thickness = 1 mm)",
    "axisymmetric": f"axisymmetric({PLANE}, {{}})",
}
FLAT = ("fem(tri6, strain = finite, size = 5 mm)", "fem(quad4, strain = finite, integration = selective, size = 5 mm)",
        "fem(quad8, formulation = mixed, strain = finite, size = 5 mm)")  # fmt: skip
SOLID = ("fem(tet10, strain = finite, size = 5 mm)",
         "fem(hex8, strain = small, formulation = mean_dilatation, size = 5 mm)",
         "beam6dof(segments = 4)", "homogeneous(state = uniaxial)",
         "mass_spring(size = 5 mm, stiffness = from_material())",
         "external_solver(program = febio, element = tet10, strain = finite, size = 5 mm)")  # fmt: skip


@pytest.mark.parametrize("wrapped", WRAPPED)
@pytest.mark.parametrize("body", BODIES)
def test_they_are_checked_or_refused(body: str, wrapped: str) -> None:
    """Muscle in plane stress, its law of a modulus that varies, once ended in a TypeError."""
    analyses = ("static()", "quasistatic(duration = 1 s, step = 0.1 s)")
    for constants, model, analysis in product(CONSTANTS.values(), SOLID if body == "solid" else FLAT, analyses):
        law = WRAPPED[wrapped].format(f"neo_hookean({constants})")
        text = (
            f"material m = {law}\nbody b = {BODIES[body].format('m')}\nsupport s = fixed(b, where = x <= 0 mm)\n"
            f"load l = gravity(9.81 m/s^2, direction = -y)\nanalysis a = {analysis}\nmodel q = {model}\n"
            "probe p = point(b, at = (10, 5, 0) mm)\nmetric u = displacement(p, along = -y)\n"
        )
        try:
            softmark.loads(text)
        except softmark.SceneError as error:
            found = {d.code for d in error.diagnostics}
            assert found
            assert found <= REASONS, found


# refusals of what scenes above say together; an error of spelling among them would hide all others
REASONS = {
    "E328", "E358", "E359", "E362", "E363", "E365", "E367", "E370", "E372", "E373", "E374", "E375",
    "E376", "E435", "E501",
    "E508", "E545",
}  # fmt: skip
