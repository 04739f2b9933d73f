"""Exception raised for solutions whose forces cannot be verified, because no independent formula exists."""

from __future__ import annotations


class NoIndependentFormula(Exception):
    """Exception for solutions for which there is no independent formula."""
