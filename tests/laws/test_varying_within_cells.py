"""Constants that vary within cells against adaptive quadrature by scipy: stiffness, mass and tension at random.

A body between plates that impose one strain has the force that the integral of E over its section says where E does not
vary along the pull and nothing contracts (layers side by side, Voigt 1889); its mass, and what gravity pulls, are the
integral of its density. Both hold on any mesh, for every displacement of the answer is linear in the coordinates. The
truth is found by scipy's adaptive quadrature, which is told where features are.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import polynomial
from scipy.integrate import quad
from scipy.linalg import eigh, eigh_tridiagonal

import softmark

ELEMENTS = ("tet4", "tet10", "hex8", "hex8, integration = selective", "hex20", "hex27", "tet10, formulation = mixed",
            "hex8, formulation = mean_dilatation")  # fmt: skip
WIDE = 10.0  # mm, of the body along y and z
LONG = 20.0  # mm along x
STRAIN = 0.01
CLOSE = 5e-3  # of an integral: an element's own points may miss 2e-3 of it in each cell, and parts 1e-4
CASES = 200
QUICK = 1


def profile(rng: np.random.Generator) -> tuple[str, Callable[[float, float], float], list[float]]:
    """A factor of y and z as a scene writes it, as a function of mm, and where along z it has features, mm."""
    kind = rng.integers(5)
    at, width = rng.uniform(1.0, 9.0), float(10 ** rng.uniform(-1.0, 0.5))
    high = float(10 ** rng.uniform(0.0, 2.3))
    if kind == 0:
        text = f"(1 + {high} * exp(-((z - {at} mm) / {width} mm)^2))"
        return (
            text,
            lambda y, z: 1.0 + high * math.exp(-(((z - at) / width) ** 2)),
            [at - 3 * width, at, at + 3 * width],
        )
    if kind == 1:
        period = float(rng.uniform(1.0, 12.0))
        text = f"(1 + 0.9 * cos(2 * pi * z / {period} mm * 1 rad))"
        return (
            text,
            lambda y, z: 1.0 + 0.9 * math.cos(2 * math.pi * z / period),
            list(np.arange(0.0, 10.0, 0.5 * period)),
        )
    if kind == 2:
        text = f"(1 + {high} * max(0, 1 - abs(z - {at} mm) / {width} mm))"
        return text, lambda y, z: 1.0 + high * max(0.0, 1 - abs(z - at) / width), [at - width, at, at + width]
    if kind == 3:
        text = f"(1 + y / 10 mm) * (1 + {high} / (1 + exp((z - {at} mm) / {0.1 * width} mm)))"
        step = lambda z: 1.0 / (1.0 + math.exp(min(700.0, (z - at) / (0.1 * width))))  # noqa: E731
        return text, lambda y, z: (1 + y / 10) * (1 + high * step(z)), [at - width, at, at + width]
    text = f"(1 + 0.3 * y / 10 mm * z / 10 mm + ((z - {at} mm) / 10 mm)^2)"
    return text, lambda y, z: 1 + 0.03 * y / 10 * z + ((z - at) / 10) ** 2, []


def integral(f: Callable[[float, float], float], marks: list[float]) -> float:
    """int f dy dz over the section, mm^2: along y f is linear, so that its middle will do."""
    inside = sorted({m for m in marks if 0.0 < m < WIDE})
    ends = [0.0, *inside, WIDE]
    along = (quad(lambda z: f(0.5 * WIDE, z), a, b, epsrel=1e-9, limit=200)[0] for a, b in pairwise(ends))
    return WIDE * math.fsum(along)


def between(f: Callable[[float], float], marks: list[float], low: float, high: float) -> float:
    """int f dz from low to high, mm."""
    ends = [low, *sorted({m for m in marks if low < m < high}), high]
    return math.fsum(quad(f, a, b, epsrel=1e-9, limit=200)[0] for a, b in pairwise(ends))


def scene(young: str, density: str, element: str, size: float, law: str) -> str:
    return f"""
