"""Solid finite element models: declaration, options, formulations, builder, relaxation and poroelasticity."""
