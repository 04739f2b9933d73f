"""Models whose displacements are read from result files: declaration, readers, matching to the body, checks."""
