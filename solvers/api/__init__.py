"""Solids for programs of their own, without a scene: what `softmark.solvers` offers by name.

A `Solid` is a mesh of a material; clamps and loads are made of it and of what is selected on it; `equilibrium` and
`march` answer. All is in SI units and in arrays of numpy. What is here puts the other rooms together and computes
nothing of its own. To offer one more: a function here, and its name in `softmark.solvers`.
"""
