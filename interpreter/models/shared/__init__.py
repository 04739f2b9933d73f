"""What models have in common: supports and loads on meshes, motions, what solving gives, disturbed starts."""
