"""Python interface to the solvers without a scene; its names are those of `softmark.solvers`.

A `Solid` is a mesh with a material; clamps and loads are defined on it and on selected parts; `equilibrium` and `march`
solve for its displacements. All quantities are in SI units and numpy arrays. This package combines the other packages
and computes nothing itself. To add a function: define it here, and list its name in `softmark.solvers`.
"""
