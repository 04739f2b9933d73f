"""Decks of Abaqus and CalculiX (`.inp`): keyword lines, and the mesh and the named sets that they define.

cards      keyword lines with their options and data lines, those of *INCLUDE in their place
elements   names of element types
scopes     what a part, an instance or the assembly defines: nodes, elements, sets, surfaces
model      all of a deck's mesh: instances in their places, and sets found by their scoped names
groups     sets and surfaces as named groups of a mesh
"""
