"""What a solved model is asked for beside its displacements: forces and energies at rest, stresses, vibrations.

To add one: a file that finds it from a `Solution` when a metric asks for it, and a field of `shared/prepared.Solution`
that carries it to `problem/view.View`.
"""
