"""Bodies on springs and dashpots: closed forms, balance of forces by other formulas, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.verification import foundation_forces

HEAD = """softmark 1
scene "on a bed"
material stiff = neo_hookean(young = {young}, poisson = {nu}, density = 1000 kg/m^3)
body block = solid(box(size = (40, 30, 20) mm), stiff)
"""
PUSH = "load push = traction(block, where = z >= 20 mm, vector = (0, 0, -1) kPa)\n"
SEEN = """probe low = point(block, at = (20, 15, 0) mm)
metric sink = displacement(low, along = -z)
metric carry = force(bed, along = +z)
"""
WHOLE = "support bed = elastic_foundation(block, where = z <= 0 mm, stiffness = 10 kPa/mm)\n"
THEORY = "reference r = elastica(block)\n"
SMALL = "model m = fem(hex8, strain = small, size = 10 mm)\n"


def run(text: str, nu: float = 0.0, young: str = "100 MPa") -> dict[str, Any]:
    """The models of a scene, whose forces balance by other formulas: to 1e-8, or to what single precision rounds by.

    That is 2^-24 of a displacement and of its last correction: 2.9e-8 of the forces was left by one BLAS and 1.4e-9 by
    another, on the same machine.
    """
    rounding = 2.0 * float(np.finfo(np.float32).eps) if "precision = single" in text else 1e-8
    report = softmark.loads(HEAD.format(nu=nu, young=young) + text).run()
    assert {n: m.message for n, m in report.models.items() if m.status != "converged"} == {}
    for model in report.models.values():
        balance = model.solve["checks"]["reactions"]
        assert max(balance["force"], balance["moment"], balance["apart"]) <= rounding
        assert model.solve["checks"]["residual"] is not None
    return dict(report.models)


@pytest.mark.parametrize(
    "model",
    [
        "fem(hex8, strain = small, size = 10 mm)",
        "fem(hex8, strain = finite, size = 10 mm)",
        "fem(tet10, strain = finite, formulation = mixed, size = 20 mm)",
        "fem(tet4, strain = corotational, size = 10 mm)",
        "fem(hex8, strain = small, precision = single, size = 10 mm)",
    ],
)
def test_a_block_sinks_by_pressure_over_stiffness(model: str) -> None:
    """1 kPa on 10 kPa/mm: 0.1 mm, whatever the block; of the traction nothing else is held. To 1e-6 of rounding."""
    found = run(WHOLE + PUSH + SEEN + f"model m = {model}\n")["m"]
    assert found.metrics["sink"].value == pytest.approx(1e-4, rel=2e-5 if "single" in model else 1e-6)
    assert found.metrics["carry"].value == pytest.approx(1.2, rel=2e-5 if "single" in model else 1e-8)


def test_a_bed_under_a_part_of_a_face_has_the_area_that_is_selected() -> None:
    """Two beds side by side, one twice as stiff, under a block that cannot tilt: it sinks by F / sum k A.

    13.7 mm is no border of the 10 mm cells: what is cut is integrated. To 1e-4: the block gives way by 1e-5 of 0.06 mm.
    """
    beds = """support bed = elastic_foundation(block, where = z <= 0 mm and x <= 13.7 mm, stiffness = 20 kPa/mm)
support rest = elastic_foundation(block, where = z <= 0 mm and x >= 13.7 mm, stiffness = 10 kPa/mm)
support side = fixed(block, where = x <= 0 mm, components = (x, y))
support back = fixed(block, where = x >= 40 mm, components = (x, y))
"""
    model = run((beds + PUSH + SEEN + SMALL), young="1e5 MPa")["m"]
    sink = 1.2 / (30e-3 * 1e7 * (2 * 13.7e-3 + 26.3e-3))
    assert model.metrics["sink"].value == pytest.approx(sink, rel=1e-4)
    assert model.metrics["carry"].value == pytest.approx(2e7 * 30e-3 * 13.7e-3 * sink, rel=1e-4)
    assert model.reactions["bed"].held == pytest.approx(1.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("directions", "share"), [("normal", 0.5), ("all", 1.0)])
def test_a_pin_in_a_bed_all_around(directions: str, share: float) -> None:
    """Moved across by d, a pin is pushed back by k d (n . e)^2: half of the side's area counts where it may slide.

    1 % of force is the bar: a circle by facets of quadratic cells, 0.02 % of the area.
    """
    text = f"""softmark 1
