"""Models of frames, that is beams that meet in rigid joints: declaration, layout, builder, dynamics, displacements."""
