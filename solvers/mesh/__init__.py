"""Meshes: shapes of bodies, their cells and elements, interpolation on them, and mesh files."""
