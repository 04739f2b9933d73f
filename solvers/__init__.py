"""Numerics over plain arrays, usable alone; in rooms, each of which imports only those before it (tests/test_rooms.py).

    base       kernels on disk, late imports, threads, memory
    materials  laws: psi(F), P, dP/dF
    elements   reference cells: shape functions, quadrature, facets
    mesh       points and cells, shapes, files, what elements make of a mesh
    energies   value, gradient, Hessian over local degrees of freedom
    sparse     factorisations and iterations of our own
    assembly   sums of energies over shared degrees of freedom
    linear     which method solves a system
    statics    equilibrium, stability, paths, recovery
    dynamics   integrators, and the march that runs them
    reduced    few unknowns in place of many
    checks     forces found again by other formulas
"""
