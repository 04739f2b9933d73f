"""Exception that a metric raises if it has no value."""

from __future__ import annotations


class Undefined(Exception):
    """Exception of a metric that has no value; its text is the reason."""
