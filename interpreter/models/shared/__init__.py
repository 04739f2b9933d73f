"""Code that several kinds of model share: supports, loads and contacts on meshes, dynamics, static results,
capabilities.
"""
