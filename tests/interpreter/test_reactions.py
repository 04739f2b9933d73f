"""What supports carry: against closed forms, loads, and formulas that share nothing with the solvers'."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.models.fem.fem_builder import PreparedSolid
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.shared.prepared_model import BuildContext, Solution
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.report.run import report_page, report_terminal
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_section import RodSection
from softmark.solvers.energies.rod_state import RodSpace, chain_elements, rod_at_rest
from softmark.solvers.statics.residual_forces import residual_without_rounding
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

BEAM = """softmark 1
scene "held"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
body beam = solid(box(size = (100, 20, 20) mm, origin = (0, -10, -10) mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
probe tip = point(beam, at = (100, 0, 0) mm)
"""
MODELS = """
model tet     = fem(tet4, strain = corotational, size = 10 mm)
model hex     = fem(hex8, strain = finite, integration = selective, size = 10 mm)
model ten     = fem(tet10, strain = small, size = 20 mm)
model mixed   = fem(tet10, strain = finite, formulation = mixed, size = 20 mm)
model cell    = fem(hex8, strain = corotational, rotation = element, size = 10 mm)
model springs = mass_spring(size = 10 mm, stiffness = from_material())
model rod     = beam6dof(segments = 10)
model stiff   = beam6dof(segments = 10, shear = no, axial = no)
model few     = modal(tet, modes = 8)
"""
WEIGHT = 1070 * 9.81 * 0.1 * 0.02**2  # N
EXACT = 1e-8  # of the largest load: the bar of every static answer


def reactions(report: Any, model: str) -> dict[str, Any]:
    found: dict[str, Any] = report.models[model].to_json()["reactions"]
    return found


@pytest.fixture(scope="module")
def held() -> softmark.Report:
    return softmark.loads(BEAM + MODELS).run()


@pytest.mark.slow
@pytest.mark.long
def test_every_kind_of_model_holds_its_weight_and_no_more(held: softmark.Report) -> None:
    """Of a box meshes have the whole volume. A rod that does not bend far has rho g A L^2 / 2 at its root (3.2)."""
    for name, model in held.models.items():
        wall, checks = reactions(held, name)["wall"], model.solve["checks"]
        if name == "few":
            assert wall["force"] is None
            assert "reduced model" in wall["reason"]
            continue
        assert wall["force"] == pytest.approx([0.0, 0.0, WEIGHT], abs=EXACT * WEIGHT), name
        assert checks["reactions"]["force"] <= EXACT, name
        assert checks["reactions"]["apart"] <= 1e-10, name  # by other formulas, of the same state: rounding
        if (
            name == "cell"
        ):  # its forces have a net moment: half a per mille of the weight times the length, and it says so
            assert 1e-5 < checks["reactions"]["moment"] < 1e-2
            assert "have a net moment" in checks["reactions"]["note"]
        else:
            assert checks["reactions"]["moment"] <= EXACT, name
    root = WEIGHT * 0.1 / 2
    # of small strain loads stay where they were, so that the closed form is exact; others bend inwards
    assert reactions(held, "ten")["wall"]["own_moment"] == pytest.approx([0, -root, 0], abs=1e-8 * root)
    assert 0.8 < -reactions(held, "rod")["wall"]["own_moment"][1] / root < 1.0


def test_moments_are_those_of_where_forces_act() -> None:
    """Of the deformed state: the moment of the weight about the root is that of its centre where that came to lie."""
    report = softmark.loads(BEAM + "model rod = beam6dof(segments = 40)\nprobe axis = line(beam, "
                            "from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 41)").run()  # fmt: skip
    x = report.models["rod"].probes["axis"].position[:, 0]
    lever = float(np.mean(0.5 * (x[1:] + x[:-1])))
    moment = reactions(report, "rod")["wall"]["moment"]
    assert moment == pytest.approx([0.0, -WEIGHT * lever, 0.0], abs=1e-9 * WEIGHT)


STRETCH = """softmark 1
scene "pulled"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (20, 10, 10) mm, origin = (5, 5, 5) mm), gel)
support left  = fixed(bar, where = x <= 5 mm, components = x)
support front = fixed(bar, where = y <= 5 mm, components = y)
support below = fixed(bar, where = z <= 5 mm, components = z)
support right = displaced(bar, where = x >= 25 mm, by = (10, 0, 0) mm, components = x)
model cubes = fem(hex8, strain = finite, size = 5 mm)
model tens  = fem(tet10, strain = finite, formulation = mixed, size = 10 mm)
probe end = point(bar, at = (25, 15, 15) mm)
"""


def test_a_pull_is_that_of_uniaxial_stress() -> None:
    """REFERENCES 3.5, log form, nu = 0.3, lambda = 1.5: P = 22696.811 Pa of the undeformed section, 1 cm^2."""
    report = softmark.loads(STRETCH).run()
    for name in ("cubes", "tens"):
        found = reactions(report, name)
        assert found["right"]["force"] == pytest.approx([2.2696811, 0, 0], rel=1e-7, abs=1e-8)
        assert found["left"]["force"] == pytest.approx([-2.2696811, 0, 0], rel=1e-7, abs=1e-8)
        assert found["right"]["own_moment"] == pytest.approx([0, 0, 0], abs=1e-9)
        side = 10e-3 * 0.880175  # as the law has it sideways
        assert found["right"]["at"] == pytest.approx([0.035, 0.005 + side / 2, 0.005 + side / 2], abs=1e-8)
        assert "shared" not in found["right"]  # they hold other directions of the same nodes


def test_supports_that_hold_the_same_share_it_openly() -> None:
    """The first in the scene has the edge, and the sum is that of the body."""
    both = BEAM.replace("support wall", "support floor = fixed(beam, where = x <= 40 mm and z <= -10 mm)\nsupport wall")
    report = softmark.loads(both + "model hex = fem(hex8, strain = small, size = 10 mm)").run()
    found = reactions(report, "hex")
    assert found["floor"]["shared"] == ["wall"]
    assert found["wall"]["shared"] == ["floor"]
    assert found["wall"]["shared_force"] == found["floor"]["shared_force"]
    assert math.hypot(*found["wall"]["shared_force"]) > 0.01 * WEIGHT
    total = np.sum([found[n]["force"] for n in ("wall", "floor")], axis=0)
    assert total == pytest.approx([0, 0, WEIGHT], abs=EXACT * WEIGHT)


def test_a_following_pressure_is_balanced_where_it_came_to_act() -> None:
    report = softmark.loads(BEAM.replace(
        "probe", "load push = pressure(beam, where = x >= 100 mm, magnitude = 1 kPa)\n"
        "load prod = point_force(beam, at = (60, 5, 5) mm, vector = (1, 20, 3) mN)\nprobe", 1
    ) + "model ten = fem(tet10, strain = finite, size = 20 mm)").run()  # fmt: skip
    checks = report.models["ten"].solve["checks"]["reactions"]
    assert max(checks["force"], checks["moment"]) <= EXACT
    assert checks["apart"] <= 1e-10


def test_a_state_whose_supports_do_not_balance_is_no_answer(tampered: Any) -> None:
    """A thousandth more of what one support carries, which no residual of free nodes would notice."""

    def wrong(solution: Solution) -> Solution:
        assert solution.carried is not None
        carried = solution.carried()
        off = replace(carried, left=carried.left * 1.001)
        return replace(solution, carried=lambda: off)

    tampered(wrong)
    report = softmark.loads(BEAM + "model rod = beam6dof(segments = 10)").run()
    assert report.models["rod"].status == "failed"
    assert "supports and loads do not balance: the net force is 1.0e-03 of the largest load" in str(
        report.models["rod"].message
    )


def test_reactions_that_other_formulas_do_not_find_are_no_answer(tampered: Any) -> None:
    """A load that one support is given and another loses: the sum is right, and each is wrong."""

    def wrong(solution: Solution) -> Solution:
        assert solution.carried is not None
        carried = solution.carried()
        left = carried.left.copy()
        ends = [np.flatnonzero(carried.X[:, 0] <= 0.0051), np.flatnonzero(carried.X[:, 0] >= 0.0249)]
        for nodes, more in zip(ends, (1.0, -1.0), strict=True):
            left[nodes, 0] += more * 1e-3 / len(nodes)
        return replace(solution, carried=lambda: replace(carried, left=left))

    tampered(wrong)
    report = softmark.loads(STRETCH.replace("model tens", "# model tens")).run()
    assert report.models["cubes"].status == "failed"
    assert "from that of independent formulas" in str(report.models["cubes"].message)


def test_reports_have_a_table_of_supports_and_a_line(held: softmark.Report) -> None:
    page = report_page.render(held)
    assert '<h2 id="supports-heading">Supports</h2>' in page
    assert "(0, 0, 419.87) mN" in page
    assert "mN\N{MIDDLE DOT}m" in page
    assert "reaction force of wall: 420 mN in 8 models" in report_terminal.table(held, terminal=False)


def test_a_motion_says_that_it_has_no_reactions() -> None:
    swing = "analysis swing = dynamic(duration = 20 ms, step = 10 ms)\n"
    swing += "model tet = fem(tet4, strain = small, size = 20 mm)\n"
    report = softmark.loads(BEAM + swing).run()
    wall = reactions(report, "tet")["wall"]
    assert wall["force"] is None
    assert "static analysis" in wall["reason"]
    assert 'id="supports-heading"' not in report_page.render(report)


@pytest.mark.parametrize("first", [0, 1])
def test_a_section_that_two_supports_hold_is_found_again_in_either_order(first: int) -> None:
    """F L at the root is that of the support that holds the tilt; `post` holds the twist and what is across."""
    two = [
        "support post = fixed(beam, where = x <= 0 mm, components = (y, z))",
        "support half = symmetric(beam, where = x <= 0 mm)",
    ]
    report = softmark.loads(f"""
