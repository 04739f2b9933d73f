"""What other programs' files say, as scenes: a reader for each format, one record for all, one writer.

    record     what a file says of a mesh and of what is done to it, in the file's own units
    units      one unit of the file's lengths, stresses and times, as they were told
    inp, msh, feb, pml    readers: file -> record; solvers/mesh/files/abaqus reads keyword lines and meshes of decks
    inp_laws   materials of decks as laws of the language
    loads_of   supports and loads of decks as they add up from step to step
    amplitudes how the size of loads changes over a step of a deck
    faces      sides of cells: found again from facets and from sets of nodes
    mesh_file  the record's mesh beside the scene, with named parts
    scene      the record as a text of the language
    formats    which ending has which reader: to add a format, a file and a line there

Nothing is approximated: what has no words in the language is listed as left.
"""
