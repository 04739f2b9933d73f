"""Reduced models: displacements x = V q in a space of a few fields V, found once, with few unknowns q to solve for.

basis      the fields: vibration modes, static responses, modal derivatives, principal fields of training states
cells      energies with every cell by itself, and over a chosen part of the cells
sampling   which cells, with which weights, stand for all (ECSW)
projected  energies over q, so that statics and dynamics solve them as they solve any other
"""
