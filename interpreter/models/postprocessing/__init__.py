"""Results of a solved model other than displacements: forces and energies, contacts, stress, vibrations.

To add one: a module that computes it from a `Solution` when a metric needs it, and a field of
`shared/prepared_model.py: Solution` that passes it on.
"""
