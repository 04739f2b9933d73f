"""Forces of a computed solution, evaluated again by formulas and code that share nothing with the solvers."""
