"""Results of a solved model in addition to displacements: forces and energies, contacts, stress, vibrations.

To add a result: a module that computes it from a `Solution` when a metric needs it, and a field of
`shared/prepared_model.py: Solution` that provides it.
"""
