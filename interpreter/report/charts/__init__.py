"""Curves as SVG: axes, marks, colours, and labels that do not meet."""
