"""Python interface to the solvers without a scene; its names are exported by `softmark.solvers`.

A `Solid` is a mesh with a material. Clamps and loads are defined on a solid and on selected nodes or facets;
`equilibrium` and `march` solve for its displacements. All quantities are in SI units and numpy arrays. This package
combines the other packages and computes nothing itself. To add a function: define it here, and list its name in
`softmark.solvers`.
"""
