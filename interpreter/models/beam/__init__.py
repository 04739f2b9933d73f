"""Beam models: declaration, builder, dynamics, relaxation, stress, supports, tendons and limits of the theory."""