material gel = {law}(young = {young}, poisson = 0, density = {density})
body bar = solid(box(size = ({LONG}, {WIDE}, {WIDE}) mm), gel)
support left = fixed(bar, where = x <= 0 mm, components = x)
support right = displaced(bar, where = x >= {LONG} mm, by = ({STRAIN * LONG}, 0, 0) mm, components = x)
support sides = fixed(bar, where = x < 100 mm, components = (y, z))
load weight = gravity(10 m/s^2, direction = +y)
model m = fem({element}, strain = small, size = {size} mm)
metric pull = force(right, along = +x)
metric carried = force(sides, along = -y)
"""


def cases() -> list[object]:
    """The first are quick; of the others a fifth is run each day."""
    return [pytest.param(i, marks=[] if i < QUICK else pytest.mark.slow) for i in range(CASES)]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", cases())
def test_forces_and_weights_are_integrals(seed: int) -> None:
    """F = strain int E dA and int rho g dV. At all nodes y and z are held: it stretches evenly."""
    rng = np.random.default_rng(35_000 + seed)
    element = ELEMENTS[seed % len(ELEMENTS)]
    (young, E, ends), (density, rho, marks) = profile(rng), profile(rng)
    size = float(rng.choice([3.5, 5.0, 10.0]))
    law = str(rng.choice(["linear_elastic", "neo_hookean"]))
    report = softmark.loads(scene(f"10 kPa * {young}", f"1000 kg/m^3 * {density}", element, size, law)).run(
        stated="formulation" in element
    )
    found = report.models["m"]
    assert found.status == "converged", found.message
    said = {w.code for w in report.warnings}
    assert "W402" not in said
    pull = STRAIN * 1e4 * integral(E, ends) * 1e-6
    weight = 10.0 * 1000.0 * integral(rho, marks) * LONG * 1e-9
    if "formulation" in element:
        must_be_right_or_stated(found, report, pull, (element, young, size))
    else:
        assert found.metrics["pull"].value == pytest.approx(pull, rel=CLOSE), (element, young, size)
    assert found.metrics["carried"].value == pytest.approx(weight, rel=CLOSE), (element, density, size)


def must_be_right_or_stated(found: Any, report: Any, pull: float, case: Any) -> None:
    """Pressures have one value in a cell, or are continuous, and cannot follow a bulk modulus that varies there.

    Where their force is more than CLOSE off, it is too small, a warning says so, and the stated error contains it.
    """
    value = found.metrics["pull"].value
    if value == pytest.approx(pull, rel=CLOSE):
        return
    assert value < pull, case
    assert pull - value <= found.stated["pull"].value, case
    if pull > 1.02 * value:
        assert "W401" in {w.code for w in report.warnings}, case


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("formulation", ["mixed", "mean_dilatation"])
def test_one_pressure_in_each_cell_has_the_harmonic_mean(formulation: str, seed: int) -> None:
    """F = strain A (2/3 E_a + 1/3 E_h) for nu = 0, with the two means over each layer of cells: K = E/3, mu = E/2."""
    rng = np.random.default_rng(35_900 + seed)
    young, E, ends = profile(rng)
    text = scene(f"10 kPa * {young}", "1000 kg/m^3", f"hex8, formulation = {formulation}", 10.0, "linear_elastic")
    report = softmark.loads(text).run(stated=True)
    t, w = np.polynomial.legendre.leggauss(8)
    arithmetic = harmonic = 0.0  # of E dA, mm^2, over four cells of 5 mm by 5 mm
    for y in (0.0, 5.0):
        for z in (0.0, 5.0):
            rows = [(y + 2.5 * (1.0 + a), 2.5 * b) for a, b in zip(t, w, strict=True)]
            arithmetic += math.fsum(b * between(lambda z, a=a: E(a, z), ends, z, z + 5.0) for a, b in rows)
            harmonic += 25.0**2 / math.fsum(
                b * between(lambda z, a=a: 1.0 / E(a, z), ends, z, z + 5.0) for a, b in rows
            )
    exact = STRAIN * 1e4 * (2.0 * arithmetic + harmonic) / 3.0 * 1e-6
    assert report.models["m"].metrics["pull"].value == pytest.approx(exact, rel=CLOSE), (formulation, young)
    must_be_right_or_stated(report.models["m"], report, STRAIN * 1e4 * arithmetic * 1e-6, young)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("element", ["hex8", "hex20", "tet10"])
def test_an_image_is_integrated_voxel_by_voxel(element: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Thin voxels with random numbers: linear between their centres, so that the integral is a trapezoidal sum."""
    rng = np.random.default_rng(3)
    numbers = np.exp(rng.normal(size=20))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "skin.nrrd").write_bytes(
        b"NRRD0004\ntype: double\ndimension: 3\nsizes: 2 2 20\nspace dimension: 3\n"
        b"space directions: (20,0,0) (0,10,0) (0,0,0.5)\nspace origin: (0,0,0.25)\nendian: little\nencoding: raw\n\n"
        + np.broadcast_to(numbers, (2, 2, 20)).astype("<f8").tobytes(order="F")
    )
    text = scene("f", "1000 kg/m^3", element, 5.0, "linear_elastic")
    report = softmark.loads('field f = field("skin.nrrd", unit = 10 kPa, length = 1 mm)\n' + text).run()
    centres = np.linspace(0.25, 9.75, 20)
    exact = np.trapezoid(numbers, centres) + 0.25 * (numbers[0] + numbers[-1])
    assert report.models["m"].metrics["pull"].value == pytest.approx(STRAIN * 1e4 * exact * 10.0 * 1e-6, rel=CLOSE)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", [pytest.param(i, marks=[] if i < 1 else pytest.mark.slow) for i in range(30)])
