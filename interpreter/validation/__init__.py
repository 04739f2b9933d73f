"""All that a scene can say, and all that can be wrong with it before anything is built.

    catalogue      every table of words: the one place that knows them all
    load           from a text to a scene, and all that is to be said of it
    check, lints   errors and warnings; `given` of files, `sweeps` of studies, `refinements`, `resolving`, ...

Imports rooms up to the models, of which only the words. To add a check: a function, and a line in `check`.
"""
