"""Meshes from files: formats, what may be wrong with them, and readers that end."""
