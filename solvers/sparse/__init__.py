"""Sparse symmetric solvers: ordering, symbolic and numeric factorisation, conjugate gradients, multigrid."""
