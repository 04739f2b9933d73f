"""Contact of deformable bodies with rigid ones: gaps, their barrier, and the energy of a surface that keeps clear."""
