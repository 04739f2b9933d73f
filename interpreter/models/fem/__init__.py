"""Finite elements: `words` for scenes, `levers` and `formulations` with what speaks against them, `build`."""
