"""Lines of convergence: what refines and what does not, the order that theory gives, and what is far from it.

Values are power laws with a known order, so that what should be found is known; scenes are compiled and not solved.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import softmark
from softmark.interpreter.language.parameter_overrides import read_overrides
from softmark.interpreter.planning.varied_quantities import default_quantities
from softmark.interpreter.study.analysis import refinement_convergence
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint
from softmark.interpreter.study.analysis.refinement_convergence import Refinement, refinement_of
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine
from softmark.interpreter.study.configurations.discretization_size import resolution_of
from softmark.interpreter.study.configurations.task_outcome import PointError
from softmark.references.convergence_orders import estimate_convergence, find_dissimilarity

SIZES = (0.04, 0.02, 0.01)


def member(h: float, u: float, of: dict[str, float], formal: dict[str, int], **changes: Any) -> ComparedPoint:
    own = {"of": of, "formal": formal, "problem": "one", "meshed": False, "counts": None} | changes
    return ComparedPoint.from_json({
        "key": f"{h:g}", "model": "m", "variation": {"h": f"{h:g}"}, "numbers": {"h": h}, "status": "converged",
        "size": {"dofs": 3}, "probes": {"tip": {"points": [[1.0, 0, 0]], "displacement": [[0.0, 0.0, u]]}},
        "resolution": own, "errors": {},
    })  # fmt: skip


def refined_as(point: ComparedPoint, **changes: Any) -> ComparedPoint:
    """The same, but for what decides how finely it is solved."""
    assert point.fineness is not None
    return replace(point, fineness=replace(point.fineness, **changes))


def orders_of(line: RefinementLine) -> dict[str, Any] | None:
    found = refinement_convergence.orders_of(line, [], [])
    return None if found is None else found.to_json()


def line(p: float, formal: int | None, target: str = "size", **changes: Any) -> RefinementLine:
    """u = 1 - h^p, three members."""
    known = {} if formal is None else {target: formal}
    made = [member(h, 1 - h**p, {target: 1 / h if target == "segments" else h}, known, **changes) for h in SIZES]
    return RefinementLine("s", "m", "refine", "h", (), tuple(made))


# ------------------------------------------------------------------ what is far from theory


def test_an_order_far_from_that_of_theory_is_not_asymptotic() -> None:
    """0.53 for linear elements; the index is three times what the order leaves: |u2 - u1| / (2^0.53 - 1)."""
    found = orders_of(line(0.53, 2))
    assert found is not None
    (limit,) = found["limits"]
    assert (found["asymptotic"], found["formal"], found["refines"]) == (False, 2, "size")
    assert found["doubt"] == "not asymptotic: observed order 0.53, theoretical order 2"
    assert limit["gci"] == pytest.approx(3 * 0.01**0.53)


@pytest.mark.parametrize(("p", "formal", "good"), [
    (1.0, 2, True), (0.9, 2, False), (2.5, 2, True), (2.6, 2, False),  # half of it, and a quarter more
    (1.5, 3, True), (1.4, 3, False), (0.53, None, True),
])  # fmt: skip
def test_the_band(p: float, formal: int | None, good: bool) -> None:
    family = [(h, 1 - h ** (p + (1e-6 if p < 2 else -1e-6))) for h in SIZES]
    assert estimate_convergence(family, formal).asymptotic is good


def test_an_order_above_that_of_theory_makes_no_index_smaller() -> None:
    """h^5 for an element of 2: three times what order 2 would leave."""
    found = estimate_convergence([(h, 1 - h**5) for h in SIZES], 2)
    assert found.gci == pytest.approx(3 * (0.02**5 - 0.01**5) / 3)


# ------------------------------------------------------------------ what refines


@pytest.mark.parametrize("target", ["size", "segments", "step"])
def test_what_decides_a_size_segments_or_a_step_refines(target: str) -> None:
    found = refinement_of(line(2.0, 2, target))
    assert isinstance(found, Refinement)
    assert (found.target, found.formal) == (target, 2)
    assert [h for h, _ in found.members] == pytest.approx(SIZES)


def test_what_changes_the_problem_does_not_refine() -> None:
    """A length that cell sizes follow: members differ in size, and in what is solved."""
    made = line(2.0, 2)
    other = [refined_as(p, problem=p.key) for p in made.members]
    own = RefinementLine("s", "m", "refine", "h", (), tuple(other))
    assert refinement_of(own) == "`h` changes the problem, not the discretisation"
    assert orders_of(own) is None


def test_a_tolerance_and_two_at_once_have_no_order() -> None:
    still = [member(h, 1 - h, {"size": 1.0}, {"size": 2}) for h in SIZES]
    assert refinement_of(RefinementLine("s", "m", None, "h", (), tuple(still))) == (
        "`h` decides neither size, segments nor step"
    )
    both = [member(h, 1 - h, {"size": h, "step": h}, {"size": 2, "step": 1}) for h in SIZES]
    assert refinement_of(RefinementLine("s", "m", None, "h", (), tuple(both))) == "`h` decides size and step at once"


def test_cells_count_by_the_size_that_they_have() -> None:
    """h = N^(-1/3): meshes of 8, 27 and 125 cells, asked for at 0.04, 0.02 and 0.01."""
    counted = zip(line(2.0, 2, meshed=True).members, (8, 27, 125), strict=True)
    made = [replace(p, elements=n) for p, n in counted]
    found = refinement_of(RefinementLine("s", "m", None, "h", (), tuple(made)))
    assert isinstance(found, Refinement)
    assert [h for h, _ in found.members] == pytest.approx([1 / 2, 1 / 3, 1 / 5])


def test_meshes_that_are_not_similar_put_an_order_in_doubt() -> None:
    made = [
        refined_as(p, counts=c) for p, c in zip(line(2.0, 2).members, ([2, 2, 6], [4, 4, 10], [4, 4, 15]), strict=True)
    ]
    found = orders_of(RefinementLine("s", "m", None, "h", (), tuple(made)))
    assert found is not None
    assert found["asymptotic"] is False
    assert "2 x 2 x 6 and 4 x 4 x 10 cells: cells shrink 1.67 times in one direction and 2 times in" in found["doubt"]
    assert find_dissimilarity([[2, 2, 6], [4, 4, 12], [8, 8, 24]]) is None


def forces(p: float) -> RefinementLine:
    """Members that share no probe: a force whose error is 3 h^p, against a measured one."""
    made = []
    for point in line(2.0, 2).members:
        error = PointError(3 * point.numbers["h"] ** p + (0.1 if p else point.numbers["h"] % 0.03), "N", "scale")
        made.append(replace(point, probes={}, errors={"push": error}))
    return RefinementLine("s", "m", "refine", "h", (), tuple(made))


def test_where_forces_are_measured_they_say_whether_a_line_settles() -> None:
    found = refinement_convergence.orders_of(forces(2.0), ["push"], forces(2.0).members)
    assert found is not None
    assert found.doubt_of("push") is None
    (limit,) = found.to_json()["limits"]
    assert (limit["metric"], limit["unit"], limit["order"]) == ("push", "N", pytest.approx(2.0))
    assert limit["value"] == pytest.approx(0.1)
    wild = refinement_convergence.orders_of(forces(0.0), ["push"], forces(0.0).members)
    assert wild is not None
    assert str(wild.doubt_of("push")).startswith("of `push` itself: ")
    assert "probe" not in str(wild.doubt)


@pytest.mark.parametrize(("place", "force"), [(2.0, 0.0), (0.53, 2.0)])
def test_a_force_has_no_doubts_of_a_place_and_a_place_none_of_a_force(place: float, force: float) -> None:
    """Where a probe is shared as well: of one of both alone the values settle, by orders of 2; 0.53 is far from it."""
    there, pushed = line(place, 2).members, forces(force).members
    made = tuple(
        replace(p, errors={"push": replace(f.metric("push"), by_itself=True), "tip": PointError(0.1, "1", "truth")})
        for p, f in zip(there, pushed, strict=True)
    )
    found = refinement_convergence.orders_of(RefinementLine("s", "m", "refine", "h", (), made), ["push", "tip"], made)
    assert found is not None
    assert [limit.of for limit in found.limits] == ["tip", "push"]
    assert (found.doubt_of("tip") is None) is (place == 2.0)
    assert (found.doubt_of("push") is None) is (force == 2.0)
    some = (*made[:2], replace(made[2], errors={}))
    lacking = refinement_convergence.orders_of(RefinementLine("s", "m", "refine", "h", (), some), ["push"], some)
    assert lacking is not None
    assert lacking.doubt_of("push") == "of `push` itself: only some of its configurations have it"


# ------------------------------------------------------------------ what a scene declares

SCENE = """
param h = 10 mm
param L = 60 mm
param dt = 10 ms
material gel = neo_hookean(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (L, 20 mm, 20 mm)), gel)
support wall = fixed(bar, where = x <= 0 mm)
load weight = gravity(1 m/s^2)
model t4 = fem(tet4, strain = small, size = h)
model t10 = fem(tet10, strain = finite, size = L / 6)
model capped = fem(hex8, strain = finite, size = h, max_iterations = 2)
model modes = modal(t4, modes = 5)
probe tip = point(bar, at = (L, 10 mm, 10 mm))
"""
STATIC = SCENE + "model rod = beam6dof(segments = 20)\n"
MOVING = SCENE + "analysis drop = dynamic(duration = 0.1 s, step = dt, integrator = {})\n"


def resolved(text: str, model: str, *overrides: str) -> dict[str, Any]:
    from softmark.interpreter.validation.scene_checks import apply_overrides

    scene, _ = apply_overrides(softmark.loads(text).scene, read_overrides(overrides, []))
    return resolution_of(scene, model)


def test_orders_of_theory_are_those_of_what_is_declared() -> None:
    """Polynomials of degree k: k + 1; two-node beams 2; backward Euler 1, the others 2; capped states none."""
    assert resolved(STATIC, "t4")["formal"] == {"size": 2}
    assert resolved(STATIC, "t10")["formal"] == {"size": 3}
    assert resolved(STATIC, "rod")["formal"] == {"segments": 2}
    assert resolved(STATIC, "modes")["formal"] == {}
    euler, newmark = MOVING.format("implicit_euler"), MOVING.format("newmark")
    assert resolved(euler, "t10")["formal"] == {"size": 3, "step": 1}
    assert resolved(newmark, "t10")["formal"] == {"size": 3, "step": 2}
    assert resolved(newmark, "capped")["formal"] == {}
    damped = newmark.replace("newmark", "newmark, damping_stiffness = 1 ms")
    assert [resolved(damped, m)["formal"]["step"] for m in ("t10", "t4")] == [1, 2]  # exact where K does not change


RUBBED = """material gel = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body    block = solid(box(size = (20, 20, 20) mm), gel)
body    ball  = rigid(sphere(radius = 5 mm, origin = (10, 10, 25) mm))
support floor = fixed(block, where = z <= 0 mm)
support hand  = displaced(ball, by = (0, 0, -1) mm)
contact touch = rigid_contact(ball, block, friction = 0.3)
model   cubes = fem(hex8, size = 5 mm, strain = finite)
metric  push  = force(touch, along = -z)
"""


def test_friction_changes_the_problem_and_is_walked() -> None:
    """Models of other frictions are not ranked together; what a scene gives of a contact is a quantity of `stress`."""
    rough, smooth = (resolved(RUBBED, "cubes", *o)["problem"] for o in ((), ("touch.friction=0.1",)))
    assert rough != smooth
    assert "touch.friction" in {q.name for q in default_quantities(softmark.loads(RUBBED).scene)}


def test_a_parameter_refines_what_uses_it_and_a_length_changes_the_problem() -> None:
    def problem(model: str, *overrides: str) -> str:
        return str(resolved(STATIC, model, *overrides)["problem"])

    assert resolved(STATIC, "t4", "h=5mm")["of"] == {"size": 0.005}
    assert resolved(STATIC, "rod", "rod.segments=40")["of"] == {"segments": 40.0}
    assert resolved(STATIC, "modes", "h=5mm")["of"] == {"size": 0.005}  # by what it is made from
    assert resolved(STATIC, "t4", "h=5mm")["counts"] == [4, 4, 12]
    assert problem("t4", "h=5mm") == problem("t4")
    assert problem("rod", "rod.segments=40") == problem("rod")
    assert resolved(STATIC, "t10", "L=120mm")["of"] == {"size": pytest.approx(0.02)}
    assert problem("t10", "L=120mm") != problem("t10")
    moving = MOVING.format("newmark")
    fine = resolved(moving, "t4", "dt=5ms")
    assert fine["of"] == {"size": 0.01, "step": 0.005}
    assert fine["problem"] == resolved(moving, "t4")["problem"]
