"""Models that external programs solve: transfer of the problem, execution of the program, and checks of its results."""
