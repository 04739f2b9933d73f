"""Rods that other programs solve: in words, and as arrays."""
