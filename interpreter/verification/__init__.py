"""What vouches for an answer: forces found again, stated errors, refined references, expectations.

Imports rooms up to the front. To add a part of the stated error: a file here with a function of an answer, and a line
in `error_estimate`.
"""
