"""Readers of Abaqus and CalculiX decks (`.inp`): keyword lines, and the mesh and named sets that they define.

keyword_lines  keyword lines with their options and data lines, with files of *INCLUDE inserted
element_types  names of element types
deck_scopes    nodes, elements, sets and surfaces that a part, an instance or the assembly defines
deck_mesh      the whole mesh of a deck: placed instances, and sets found by their scoped names
deck_groups    sets and surfaces as named groups of a mesh
"""
