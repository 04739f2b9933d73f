"""Loads on bodies: a load is one file, with its words, its forces, a second formula for them, and its limits."""
