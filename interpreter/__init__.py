"""Interpreter: packages from the text of a scene to a report; each imports only those before it (tests/test_rooms.py).

results          reports and their parts, and the files written from them
language         from text to a scene of typed values; contains no word of the vocabulary
vocabulary       words of the experiment: bodies, supports, loads, analyses, probes, studies
problem          one body with everything that acts on it: case, points, surface selections
metrics          numbers computed from an answer, one file each
planning         what a scene requests, and what that needs
models           models: their declarations, and the builders of their arrays
validation       registry of constructors, and checks of a scene before it runs
verification     independent forces, error estimates, expectations
pipeline         one run, from text to report
study            many runs: comparisons, robustness studies, leaderboards
report           pages, tables, figures, files
importers        scenes from meshes and decks of other programs
help             explanations of words and diagnostics
language_server  editor support, one request per file, and syntax highlighting
documentation    the pages, and how they are built
api              softmark from Python
cli              the command `dsl`
"""