material m = linear_elastic(young = 60 MPa, poisson = 0.3, density = 1000 kg/m^3)
body beam = solid(box(size = (200, 20, 20) mm, origin = (0, -10, -10) mm), m)
{two[first]}
{two[1 - first]}
load push = point_force(beam, at = (200, 0, 0) mm, vector = (0, 0, -0.4) N)
model rod = beam6dof(segments = 20)
metric root = moment(half, along = +y)
metric up = force(post, along = +z)
""").run()
    rod = report.models["rod"]
    assert rod.status == "converged", rod.message
    assert rod.metrics["up"].value == pytest.approx(0.4, rel=1e-9)
    assert abs(rod.metrics["root"].value) == pytest.approx(0.08, rel=1e-3)  # the tip comes back by 1e-5 of its length


def test_a_moment_is_about_the_middle_of_what_is_held_in_every_model() -> None:
    """Of a block that is held from 0 to 25 mm the middle is at 12.5 mm, and of a beam whose nodes lie unevenly.

    Stiff, so that nothing moves: to 1e-6 of the length. Faces alone: `x <= 0 mm` holds no cell.
    """
    text = (
        BEAM.replace("60 kPa", "60 GPa").replace("x <= 0 mm", "x <= 25 mm")
        + """
model hexes = fem(hex8, strain = corotational, size = 10 mm)
model tets  = fem(tet10, strain = small, size = 10 mm)
model rod   = beam6dof(segments = 7)
metric root = moment(wall, along = -y)
"""
    )
    report = softmark.loads(text).run()
    found = {name: reactions(report, name)["wall"]["at"] for name in report.models}
    for name, at in found.items():
        assert at == pytest.approx([0.0125, 0.0, 0.0], abs=1e-7), name
    moments = [model.metrics["root"].value for model in report.models.values()]
    assert moments == pytest.approx([WEIGHT * (0.05 - 0.0125)] * 3, rel=1e-5)


UNEQUAL = """softmark 1
scene "unequal"
material steel = linear_elastic(young = 200 GPa, poisson = 0.3, density = 7850 kg/m^3)
body frame = network(points = [(0, 0, 0), (0, 0, 2), (3, 0, 2), (3, 2, 2), (3, 2, 0)] m,
    members = [(1, 2), (2, 3), (3, 4), (4, 5)], material = steel, radius = [200, 2, 100, 3] mm)
