"""Readers of VTK formats: legacy files, and XML files converted to a form that meshio reads."""
