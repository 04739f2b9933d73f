"""Chains are factorised within their band, and everything else as before; a rod's steps take few calls."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_section import circular
from softmark.solvers.energies.rod_state import RodChain, chain_elements, rod_at_rest
from softmark.solvers.linear import factorisations
from softmark.solvers.sparse import banded_cholesky
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

LENGTH, RADIUS = 0.178, 0.019  # m, the silicone beam of 2008


def cantilever(segments: int, held: tuple[int, ...] = (0,), sag: float = 1070 * 9.81) -> Statics:
    """A cylinder of silicone under its weight, `sag` N/m^3, clamped at the nodes `held`."""
    rest = rod_at_rest(np.linspace(0.0, LENGTH, segments + 1)[:, None] * np.array([1.0, 0.0, 0.0]))
    section = circular(RADIUS, 60e3, 0.49)
    fixed = np.concatenate([np.arange(6) + 6 * node for node in held])
    elements, nodes = chain_elements(segments + 1), segments + 1
    weight = RodForces.uniform(rest, elements, sag * section.area * np.array([0.0, 0.0, -1.0]))
    assembly = Assembly(6 * nodes, fixed, [RodElastic(rest, elements, section.stiffness)], [weight])
    clamped = np.zeros((nodes, 3), dtype=bool)
    clamped[list(held)] = True
    weights = np.tile([1.0, 1.0, 1.0, *[1.0 / LENGTH] * 3], nodes)
    target, space = np.zeros(len(fixed)), RodChain(rest, clamped)
    return Statics(assembly, space, rest, fixed, target, bold=False, extent=LENGTH, weights=weights)


def tangent(held: tuple[int, ...] = (0,)) -> sparse.csr_matrix:
    """Of the cantilever at rest."""
    problem = cantilever(12, held)
    return problem.assembly.tangent(problem.rest, 0.0)


@pytest.mark.parametrize("held", [(0,), (5,), (0, 12), (3, 4, 9)])
def test_a_band_solves_as_superlu_does(held: tuple[int, ...]) -> None:
    """Wherever a rod is held; to the digits that its condition number of 1e4 to 1e5 leaves."""
    K = tangent(held)
    b = np.random.default_rng(1).standard_normal(K.shape[0])
    found, other = factorisations.factor(K), factorisations.factor(K, method="superlu")
    assert (found.name, found.negative_pivots, found.tolerance) == ("banded Cholesky (LAPACK)", 0, 0.0)
    assert other.name == factorisations.NAME
    x = found.solve(b)
    np.testing.assert_allclose(x, other.solve(b), rtol=1e-9, atol=1e-11 * np.abs(x).max())
    np.testing.assert_allclose(K @ x, b, atol=1e-10)


def test_negative_eigenvalues_are_counted_as_before() -> None:
    """A band has no factor where pivots are negative: SuperLU says how many, to whom that is not enough."""
    K = tangent()
    values = np.linalg.eigvalsh(K.toarray())
    between = float(np.sqrt(values[2] * values[3]))
    shifted = K.copy()
    shifted.setdiag(K.diagonal() - between)
    found = factorisations.factor(shifted)
    assert isinstance(found, factorisations.DeferredFactor)
    assert (found.name, found.negative_pivots) == (factorisations.NAME, 3)
    b = np.ones(K.shape[0])
    np.testing.assert_allclose(shifted @ found.solve(b), b, rtol=1e-7)


def test_what_vanishes_to_rounding_is_not_negative() -> None:
    """A direction without stiffness has no sign: 1e-15 below zero is left to SuperLU, which says that none is."""
    stiff = np.full(20, 2.0)
    stiff[7] = -1e-15
    K = sparse.csr_matrix(sparse.diags([np.zeros(19), stiff, np.zeros(19)], [-1, 0, 1]))
    found = factorisations.factor(K)
    assert isinstance(found, factorisations.LuFactor)
    assert found.negative_pivots == 0


def test_what_is_no_chain_or_not_symmetric_is_left_to_superlu() -> None:
    """A ring has a corner far from the diagonal; a full matrix no band; numbers that are not finite are refused."""
    ring = sparse.lil_matrix(sparse.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(40, 40)))
    ring[0, 39] = ring[39, 0] = -1.0
    assert factorisations.factor(sparse.csr_matrix(ring)).name == factorisations.NAME
    assert factorisations.factor(sparse.csr_matrix(np.eye(12) + 1.0)).name == factorisations.NAME
    assert factorisations.factor(tangent(), symmetric=False).name == factorisations.NAME
    K = tangent()
    K.data[5] = np.nan
    with pytest.raises(factorisations.Singular, match="not finite"):
        factorisations.factor(K)


def test_a_pattern_is_known_by_its_arrays_and_numbers_are_each_matrix_own() -> None:
    """Two matrices of one assembly share the pattern; one of other size and place does not."""
    problem = cantilever(12)
    first = problem.assembly.tangent(problem.rest, 0.0)
    second = problem.assembly.pattern.matrix(2.0 * first.data)
    b = np.ones(first.shape[0])
    x = factorisations.factor(first).solve(b)
    known = [entry for entry in banded_cholesky._KNOWN if entry[0]() is first.indptr]
    np.testing.assert_allclose(factorisations.factor(second).solve(b), 0.5 * x, rtol=1e-13)
    assert len(known) == 1
    assert first.indptr is second.indptr
    other = tangent((4,))  # as many entries in other places
    np.testing.assert_allclose(other @ factorisations.factor(other).solve(b), b, atol=1e-9)


def test_a_step_of_a_rod_takes_few_calls() -> None:
    """For 40 segments calls are what takes time: 2550 a step became 660, the solution the same to rounding."""
    problem, calls = cantilever(40), [0]
    equilibrium(problem)

    def count(frame: object, event: str, argument: object) -> None:
        calls[0] += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        found = equilibrium(problem)
    finally:
        sys.setprofile(None)
    assert calls[0] <= 1000 * found.iterations
    assert found.linear_solver == "banded Cholesky (LAPACK)"
    assert found.stable
    tip = found.x.reshape(-1, 7)[-1]
    # as computed by SuperLU, with derivatives by other formulas, before there were bands
    np.testing.assert_allclose([tip[0], tip[2]], [0.11081574114560921, -0.13372918646254428], rtol=1e-11)


def test_a_rod_that_buckles_is_judged_by_its_inertia() -> None:
    """A column under its own weight stays straight below 7.8373 EI / L^3 (Greenhill 1881) and bends above."""
    section = circular(RADIUS, 60e3, 0.49)
    critical = 7.8373 * 60e3 * section.I2 / LENGTH**3 / section.area  # N/m^3, without shear and shortening
    for part, straight in ((0.5, True), (1.2, False)):
        problem = cantilever(20)
        up = RodForces.uniform(
            problem.rest, chain_elements(21), part * critical * section.area * np.array([-1.0, 0.0, 0.0])
        )
        elastic = problem.assembly.internal[0]
        state = equilibrium(replace(problem, assembly=Assembly(126, problem.fixed, [elastic], [up])))
        aside = np.abs(state.x.reshape(-1, 7)[:, 1:3]).max()
        assert state.stable
        assert (aside < 1e-9 * LENGTH) == straight
        assert (state.critical is None) == straight