support foot = fixed(frame, where = x <= 0 m and z <= 0 m)
support hand = fixed(frame, where = x >= 3 m and z <= 0 m)
load pull = point_force(frame, at = (3, 0, 2) m, vector = (0.1, 0.2, -0.3) N)
model m = frame6dof(segments = 8)
probe p = point(frame, at = (3, 0, 2) m)
metric d = displacement(p, along = +x)
"""


@pytest.mark.slow
def test_members_of_very_unequal_stiffness_balance_as_well() -> None:
    """E A of one is 1e4 times that of the next: rounding of positions alone left 3e-5 of the load before.

    The reactions are those of the step that cannot be written down any more; other formulas, which know no more than
    where points are, find them within what rounding of these leaves, which is said.
    """
    model = softmark.loads(UNEQUAL).run().models["m"]
    balance = model.solve["checks"]["reactions"]
    assert max(balance["force"], balance["moment"]) <= 1e-12
    assert balance["apart"] <= balance["allowed"]
    total = np.sum([model.reactions[name].reaction.force for name in ("foot", "hand")], axis=0)
    np.testing.assert_allclose(total, [-0.1, -0.2, 0.3], rtol=0.0, atol=1e-12)


def test_forces_are_only_set_right_where_rounding_alone_is_left() -> None:
    """Of a state that is no equilibrium, what is left over stays: a hundredth of the load here."""
    rest = rod_at_rest(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    elastic = RodElastic(rest, chain_elements(3), RodSection(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0).stiffness)
    force = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e-3]])
    fixed = np.arange(6)
    assembly = Assembly(18, fixed, [elastic], [RodForces(rest, force)])
    problem = Statics(assembly, RodSpace(3), rest, fixed, np.zeros(6))
    x = equilibrium(replace(problem, bold=False)).x
    off = RodSpace(3).move(x, np.eye(18)[14] * 1e-5)
    np.testing.assert_array_equal(residual_without_rounding(problem, off), assembly.gradient(off, 1.0))
    lost = RodSpace(3).move(x, np.eye(18)[14] * 1e-12)
    assert abs(assembly.gradient(lost, 1.0)[14]) > 1e-12
    balanced = residual_without_rounding(problem, lost)
    assert np.abs(balanced[6:]).max() < 1e-18
    assert balanced[2] == pytest.approx(-1e-3, rel=1e-12)


def test_what_is_left_over_adds_up_to_no_more_than_the_tolerance() -> None:
    """A state within it whose forces add up to more is taken a step farther by the factor that is there.

    At Poisson's ratio 0.4999 1.5e-8 of the load was left of the tolerance of 1e-8; here a sum that counts ten times.
    """
    loaded = softmark.loads("""
        material gel    = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1070 kg/m^3)
        body     bar    = solid(box(size = (100, 20, 20) mm), gel)
        support  wall   = fixed(bar, where = x <= 0 mm)
        load     weight = gravity(9.81 m/s^2)
        analysis sag    = static(tolerance = 1e-6)
        model    hexes  = fem(hex8, strain = corotational, integration = selective, size = 10 mm)
        probe    tip    = point(bar, at = (100, 10, 10) mm)
    """).scene
    model = loaded.declared["hexes"]
    prepared = build(model, case_for(loaded, model), BuildContext(scene=loaded))
    assert isinstance(prepared, PreparedSolid)
    problem = prepared.problem
    own = problem.resultant
    assert own is not None
    plain, even = (equilibrium(replace(problem, resultant=r)) for r in (own, lambda f: 10.0 * own(f)))
    assert 1e-7 < plain.residual < 1e-6
    assert even.residual < 1e-2 * plain.residual
    assert even.iterations == plain.iterations
    np.testing.assert_allclose(even.x, plain.x, rtol=0, atol=1e-5 * np.abs(plain.x).max())
