"""Solids without a scene: the names of `softmark.solvers` against closed forms, and what they refuse."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import softmark
import softmark.solvers as sm

YOUNG, POISSON, DENSITY = 60e3, 0.3, 1000.0
GEL = sm.material("neo_hookean", young=YOUNG, poisson=POISSON, density=DENSITY)
BOX = sm.Box((0.02, 0.01, 0.01))


def solid(strain: Any = "finite", kind: str = "hex8") -> sm.Solid:
    return sm.Solid(BOX.mesh(kind, 0.005), GEL, strain)


def rollers(body: sm.Solid) -> list[sm.Clamp]:
    """The three faces at the origin, each held along its normal: what is stretched evenly stays even."""
    return [sm.clamp(body, body.nodes(lambda X, i=i: X[:, i] <= 1e-12), along="xyz"[i]) for i in range(3)]


def end(X: Any) -> Any:
    return X[:, 0] >= 0.02 - 1e-12


@pytest.mark.slow
@pytest.mark.long
def test_importing_the_solvers_costs_nothing_and_every_name_is_there() -> None:
    code = "import sys, softmark.solvers as s; print(sorted(sys.modules)); print([getattr(s, n) for n in s._PUBLIC])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = eval(done.stdout.splitlines()[0])
    assert not {"numpy", "scipy", "numba"} & set(loaded)
    assert [m for m in loaded if m.startswith("softmark")] == ["softmark", "softmark.solvers"]
    assert set(sm._PUBLIC) <= set(dir(sm))
    with pytest.raises(AttributeError, match="no attribute 'solve'"):
        sm.solve  # noqa: B018


@pytest.mark.parametrize("name", sm._PUBLIC)
def test_every_name_says_what_it_is(name: str) -> None:
    assert (getattr(sm, name).__doc__ or "").strip()


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8"])
def test_a_traction_stretches_a_bar_by_hookes_law(kind: str) -> None:
    # u = t x / E and -nu t y / E, which linear displacements hold exactly: rounding alone is left
    body = solid("small", kind)
    rest = sm.equilibrium(body, rollers(body), [sm.traction(body, (600.0, 0.0, 0.0), body.facets(end))])
    expected = 600.0 / YOUNG * body.points * [1.0, -POISSON, -POISSON]
    np.testing.assert_allclose(rest.displacement, expected, atol=1e-12)
    np.testing.assert_allclose(rest.at((0.01, 0.005, 0.005))[0], [1e-4, -1.5e-5, -1.5e-5], atol=1e-12)


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8"])
def test_a_pressure_all_around_shrinks_evenly(kind: str) -> None:
    # small: strain -p / 3K. Finite: P = mu (s - 1/s) + lam ln(s^3) / s at a stretch s, and -p s^2 is the force that
    # the deformed area carries, for every undeformed one (Bonet and Wood 2008, chapter 6)
    p, mu, lam = 20e3, YOUNG / 2.6, YOUNG * POISSON / (1.3 * 0.4)
    s = brentq(lambda s: mu * (s - 1 / s) + lam * math.log(s**3) / s + p * s**2, 0.5, 1.0, xtol=1e-14)
    for strain, stretch in (("small", 1.0 - p * (1 - 2 * POISSON) / YOUNG), ("finite", s)):
        body = solid(strain, kind)
        rest = sm.equilibrium(body, rollers(body), [sm.pressure(body, p, body.facets(lambda X: np.full(len(X), True)))])
        np.testing.assert_allclose(rest.displacement, (stretch - 1.0) * body.points, atol=1e-10)


def test_a_moved_clamp_moves_what_it_holds() -> None:
    body = solid()
    there = sm.clamp(body, body.nodes(end), by=(0.002, 0.0, 0.0), along="x")
    rest = sm.equilibrium(body, [*rollers(body), there], [])
    np.testing.assert_allclose(rest.displacement[body.nodes(end), 0], 0.002, rtol=1e-12)
    assert rest.found.stable


@pytest.mark.parametrize("strain", ["small", "corotational", "finite"])
def test_the_answer_is_that_of_the_scene(strain: str) -> None:
    """The same mesh, held and loaded by a scene: the same equilibrium, to the tolerance of both."""
    scene = softmark.loads(
        f"""
        material gel = neo_hookean(young = {YOUNG} Pa, poisson = {POISSON}, density = {DENSITY} kg/m^3)
        body     bar = solid(box(size = (20, 10, 10) mm), gel)
        support  wall = fixed(bar, where = x <= 0 mm)
        load     weight = gravity(981 m/s^2, direction = -z)
        model    m = fem(hex8, strain = {strain}, size = 5 mm)
        probe    tip = point(bar, at = (20, 5, 5) mm)
        """
    )
    report = scene.run()
    body = solid(strain)
    wall = sm.clamp(body, body.nodes(lambda X: X[:, 0] <= 0.0))
    rest = sm.equilibrium(body, [wall], [sm.gravity(body, (0.0, 0.0, -981.0))])
    expected = report.models["m"].probes["tip"].displacement[0]
    np.testing.assert_allclose(rest.at((0.02, 0.005, 0.005))[0], expected, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("integrator", ["trapezoidal", "central_differences"])
def test_what_nothing_holds_falls(integrator: str) -> None:
    # g t^2 / 2 is a parabola, which both integrators follow exactly
    body, g = solid(), np.array([0.0, 0.0, -9.81])
    motion = sm.march(body, [], [sm.gravity(body, (0.0, 0.0, -9.81))], 2e-3, 1e-4, integrator)
    assert motion.times[-1] == pytest.approx(2e-3)
    np.testing.assert_allclose(motion.at((0.01, 0.005, 0.005))[:, 0], 0.5 * motion.times[:, None] ** 2 * g, atol=1e-12)


def test_what_has_no_equilibrium_says_so_with_its_history() -> None:
    body = solid()
    wall = sm.clamp(body, body.nodes(lambda X: X[:, 0] <= 0.0))
    with pytest.raises(sm.NotConverged) as raised:
        sm.equilibrium(body, [wall], [sm.gravity(body, (0.0, 0.0, -1e9))], max_iterations=3)
    assert raised.value.history


CELL = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
ONE = np.array([[0, 1, 2, 3]])


def of(points: Any, cells: Any = ONE, kind: str = "tet4") -> sm.Solid:
    return sm.Solid(sm.Mesh(np.asarray(points, dtype=float), np.asarray(cells), kind), GEL)


def wall(body: sm.Solid, **how: Any) -> sm.Clamp:
    return sm.clamp(body, body.nodes(lambda X: X[:, 0] <= 0.0), **how)


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "name": (lambda: sm.material("rubber", young=1.0), "unknown material 'rubber'"),
    "constant": (lambda: sm.material("neo_hookean", young=1.0, nu=0.3), "check density, nu, poisson"),
    "range": (lambda: sm.material("neo_hookean", young=-1.0, poisson=0.3, density=1.0), "young = -1.0 is outside"),
    "neither": (lambda: sm.material("gent", mu=1.0, limit=9.0, density=1.0), "check bulk, poisson"),
    "both": (
        lambda: sm.material("gent", mu=1.0, limit=9.0, bulk=1.0, poisson=0.3, density=1.0),
        "check bulk, poisson",
    ),
    "made": (lambda: sm.material("yeoh", c1=1.0, young=3.0, poisson=0.3, density=1.0), "check young"),
    "word": (lambda: sm.material("yeoh", c1=1.0, bulk=1.0, density=1.0, volumetric="cubic"), "'cubic' is not one of"),
    "term": (lambda: sm.material("ogden", mu=(1.0, math.nan), alpha=(2.0, 4.0), bulk=9.0, density=1.0), "mu = nan"),
    "nan": (lambda: sm.material("neo_hookean", young=math.nan, poisson=0.3, density=1.0), "young = nan"),
    "inf": (lambda: sm.material("neo_hookean", young=math.inf, poisson=0.3, density=1.0), "young = inf"),
    "incompressible": (
        lambda: sm.Solid(BOX.mesh("hex8", 0.01), sm.material("neo_hookean", young=1.0, poisson=0.5, density=1.0)),
        "infinite bulk modulus",
    ),
    "strain": (
        lambda: sm.Solid(BOX.mesh("hex8", 0.01), GEL, "large"),  # type: ignore[arg-type]  # wrong on purpose
        "unknown strain 'large'",
    ),
    "selective": (lambda: sm.Solid(BOX.mesh("tet4", 0.01), GEL, integration="selective"), "only for hex8"),
    "inside out": (lambda: of(CELL, ONE[:, [1, 0, 2, 3]]), "1 of 1 cells are flat or inverted"),
    "flat": (lambda: of(CELL * [1, 1, 0]), "1 of 1 cells are flat"),
    "loose point": (lambda: of([*CELL, [2, 2, 2]]), "refer to each of the 5 points"),
    "no point": (lambda: of(CELL, ONE + 1), "refer to each of the 4 points"),
    "not finite": (lambda: of(CELL * math.nan), "finite numbers"),
    "width": (lambda: of(CELL, ONE, "hex8"), r"\(m, 8\)"),
    "nothing": (lambda: solid().nodes(lambda X: X[:, 0] > 1.0), "no node is selected; the mesh spans 0 to 0.02 m"),
    "no facet": (lambda: solid().facets(lambda X: X[:, 0] > 1.0), "no facet"),
    "one answer": (lambda: solid().nodes(lambda X: True), "True or False for each"),
    "outside": (lambda: solid().at((1.0, 0, 0), solid().points), "0.98 m outside"),
    "along": (lambda: wall(solid(), along="u"), "some of x, y and z"),
    "by": (lambda: wall(solid(), by=(math.inf, 0, 0)), "must be finite"),
    "numbers": (lambda: sm.clamp(solid(), np.array([10**6])), "node numbers must be"),
    "conflict": (
        lambda: sm.equilibrium(solid(), [wall(solid()), wall(solid(), by=(1e-3, 0, 0))], []),
        "different displacements",
    ),
    "free": (lambda: sm.equilibrium(solid(), [wall(solid(), along="x")], []), "leave 3 of 6 rigid body motions"),
    "unheld": (lambda: sm.equilibrium(solid(), [], []), "leave 6 of 6"),
    "all held": (
        lambda: sm.equilibrium(solid(), [sm.clamp(solid(), np.arange(len(solid().points)))], []),
        "nothing can deform",
    ),
    "acceleration": (lambda: sm.gravity(solid(), (0.0, 0.0, math.nan)), "three finite numbers"),
    "pressure": (lambda: sm.pressure(solid(), math.nan, solid().facets(end)), "a pressure must be finite"),
    "facets": (lambda: sm.pressure(solid(), 1.0, solid().nodes(end)), r"\(f, 4\)"),
    "integrator": (lambda: sm.march(solid(), [], [], 1.0, 0.1, "euler"), "unknown integrator 'euler'"),
    "step": (lambda: sm.march(solid(), [], [], 1.0, 0.0), "must be positive"),
    "amplitudes": (
        lambda: sm.march(solid(), [], [], 1.0, 0.1, amplitudes=[object()]),  # type: ignore[list-item]  # on purpose
        "1 amplitudes for 0 loads",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_meant_is_refused(what: str) -> None:
    act, message = REFUSED[what]
    with pytest.raises(ValueError, match=message):
        act()


def test_laws_with_constants_of_their_own_are_made_with_either_ratio_or_modulus() -> None:
    by_ratio = sm.material("ogden", mu=(10.0, 2.0), alpha=(2.0, 4.0), poisson=0.25, density=1.0)
    by_bulk = sm.material("ogden", mu=(10.0, 2.0), alpha=(2.0, 4.0), bulk=14.0 * 5.0 / 3.0, density=1.0)
    assert by_ratio.shear_modulus == pytest.approx(14.0, rel=1e-14)  # the sum of mu alpha / 2
    assert by_bulk.poisson == pytest.approx(0.25, rel=1e-14)
