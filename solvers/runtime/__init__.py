"""Shared utilities of all solvers, without mechanics: kernels cached on disk, late imports, threads."""