scene "a pin"
material steel = linear_elastic(young = 1e5 MPa, poisson = 0.3, density = 8000 kg/m^3)
body pin = solid(cylinder(length = 20 mm, radius = 5 mm, axis = +x), steel)
support bed = elastic_foundation(pin, where = sqrt(y^2 + z^2) >= 5 mm, stiffness = 1 kPa/mm, directions = {directions})
support slide = fixed(pin, where = x <= 0 mm, components = x)
support still = fixed(pin, where = abs(y) <= 0 mm and abs(z) <= 0 mm, components = y)
load pull = gravity(9.81 m/s^2, direction = -z)
model m = fem(tet10, strain = small, size = 3 mm)
probe middle = point(pin, at = (10, 0, 0) mm)
metric sink = displacement(middle, along = -z)
"""
    report = softmark.loads(text).run()
    model = report.models["m"]
    weight, area = 8000 * math.pi * 25e-6 * 20e-3 * 9.81, 2 * math.pi * 5e-3 * 20e-3
    assert model.metrics["sink"].value == pytest.approx(weight / (1e6 * area * share), rel=2e-3)


def test_a_disc_of_revolution_on_a_bed() -> None:
    """1 kPa on 10 kPa/mm, in whole rings: 0.1 mm, and the bed carries pi r^2 p."""
    text = """softmark 1
scene "a disc"
material stiff = linear_elastic(young = 100 MPa, poisson = 0, density = 1000 kg/m^3)
shape half = quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 5, 0) mm, (0, 5, 0) mm)
body disc = axisymmetric(half, stiff)
support bed = elastic_foundation(disc, where = y <= 0 mm, stiffness = 10 kPa/mm)
load push = pressure(disc, where = y >= 5 mm, magnitude = 1 kPa)
model m = fem(quad9, strain = small, size = 2.5 mm)
probe low = point(disc, at = (10, 0, 0) mm)
metric sink = displacement(low, along = -y)
metric carry = force(bed, along = +y)
"""
    report = softmark.loads(text).run()
    model = report.models["m"]
    assert model.metrics["sink"].value == pytest.approx(1e-4, rel=1e-6)
    assert model.metrics["carry"].value == pytest.approx(math.pi * 4e-4 * 1e3, rel=1e-8)
    assert model.solve["checks"]["reactions"]["apart"] < 1e-9


@pytest.mark.slow
def test_a_block_let_go_on_springs_and_dashpots() -> None:
    """m u'' + c u' + k u = p per area has a closed form, met to 1e-3: (w h)^2 / 12 of 11 rad in steps of 1 ms."""
    bed = "support bed = elastic_foundation(block, where = z <= 0 mm, stiffness = 0.01 kPa/mm, damping = 40 Pa*s/m)\n"
    push = "load push = traction(block, where = z >= 20 mm, vector = (0, 0, -10) Pa)\n"
    motion = "analysis swing = dynamic(duration = 0.5 s, step = 1 ms, integrator = trapezoidal)\n"
    seen = "probe low = point(block, at = (20, 15, 0) mm)\nmetric sink = displacement(low, along = -z)\n"
    report = softmark.loads(
        HEAD.format(nu=0, young="100 MPa")
        + bed
        + push
        + motion
        + seen
        + "model m = fem(hex8, strain = small, size = 20 mm)\n"
    ).run()
    model = report.models["m"]
    m, c, k, p, t = 1000 * 20e-3, 40.0, 1e4, 10.0, 0.5
    w, z = math.sqrt(k / m), c / (2 * math.sqrt(k * m))
    wd = w * math.sqrt(1 - z * z)
    exact = p / k * (1 - math.exp(-z * w * t) * (math.cos(wd * t) + z * w / wd * math.sin(wd * t)))
    assert model.metrics["sink"].value == pytest.approx(exact, rel=1e-3)
    energies = {name: values[-1] for name, values in model.solve["energies"].items()}
    spent = energies["kinetic"] + energies["strain"] + energies["damping"]
    assert energies["load_work"] == pytest.approx(spent, rel=1e-9)
    assert model.solve["energy"]["gained"] is False


