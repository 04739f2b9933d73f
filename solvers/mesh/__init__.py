"""Meshes: shapes, cells, what an element makes of them, files."""
