"""Mesh files: readers of all formats, with limits on size and memory, and checks of the meshes."""
