"""Supports of bodies: a support is one file, with its words, what it prescribes, a second formula, and its limits."""
