"""Readers of VTK formats: legacy files, and XML files converted to the form that meshio reads."""
