"""Sparse symmetric solvers: ordering, symbolic and numeric Cholesky factorisation, conjugate gradients, multigrid."""
