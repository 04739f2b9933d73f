"""Exception for solutions without independent formulas."""

from __future__ import annotations


class NoIndependentFormula(Exception):
    """There is no independent formula for the solution."""
