"""Interpreter: packages from the text of a scene to a report; each imports only those before it (tests/test_rooms.py).

results     what a run leaves: the report and its parts, files of it
language    from text to a scene of typed values; knows no word of the vocabulary
vocabulary  what a scene says of the experiment: bodies, supports, loads, analyses, probes, studies
problem     one body with what acts on it: its case, points, selections, parts of its surface
metrics     a number of an answer, a file each
plan        what a scene asks for, and what that needs
models      ways to answer: words, and what builds arrays of them
front       all that a scene can say, and all that can be wrong with it
evidence    what vouches for an answer: forces found again, stated errors, expectations
run         the pipeline: from a text to its report
study       many runs: comparisons, and walks to the edges of models
report      pages, tables, figures, files
exchange    scenes of other programs' meshes and decks
dictionary  what is said of every word and message
editor      the language server, a request a file, and what colours a scene
pages       the documentation: its pages, and how they are built
face        softmark from Python
cli         `dsl`
"""
