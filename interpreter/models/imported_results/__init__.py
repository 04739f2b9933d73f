"""Models whose displacements were computed elsewhere and are read from a file: declaration, readers, matching, checks."""
