"""Forces of a computed solution, evaluated again by formulas and code that share nothing with the solvers.

They verify the solvers: a solution whose independent forces do not balance is reported as wrong.
"""
