"""Models that other programs solve: transfer of the problem, execution of the program, and assessment of its answer."""
