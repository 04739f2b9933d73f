"""Solid finite element models: declaration, solver options, element formulations, builder, relaxation and
poroelasticity.
"""
