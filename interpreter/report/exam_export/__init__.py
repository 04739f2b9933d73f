"""Export of a scene as an exam for other programs: problems to solve, and a sheet to evaluate the results."""
