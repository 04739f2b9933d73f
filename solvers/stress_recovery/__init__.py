"""Stress and strain of a solved solid: computed at sampling points by its law, recovered at nodes, and evaluated."""
