"""Shared utilities of all solvers, without mechanics: kernels cached on disk, lazy imports, threads."""
