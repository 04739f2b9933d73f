"""Sparse positive definite systems, again and again with one pattern: ordering, factorisation, iteration."""
