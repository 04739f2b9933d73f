"""softmark: a scene language and its interpreter for assessing deformable models."""

__version__ = "0.1.0"
