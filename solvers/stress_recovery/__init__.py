"""Stress and strain of a solved solid: computed by its law at sampling points, recovered at nodes, and evaluated."""
