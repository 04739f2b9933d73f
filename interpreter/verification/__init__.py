"""Verification of answers: independently computed forces, error estimates, refined references and expectations.

Imports packages up to validation. To add a part of the stated error: a module here with a function of an answer, and a
line in `error_estimate`.
"""