def test_images_of_random_numbers_are_integrated(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers are linear between centres of voxels and even beyond: the integral is their sum times a voxel's area."""
    rng = np.random.default_rng(36_000 + seed)
    element = ("hex8", "hex20", "hex27")[seed % 3]
    along_y, along_z = (int(n) for n in rng.integers(2, 25, size=2))
    numbers = np.exp(rng.normal(size=(along_y, along_z)))
    high, deep = WIDE / along_y, WIDE / along_z
    monkeypatch.chdir(tmp_path)
    (tmp_path / "skin.nrrd").write_bytes(
        f"NRRD0004\ntype: double\ndimension: 3\nsizes: 2 {along_y} {along_z}\nspace dimension: 3\n"
        f"space directions: (20,0,0) (0,{high!r},0) (0,0,{deep!r})\nspace origin: (0,{high / 2!r},{deep / 2!r})\n"
        "endian: little\nencoding: raw\n\n".encode()
        + np.broadcast_to(numbers, (2, along_y, along_z)).astype("<f8").tobytes(order="F")
    )
    text = scene("f", "1000 kg/m^3", element, float(rng.choice([3.5, 5.0])), "linear_elastic")
    report = softmark.loads('field f = field("skin.nrrd", unit = 10 kPa, length = 1 mm)\n' + text).run()
    exact = STRAIN * 1e4 * numbers.sum() * high * deep * 1e-6
    assert report.models["m"].metrics["pull"].value == pytest.approx(exact, rel=CLOSE), (element, numbers.shape)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", [pytest.param(i, marks=[] if i < 1 else pytest.mark.slow) for i in range(30)])
def test_muscle_pulls_with_the_integral_of_its_tension(seed: int) -> None:
    """F = int T dA: a bar that is held at both ends and along its sides does not move where T does not vary along x."""
    rng = np.random.default_rng(37_000 + seed)
    element = ("hex8", "hex20", "tet10", "tet4")[seed % 4]
    tension, T, ends = profile(rng)
    text = scene("10 kPa", "1000 kg/m^3", element, 5.0, "neo_hookean").replace("strain = small", "strain = finite")
    text = text.replace("load weight", "#").replace("metric carried", "#").replace(", gel)", ", muscle)")
    text = text.replace(f"({STRAIN * LONG}, 0, 0)", "(0, 0, 0)")
    text = f"material muscle = active(gel, tension = 1 kPa * {tension}, own = +x)\n" + text
    found = softmark.loads(text).run().models["m"]
    assert found.status == "converged", found.message
    exact = 1e3 * integral(T, ends) * 1e-6
    assert found.metrics["pull"].value == pytest.approx(exact, rel=CLOSE), (element, tension)


def across(rng: np.random.Generator, axis: str) -> tuple[str, Callable[[float], float], list[float]]:
    """A random factor of one coordinate."""
    text, f, marks = profile(rng)
    return text.replace("y / 10 mm", "0.5").replace("z", axis), lambda t: f(5.0, t), marks


@pytest.mark.parametrize("seed", [pytest.param(i, marks=[] if i < 2 else pytest.mark.slow) for i in range(40)])
def test_plane_cells_are_integrated_too(seed: int) -> None:
    """F = strain t int E dy and the weight t L int rho g dy, of a sheet whose nodes are held along y."""
    rng = np.random.default_rng(38_000 + seed)
    element = ("quad4", "quad8", "tri3", "tri6")[seed % 4]
    (young, E, ends), (density, rho, marks) = across(rng, "y"), across(rng, "y")
    text = scene(f"10 kPa * {young}", f"1000 kg/m^3 * {density}", element, 5.0, "linear_elastic")
    text = text.replace(f"solid(box(size = ({LONG}, {WIDE}, {WIDE}) mm), gel)",
                        "plane_strain(quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 10, 0) mm, (0, 10, 0) mm), gel,"
                        " thickness = 2 mm)")  # fmt: skip
    report = softmark.loads(text.replace("components = (y, z)", "components = y")).run()
    found = report.models["m"]
    assert found.status == "converged", found.message
    pull = STRAIN * 1e4 * between(E, ends, 0.0, WIDE) * 2.0 * 1e-6
    weight = 10.0 * 1000.0 * between(rho, marks, 0.0, WIDE) * LONG * 2.0 * 1e-9
    assert found.metrics["pull"].value == pytest.approx(pull, rel=CLOSE), (element, young)
    assert found.metrics["carried"].value == pytest.approx(weight, rel=CLOSE), (element, density)


@pytest.mark.parametrize("seed", [pytest.param(i, marks=[] if i < 1 else pytest.mark.slow) for i in range(30)])
def test_frequencies_have_the_integral_of_the_density(seed: int) -> None:
    """The lowest frequency of a bar that only stretches: (E u')' = -omega^2 rho u.

    Rayleigh's quotient puts it between the frequency of the continuous bar (4000 springs and lumped masses) and that
    of five quadratic line elements with exact integrals, whose motions every one of these meshes can follow. The mode
    may have a kink inside a cell, where much mass sits, so that the two differ by up to 1 %.
    """
    rng = np.random.default_rng(39_000 + seed)
    element = ("hex20", "tet10", "hex27")[seed % 3]
    density, rho, _ = across(rng, "x")
    text = scene("10 kPa", f"1000 kg/m^3 * {density}", element, 2.0, "linear_elastic").split("support right")[0]
    text = (
        text.replace(f"size = ({LONG}, {WIDE}, {WIDE})", f"size = ({WIDE}, 2, 2)")
        + f"""
support sides = fixed(bar, where = x < 100 mm, components = (y, z))
model m = fem({element}, strain = small, size = 2 mm)
metric tone = frequency(bar)
"""
    )
    found = softmark.loads(text).run().models["m"]
    many, inside = 4000, 8
    h = 1e-3 * WIDE / many
    fine = (np.arange(many * inside) + 0.5) * WIDE / (many * inside)
    each = 1000.0 * np.array([rho(float(x)) for x in fine]).reshape(many, inside).mean(axis=1) * h  # kg/m^2
    mass = 0.5 * (each + np.append(each[1:], 0.0))
    stiff = np.full(many, 2e4 / h)
    stiff[-1] /= 2.0
    low = eigh_tridiagonal(stiff / mass, -1e4 / h / np.sqrt(mass[:-1] * mass[1:]), select="i", select_range=(0, 0))[0]
    exact = math.sqrt(float(low[0])) / (2.0 * math.pi)
    upper = line_elements_frequency(rho)
    value = found.metrics["tone"].value
    assert value is not None
    assert exact * (1.0 - CLOSE) < value < upper * (1.0 + CLOSE), (element, density)
    if element != "tet10":  # whose motions are richer than those of the line elements
        assert value == pytest.approx(upper, rel=CLOSE), (element, density)


def line_elements_frequency(rho: Callable[[float], float]) -> float:
    """Lowest frequency of five quadratic line elements, Hz, with the density rho(x in mm) integrated by midpoints."""
    cells, many = 5, 4000
    s = (np.arange(many) + 0.5) / many
    h = 1e-3 * WIDE / cells
    N = np.array([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])
    slopes = np.array([4 * s - 3, 4 - 8 * s, 4 * s - 1]) / h
    K, M = np.zeros((2, 2 * cells + 1, 2 * cells + 1))
    for cell in range(cells):
        nodes = slice(2 * cell, 2 * cell + 3)
        density = 1000.0 * np.array([rho(1e3 * h * (cell + float(at))) for at in s])
        K[nodes, nodes] += 1e4 * slopes @ slopes.T * h / many
        M[nodes, nodes] += (N * density) @ N.T * h / many
    low = eigh(K[1:, 1:], M[1:, 1:], eigvals_only=True, subset_by_index=(0, 0))[0]
    return math.sqrt(float(low)) / (2.0 * math.pi)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_layers_behind_one_another_are_within_the_stated_error(seed: int) -> None:
    """F = u A / int dx / E: cells that hold whole layers have the arithmetic mean, and say by how much that may be off.

    For E = E0 (1 + b cos) over whole periods int dx / E is L / (E0 sqrt(1 - b^2)).
    """
    b = (0.5, 0.9, 0.97)[seed]
    young = f"10 kPa * (1 + {b} * cos(2 * pi * x / 2.5 mm * 1 rad))"
    text = scene(young, "1000 kg/m^3", "hex8", 5.0, "linear_elastic").replace("load weight", "# ")
    report = softmark.loads(text.replace("metric carried", "# ")).run(stated=True)
    found = report.models["m"]
    exact = STRAIN * 1e4 * math.sqrt(1.0 - b**2) * WIDE**2 * 1e-6
    value, stated = found.metrics["pull"].value, found.stated["pull"].value
    assert value is not None
    assert stated is not None
    assert exact == pytest.approx(value, abs=stated)
    assert abs(value - exact) > 0.1 * stated  # and it is no boundless one
    assert "W401" in {w.code for w in report.warnings}


def weights_off(monkeypatch: pytest.MonkeyPatch, change: Callable[[Any], Any]) -> None:
    """Break the rules of cells with points of their own: `change` makes other weights of theirs."""
    from softmark.interpreter.models.shared import varying_quadrature

    whole = varying_quadrature._rule

    def broken(*given: Any) -> Any:
        rule, off = whole(*given)
        return dataclasses.replace(rule, w=change(rule)), off

    monkeypatch.setattr(varying_quadrature, "_rule", broken)


def scaled(rule: Any) -> Any:
    """Weights of one cell that are 2 % too large."""
    w = rule.w.copy()
    w[np.flatnonzero(rule.special)[-1]] *= 1.02
    return w


def shifted(rule: Any) -> Any:
    """Weights of all cells that keep their volume, moved by 10 % from some points to the largest of each cell."""
    w = rule.w.copy()
    for row in np.flatnonzero(rule.special):
        most = w[row].argmax()
        moved = 0.1 * w[row, (most + 1) % len(w[row]) :].sum()
        w[row, (most + 1) % len(w[row]) :] *= 0.9
        w[row, most] += moved
    return w


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("change", [scaled, shifted])
@pytest.mark.parametrize("feature", ["exp(-((z - 3.1 mm) / 0.3 mm)^2)", "1 / (1 + exp((z - 3.1 mm) / 0.01 mm))"])
def test_wrong_weights_are_found(feature: str, change: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another quadrature finds integrals that are off by 2 %, of a narrow peak and of a step that is nearly a jump."""
    text = scene(f"10 kPa * (1 + 50 * {feature})", "1000 kg/m^3", "hex8", 5.0, "linear_elastic")
    good = softmark.loads(text).run().models["m"]
    assert good.status == "converged"
    weights_off(monkeypatch, change)
    bad = softmark.loads(text).run().models["m"]
    assert bad.status != "converged"
    assert "quadrature" in bad.message or "volume" in bad.message


def test_moments_are_kept_by_few_points() -> None:
    """Polynomials, and these times a narrow peak, summed by at most as many points as there are functions."""
    from softmark.solvers.mesh.positive_quadrature import reduce_rules

    rng = np.random.default_rng(1)
    x, w = rng.uniform(-1.0, 1.0, (3, 2000)), rng.uniform(0.5, 1.5, 2000)
    peak = 0.01 + np.exp(-(((x[2] - 0.3) / 0.05) ** 2))
    V = polynomial.polyvander3d(*x, [1, 1, 1])
    V = np.concatenate([V, V * peak[:, None]], axis=1)
    which, kept, missed = reduce_rules(np.zeros(2000, dtype=np.int64), V, w, 1)
    assert len(which) <= V.shape[1]
    assert np.all(kept > 0.0)
    assert missed.max() < 1e-9
    assert np.all(np.abs(V[which].T @ kept - V.T @ w) <= 1e-9 * np.abs(V).T @ w)


@pytest.mark.slow
def test_kinks_behind_the_last_gauss_point_are_integrated() -> None:
    """A function with a kink at any height of a cube: int max(0, z - a) and int z max(0, z - a), by scipy.

    Its bounds are exact and hide nothing, so that only the comparison of rules finds the kink. The tolerance is 1e-3 of
    the integral, ten times that of the estimate.
    """
    from softmark.solvers.elements import CELLS
    from softmark.solvers.mesh.adaptive_quadrature import adaptive_rule
    from softmark.solvers.mesh.mesh import Mesh

    corners = np.array(CELLS["hex8"].places(), dtype=np.float64)
    mesh = Mesh(corners, np.arange(8)[None], "hex8")
    for a in np.linspace(-1.0, 1.0, 42)[1:-1]:

        def above(z: Any, a: float = a) -> Any:
            return np.maximum(0.0, z - a)

        rule = adaptive_rule(
            mesh, lambda X, f=above: f(X[:, 2])[None],
            lambda low, high, f=above: (f(low[:, 2])[None], f(high[:, 2])[None]),
            1e-4, 4000, np.array([0.0, 0.0, 1.0]), np.array([1e-2]), 2,
        )  # fmt: skip
        size = 4.0 * quad(above, a, 1.0)[0] + 1e-2 * 8.0
        for p in (0, 1):
            exact = 4.0 * quad(lambda z, p=p, f=above: z**p * f(z), a, 1.0)[0]
            seen = float((rule.values[0] * rule.w * rule.xi[:, 2] ** p).sum())
            assert seen == pytest.approx(exact, abs=1e-3 * size), (a, p)