def test_a_block_on_springs_sounds() -> None:
    """A rigid block on k per area swings with sqrt(k A / m); upright here, its sides slide. To 1e-4 of its softness."""
    bed = "support bed = elastic_foundation(block, where = z <= 0 mm, stiffness = 0.01 kPa/mm, directions = normal)\n"
    sides = """support side = fixed(block, where = x <= 0 mm, components = x)
support back = fixed(block, where = y <= 0 mm, components = y)
metric tone = frequency(block, mode = 1)
"""
    found = softmark.loads(HEAD.format(nu=0, young="100 MPa") + bed + sides + SMALL).run().models["m"]
    assert found.metrics["tone"].value == pytest.approx(math.sqrt(1e4 / 20.0) / (2 * math.pi), rel=1e-3)


def test_the_watchdog_finds_a_bed_that_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tractions a thousandth larger are seen: forces of the answer do not balance with them."""
    right = foundation_forces.IndependentSurfaceSprings._spring_forces

    def wrong(*args: Any) -> Any:
        return 1.001 * right(*args)

    monkeypatch.setattr(foundation_forces.IndependentSurfaceSprings, "_spring_forces", wrong)
    report = softmark.loads(HEAD.format(nu=0, young="100 MPa") + WHOLE + PUSH + SEEN + SMALL).run()
    assert report.models["m"].status == "failed"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (WHOLE + PUSH + "model m = beam6dof(segments = 4)\n", "E501"),
        (WHOLE + PUSH + THEORY + SMALL, "E503"),
        (WHOLE.replace("z <= 0 mm", "z <= -1 mm") + PUSH + SMALL, "E302"),
        (WHOLE.replace("stiffness = 10 kPa/mm", "stiffness = 0 Pa/m") + PUSH + SMALL, "E301"),
        (WHOLE.replace("stiffness = 10 kPa/mm", "stiffness = 10 kPa") + PUSH + SMALL, "E204"),
    ],
)
def test_what_is_refused(text: str, code: str) -> None:
    """By the codes of their pages."""
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(HEAD.format(nu=0, young="100 MPa") + text)
    assert code in {d.code for d in refused.value.diagnostics}


def test_a_bed_along_normals_of_one_plane_lets_a_body_slide() -> None:
    """Said as of any support: free to slide along x and y, and to turn about z."""
    bed = WHOLE.replace("10 kPa/mm", "10 kPa/mm, directions = normal")
    with pytest.raises(softmark.SceneError, match="to slide along x, to slide along y and to turn about"):
        softmark.loads(HEAD.format(nu=0, young="100 MPa") + bed + PUSH + SEEN + SMALL).run()


# ------------------------------------------------------------------ in the plane

RING = """softmark 1
scene "a quarter of a ring on a bed"
material stiff = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
support foam = elastic_foundation(ring, where = x^2 + y^2 >= (20 mm)^2, stiffness = 1 kPa/mm)
load blow = pressure(ring, where = x^2 + y^2 <= (10 mm)^2, magnitude = 1 kPa)
probe out = point(ring, at = (20, 0, 0) mm)
metric grown = displacement(out, along = +x)
model coarse = fem(quad4, strain = small, size = 5 mm)
"""


@pytest.mark.parametrize(
    "body",
    [
        "plane_strain(quarter_ring(inner = 10 mm, outer = 20 mm), stiff, thickness = 3 mm)",
        "axisymmetric(quarter_ring(inner = 10 mm, outer = 20 mm), stiff)",
    ],
)
def test_a_bed_around_a_ring_knows_what_its_mesh_misses(body: str) -> None:
    """Chords of n equal arcs are short by 1 - sin(a) / a, a = pi / 4n; of rings by their mean radius as well."""
    text = RING + f"body ring = {body}\nsupport low = symmetric(ring, where = y <= 0 mm)\n"
    text += "support left = symmetric(ring, where = x <= 0 mm)\n" if "strain" in body else ""
    found = softmark.loads(text).run().models["coarse"]
    assert found.status == "converged"
    held = found.reactions["foam"].held
    cells = round(0.5 * math.pi * 0.02 / 0.005)
    a = math.pi / 4.0 / cells
    chord = math.sin(a) / a
    assert held == pytest.approx(chord if "strain" in body else chord * _mean_of_chords(cells), rel=1e-5)


def _mean_of_chords(cells: int) -> float:
    """Mean distance from the axis along chords of a quarter of a unit circle, relative to that along the arcs."""
    at = [0.5 * math.pi * i / cells for i in range(cells + 1)]
    x = [math.cos(t) for t in at]
    return sum(0.5 * (p + q) for p, q in zip(x[1:], x[:-1], strict=True)) / cells / (2.0 / math.pi)


def test_an_edge_that_a_condition_cuts_is_known() -> None:
    """Of a quarter ring below y = 3.7 mm: the wall, and both arcs up to there. Strips are cut where the border is."""
    from softmark.interpreter.language.coordinate_conditions import Condition, Term
    from softmark.interpreter.problem.surface_selection.region_outline import selected_edge_area
    from softmark.solvers.mesh.plane_regions import QuarterRing, Slice

    below = Condition.comparison("<=", Term.coordinate(1), Term.constant(0.0037), 1)
    ring = Slice(QuarterRing(0.01, 0.02), 0.003)
    length = 0.01 + 0.01 * math.asin(0.37) + 0.02 * math.asin(0.185)
    assert selected_edge_area(ring, below, 0.0) == pytest.approx(0.003 * length, rel=1e-7)
    around = 0.5 * (0.02**2 - 0.01**2) + 0.01 * 0.0037 + 0.02 * 0.0037
    assert selected_edge_area(ring, below, 0.003) == pytest.approx(2.0 * math.pi * around, rel=1e-7)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "model"),
    [
        (
            "viscoelastic(neo_hookean({E}, poisson = 0.3, {rho}), g = [0.3], tau = [1] s, of = whole)",
            "hex8, strain = finite",
        ),
        (
            "biphasic(linear_elastic({E}, poisson = 0.3, {rho}), permeability = 1e-12 m^4/(N*s))",
            "hex20, strain = small",
        ),
    ],
)
def test_a_body_with_a_history_rests_on_a_foundation(law: str, model: str) -> None:
    """The foundation carries the traction of 1 kPa on 40 mm by 30 mm, 1.2 N, in every kind of quasistatic analysis."""
    text = f"""softmark 1
    material foam = {law.format(E="young = 60 kPa", rho="density = 1000 kg/m^3")}
    analysis time = quasistatic(duration = 1 s, step = 0.5 s, times = [1] s)
    body block = solid(box(size = (40, 30, 20) mm), foam)
    support bed = elastic_foundation(block, where = z <= 0 mm, stiffness = 10 kPa/mm)
    load push = traction(block, where = z >= 20 mm, vector = (0, 0, -1) kPa)
    probe low = point(block, at = (20, 15, 0) mm)
    metric carried = force(bed, along = +z)
    model m = fem({model}, size = 10 mm)
    """
    found = softmark.loads(text).run().models["m"]
    assert found.status == "converged", found.message
    assert found.metrics["carried"].value == pytest.approx(1.2, rel=1e-6)  # the tolerance of a step is 1e-8
