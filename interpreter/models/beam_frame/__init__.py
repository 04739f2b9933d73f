"""Beams that meet in rigid joints: words, places, supports and loads, and what builds them."""
