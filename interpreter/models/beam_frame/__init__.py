"""Models of beams that meet in rigid joints: declaration, layout, selection, builder, dynamics and displacements."""
