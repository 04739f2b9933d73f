"""Models of rods that other programs solve: declaration and builder."""
