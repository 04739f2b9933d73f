"""Beam models with six degrees of freedom per node: declaration, builder, dynamics, relaxation, stress, supports,
tendons.
"""
