"""Results of `dsl run` that are kept, and reused by later runs while nothing that they depend on has changed.

keys     what a result depends on, as one digest, and what cannot be told surely
plain    results as JSON and arrays, and back: of known classes alone, so that no file can make anything else
places   warnings by where they stand in a declaration, which may have moved since
store    the folder: files that are whole or count as not there, and no more than so many
keeper   what a run takes over, and what it leaves
"""
