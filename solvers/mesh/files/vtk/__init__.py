"""Readers of VTK's formats: legacy files, and XML files in the form that meshio reads."""
