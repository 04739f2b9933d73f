"""Importers that convert input files of other programs to scenes: one reader per format, one record, one writer.

    imported_deck    record of a file's mesh, materials, supports and loads, in the file's own units
    deck_units       units of the file's lengths, stresses and times
    abaqus_deck, gmsh_import, febio_deck, pml_import   readers, which convert a file to a record
    abaqus_materials materials of decks as laws of the language
    abaqus_loads     supports and loads of decks, accumulated over the steps
    deck_amplitudes  variation of loads over a step
    unreferenced_deck_sets   named sets that nothing in the deck refers to
    cell_faces       sides of cells, from facets or from sets of nodes
    xml_numbers      numbers in XML files
    imported_mesh    mesh file next to the scene, with named parts
    scene_writer     writer, which converts a record to the text of a scene
    import_formats   reader of each file extension; to add a format: a module and a line there

solvers/mesh/files/abaqus reads keyword lines and meshes of decks. Nothing is approximated: items that the language
cannot express are listed as not imported.
"""
