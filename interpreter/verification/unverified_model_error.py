"""Exception for solutions without independent formulas, whose forces are not verified."""

from __future__ import annotations


class NoIndependentFormula(Exception):
    """Exception for solutions for which there is no independent formula."""
