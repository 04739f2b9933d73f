"""Models whose displacements are read from result files: declaration, readers, matching, checks."""
