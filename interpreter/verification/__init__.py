"""Verification of solutions: independent forces, error estimates, refined reference solutions, expectations.

Imports packages up to validation. To add a part of the stated error, add a module here with a function that
returns the part for a solution, and a line in `error_estimate`.
"""
