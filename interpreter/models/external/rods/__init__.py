"""Models of rods that external programs solve: declaration and builder."""
