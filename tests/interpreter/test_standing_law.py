"""No model of a random scene is wrong by more than it states: partial supports, partial loads, courses, files.

The truth is that of tests/laws/truth.py, on grids that conform to the selections, and each test grants what that truth
itself may be off. The whole law, over hundreds of scenes, is `python tests/laws/standing.py`.
"""

from __future__ import annotations

from importlib import import_module

import pytest

QUICK = 12  # at rest on a mesh of its own: the cheapest of those that come to an answer


def rows(seed: int) -> list[dict[str, object]]:
    """What came of every model of a random scene."""
    cases, standing = import_module("cases"), import_module("standing")
    return list(standing.judged(standing.for_files(cases.random_case(seed))))


def silent(found: list[dict[str, object]]) -> list[str]:
    """Who is wrong by more than he states, without a doubt."""
    return [f"{r['model']}: {r['error']:.3g} off, states {r['value']:.3g}" for r in found if r["word"] == "silent"]


@pytest.mark.long
@pytest.mark.slow
def test_no_model_is_wrong_by_more_than_it_states() -> None:
    found = rows(QUICK)
    assert {r["word"] for r in found} == {"stated"}
    assert silent(found) == []


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("seed", [s for s in range(1, 16) if s != QUICK])
def test_nor_in_many_more_scenes(seed: int) -> None:
    """A third of them each at rest, at rest on a mesh from a file, and in motion."""
    assert silent(rows(seed)) == []


@pytest.mark.slow
@pytest.mark.long
def test_truth_is_that_of_a_bar_in_tension() -> None:
    """sigma x / E: with a Poisson's ratio of 0 a clamp holds nothing that would move sideways."""
    cases, truth = import_module("cases"), import_module("truth")
    size, inf = (40.0, 10.0, 8.0), float("inf")
    pulled = cases.Load(cases.Region(low=(40.0, -inf, -inf)), (2.0, 0.0, 0.0))
    case = cases.Case(0, size, 0.0, cases.Region(high=(0.0, inf, inf)), pulled, 5.0)
    found = truth.at_rest(case, 5.0)
    exact = 2.0 / 60e3 * 1e-3 * 38.0  # at the probe's last point, 0.95 of the length, nu = 0
    assert found.u[-1] == pytest.approx([exact, 0.0, 0.0], rel=1e-9, abs=1e-15)


def test_truth_in_motion_is_that_of_an_oscillator() -> None:
    """A mode under a step: p / w^2 (1 - cos w t), and under a sine beside its frequency Duhamel's integral."""
    import numpy as np

    cases, truth = import_module("cases"), import_module("truth")
    inf = float("inf")
    region = cases.Region(high=(0.0, inf, inf))
    w, t = 7.0, np.linspace(0.0, 2.0, 41)

    def answer(course: object) -> np.ndarray:
        case = cases.Case(0, (1.0, 1.0, 1.0), 0.0, region, cases.Load(region, None), 1.0, course, 0.05)
        fine = truth._grid(case, t, 2 * np.pi / w)
        return truth._answer(case, np.array([w * w]), np.array([3.0]), fine)[0, np.searchsorted(fine, t - 1e-12)]

    assert answer(cases.Course("pulse", (0.0, 5.0))) == pytest.approx(3 / w**2 * (1 - np.cos(w * t)), abs=1e-12)
    v = 2 * np.pi * 2.0
    forced = 3 / (w**2 - v**2) * (np.sin(v * t) - v / w * np.sin(w * t))
    assert answer(cases.Course("sine", (2.0,))) == pytest.approx(forced, abs=2e-4)  # 100 pieces a swing


@pytest.mark.slow
def test_truth_is_that_of_scikit_fem() -> None:
    """On the same grid of hexahedra with 27 nodes, assembled by scikit-fem element by element: to rounding."""
    skfem = pytest.importorskip("skfem")
    import numpy as np
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    cases, truth = import_module("cases"), import_module("truth")
    size, inf = (30.0, 12.0, 10.0), float("inf")
    loaded = cases.Region(low=(24.0, -inf, 10.0), high=(29.0, inf, inf))
    case = cases.Case(0, size, 0.3, cases.Region(high=(0.0, inf, 7.0)), cases.Load(loaded, (1.0, 2.0, -3.0)), 5.0)
    body = truth.Body.of(case, 5.0, mass=False)

    planes = [1e-3 * truth.lines(s, case.support.cuts(i) + loaded.cuts(i), 5.0 * max(0.45, s / 30.0))
              for i, s in enumerate(size)]  # fmt: skip
    mesh = skfem.MeshHex.init_tensor(*planes)
    element = skfem.ElementVector(skfem.ElementHex2())
    basis = skfem.Basis(mesh, element, intorder=4)
    K = linear_elasticity(*lame_parameters(case.young, case.poisson)).assemble(basis)
    middles = 1e3 * mesh.p[:, mesh.facets].mean(axis=1)
    chosen = np.intersect1d(mesh.boundary_facets(), np.flatnonzero(truth.inside(loaded, middles, size)))
    push = skfem.LinearForm(lambda v, w: v[0] + 2.0 * v[1] - 3.0 * v[2])
    f = push.assemble(skfem.FacetBasis(mesh, element, facets=chosen, intorder=4))
    held = truth.inside(case.support, 1e3 * basis.doflocs, size)
    u = skfem.solve(*skfem.condense(K, f, D=np.flatnonzero(held)))
    P = np.linspace(*(1e-3 * np.array(p) for p in case.probe), 5).T
    assert body.seen(body.at_rest()) == pytest.approx((basis.probes(P) @ u).reshape(3, -1).T, rel=1e-8)
