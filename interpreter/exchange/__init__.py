"""What other programs' files say, as scenes: a reader for each format, one record for all, one writer.

    record     what a file says of a mesh and of what is done to it, in the file's own units
    units      one unit of the file's lengths, stresses and times, as they were told
    cards      keyword files of Abaqus and CalculiX, their *INCLUDE followed
    inp, msh, feb, pml    readers: file -> record
    faces      sides of cells: found again from facets and from sets of nodes
    mesh_file  the record's mesh beside the scene, with named parts
    scene      the record as a text of the language
    formats    which ending has which reader: to add a format, a file and a line there

Nothing is approximated: what has no words in the language is listed as left.
"""
